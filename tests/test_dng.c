// test_dng.c - counts come back exactly, facts survive, other files are refused.
#include "tests/test.h"

#include "core/dng.h"
#include "core/outfile.h"

static struct dng made(int w, int h, enum dng_pattern pattern)
{
    struct dng d = {.w = w,
                    .h = h,
                    .pattern = pattern,
                    .black = 256.5,
                    .white = 4095,
                    .exposure_s = 1.0 / 640,
                    .gain = 2,
                    .utc_s = 1700000000,
                    .camera = "sim"};
    d.raw = calloc((size_t)w * (size_t)h, 2);
    for (int k = 0; k < w * h; k++)
        d.raw[k] = (uint16_t)((unsigned)k * 40503u >> 3);
    return d;
}

static void write_dng(const struct dng *d, const char *path)
{
    void *bytes;
    size_t size;
    struct err e = {0};
    if (!dng_encode(d, &bytes, &size, &e) || !outfile_write(path, bytes, size, &e))
        fail_msg("%s", e.msg);
    free(bytes);
}

TEST(counts_and_facts_come_back)
{
    static const int sizes[][2] = {{1, 1}, {7, 5}, {640, 480}};
    for (size_t k = 0; k < 3; k++)
        for (enum dng_pattern p = DNG_MONO; p <= DNG_BGGR; p++) {
            struct dng d = made(sizes[k][0], sizes[k][1], p), back = {0};
            struct err e = {0};
            write_dng(&d, "test_dng.dng");
            if (!dng_read(&back, "test_dng.dng", &e))
                fail_msg("%s", e.msg);
            unlink("test_dng.dng");
            assert_int_equal(back.w, d.w);
            assert_int_equal(back.h, d.h);
            assert_int_equal(back.pattern, p);
            assert_memory_equal(back.raw, d.raw, (size_t)d.w * (size_t)d.h * 2);
            assert_near(back.black, 256.5, 1e-6);
            assert_int_equal(back.white, 4095);
            assert_near(back.exposure_s, d.exposure_s, 1e-7 * d.exposure_s);
            assert_near(back.gain, 2, 0);
            assert_true(back.utc_s == d.utc_s);
            assert_string_equal(back.camera, "sim");
            dng_finish(&back);
            dng_finish(&d);
        }
}

TEST(the_same_frame_is_the_same_bytes)
{
    struct dng d = made(64, 48, DNG_GBRG);
    void *a, *b;
    size_t na, nb;
    struct err e = {0};
    assert_true(dng_encode(&d, &a, &na, &e) && dng_encode(&d, &b, &nb, &e));
    assert_int_equal(na, nb);
    assert_memory_equal(a, b, na);
    free(a);
    free(b);
    dng_finish(&d);
}

TEST(a_file_that_is_not_ours_is_refused)
{
    struct dng d = made(64, 48, DNG_MONO), back = {0};
    struct err e = {0};
    assert_false(dng_read(&back, "/no/such.dng", &e));
    assert_int_equal(e.code, ERR_FILE);
    outfile_write("test_dng.dng", "hello", 5, &e);
    assert_false(dng_read(&back, "test_dng.dng", &e));
    assert_string_equal(e.msg, "test_dng.dng: not a DNG");
    outfile_write("test_dng.dng", "", 0, &e);
    assert_false(dng_read(&back, "test_dng.dng", &e));
    assert_int_equal(e.code, ERR_DATA);
    void *bytes;
    size_t size;
    assert_true(dng_encode(&d, &bytes, &size, &e));
    for (size_t cut = 0; cut < size; cut += 1 + cut / 20) { // no length reads as a whole file
        outfile_write("test_dng.dng", bytes, cut, &e);
        const bool ok = dng_read(&back, "test_dng.dng", &e);
        assert_true(!ok || !memcmp(back.raw, d.raw, 64 * 48 * 2));
        assert_true(!ok || cut > 64 * 48 * 2);
        dng_finish(&back);
    }
    free(bytes);
    dng_finish(&d);
    unlink("test_dng.dng");
}

TEST(impossible_sizes_are_refused)
{
    struct dng d = made(2, 2, DNG_MONO);
    void *bytes;
    size_t size;
    struct err e = {0};
    d.w = 0;
    assert_false(dng_encode(&d, &bytes, &size, &e));
    assert_int_equal(e.code, ERR_DATA);
    dng_finish(&d);
}

TEST_MAIN(cmocka_unit_test(counts_and_facts_come_back),
          cmocka_unit_test(the_same_frame_is_the_same_bytes),
          cmocka_unit_test(a_file_that_is_not_ours_is_refused),
          cmocka_unit_test(impossible_sizes_are_refused))

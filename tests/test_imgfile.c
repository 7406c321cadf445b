// test_imgfile.c - pictures come back from files as they went in; bad files say why.
#include "core/imgfile.h"
#include "core/infile.h"
#include "core/outfile.h"
#include "tests/test.h"

static const char *temp(const char *name) // in the test's working folder
{
    static char path[4][256];
    static int turn;
    char *p = path[turn++ % 4];
    snprintf(p, sizeof path[0], "imgfile_%s", name);
    return p;
}

static struct image noise(int w, int h, int nc)
{
    struct image im;
    struct err e;
    assert_true(image_init(&im, w, h, nc, &e));
    uint32_t s = 7;
    for (int k = 0; k < w * h * nc; k++) {
        s = s * 1664525 + 1013904223;
        im.px[k] = ldexpf((float)(s >> 8), (int)(s % 40) - 44) - 0.1f;
    }
    return im;
}

static void assert_same_samples(const struct image *a, const struct image *b)
{
    assert_int_equal(a->w, b->w);
    assert_int_equal(a->h, b->h);
    assert_int_equal(a->nc, b->nc);
    assert_memory_equal(a->px, b->px, (size_t)(a->w * a->h * a->nc) * sizeof *a->px);
}

static struct image again(const struct image *im, const char *path)
{
    struct err e = {0};
    struct image back = {0};
    if (!image_write(im, path, &e) || !image_read(&back, path, &e))
        fail_msg("%s", e.msg);
    unlink(path);
    return back;
}

TEST(float_formats_keep_every_bit)
{
    static const struct {
        const char *name;
        int w, h, nc;
    } cases[] = {{"a.exr", 1, 1, 1},   {"b.exr", 37, 41, 3}, {"c.exr", 200, 3, 4},
                 {"d.exr", 64, 64, 2}, {"e.pfm", 37, 41, 3}, {"f.PFM", 1, 5, 1}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct image im = noise(cases[k].w, cases[k].h, cases[k].nc);
        im.px[0] = NAN;
        struct image back = again(&im, temp(cases[k].name));
        assert_same_samples(&im, &back);
        image_finish(&im);
        image_finish(&back);
    }
}

TEST(exr_keeps_the_order_of_channels_and_all_metadata)
{
    struct image im = noise(20, 33, 5);
    const double many[] = {1.0 / 3, -2e-300, 5};
    const double white[] = {0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329};
    meta_set_text(&im.meta, "channels", "Z,0.X,cover,A,sigma.Y");
    meta_set_num(&im.meta, "expTime", 0.0625);
    meta_set_num(&im.meta, "isoSpeed", 100);
    meta_set_text(&im.meta, "capDate", "2024:01:02 03:04:05");
    meta_set_nums(&im.meta, "chromaticities", white, 8);
    meta_set_num(&im.meta, "nacre.lambda_m", 5.3e-7);
    meta_set_nums(&im.meta, "nacre.many", many, 3);
    meta_set_text(&im.meta, "nacre.a_name_that_is_longer_than_31_letters", "text");
    struct image back = again(&im, temp("meta.exr"));
    assert_same_samples(&im, &back);
    assert_string_equal(meta_text(&back.meta, "channels"), "Z,0.X,cover,A,sigma.Y");
    for (int k = 1; k < im.meta.n; k++) {
        const struct meta_item *a = &im.meta.item[k], *b = meta_find(&back.meta, a->key);
        assert_non_null(b);
        if (a->text)
            assert_string_equal(a->text, b->text);
        assert_int_equal(a->n, b->n);
        for (int i = 0; i < a->n; i++)
            assert_near(b->num[i], a->num[i], strncmp(a->key, "nacre", 5) ? 1e-7 : 0);
    }
    assert_int_equal(back.meta.n, im.meta.n);
    image_finish(&im);
    image_finish(&back);
}

TEST(hdr_is_within_half_a_step_of_the_brightest_channel)
{
    static const int widths[] = {1, 7, 8, 300};
    for (int k = 0; k < 4; k++) {
        struct image im = noise(widths[k], 9, 3);
        for (int i = 0; i < im.w * im.h * 3; i++)
            im.px[i] = i % 5 ? fabsf(im.px[i]) : 0.25f; // some runs
        struct image back = again(&im, temp("a.hdr"));
        for (int p = 0; p < im.w * im.h; p++) {
            const float *a = im.px + 3 * p, *b = back.px + 3 * p;
            const double top = (double)fmaxf(a[0], fmaxf(a[1], a[2]));
            for (int c = 0; c < 3; c++)
                assert_near(b[c], a[c], top / 255);
        }
        struct image twice = again(&back, temp("b.hdr"));
        assert_same_samples(&back, &twice);
        image_finish(&im);
        image_finish(&back);
        image_finish(&twice);
    }
}

TEST(png_is_display_srgb_and_tiff_is_linear)
{
    struct image im;
    struct err e;
    assert_true(image_init(&im, 4, 1, 3, &e));
    const float v[12] = {0, 0.5f, 1, -1, 2, NAN, 0.2140411f, 1, 0, 0.25f, 0.5f, 0.75f};
    memcpy(im.px, v, sizeof v);
    struct image png = again(&im, temp("a.png")), tif = again(&im, temp("a.tif"));
    assert_near(png.px[1] * 255, 188, 1e-3);
    assert_near(png.px[3], 0, 0);
    assert_near(png.px[4], 1, 0);
    assert_near(png.px[5], 0, 0);
    assert_near(png.px[6] * 255, 127.5, 0.51); // sRGB 0.5
    for (int k = 9; k < 12; k++)
        assert_near(tif.px[k], v[k], 0.51 / 65535);
    double encoded;
    assert_true(meta_num(&png.meta, "nacre.encoded", &encoded) && encoded == 1);
    assert_true(meta_num(&tif.meta, "nacre.encoded", &encoded) && encoded == 0);
    image_finish(&im);
    image_finish(&png);
    image_finish(&tif);
}

TEST(a_camera_jpeg_brings_its_exposure)
{
    const char *path = shared_or_skip("data/brackets/canon5d/0002.jpg");
    struct image im;
    struct err e;
    double v = 0;
    assert_true(image_read(&im, path, &e));
    assert_int_equal(im.w, 1024);
    assert_int_equal(im.h, 683);
    assert_true(meta_num(&im.meta, "expTime", &v) && v == 1);
    assert_true(meta_num(&im.meta, "isoSpeed", &v) && v == 100);
    assert_true(meta_num(&im.meta, "aperture", &v) && v == 4);
    image_finish(&im);
    path = shared_or_skip("data/brackets/canon7d/IMG_0114.jpg"); // f/4 is 4 in APEX units too
    assert_true(image_read(&im, path, &e));
    assert_true(meta_num(&im.meta, "aperture", &v) && v == 14);
    assert_string_equal(meta_text(&im.meta, "cameraModel"), "Canon EOS 7D");
    image_finish(&im);
}

TEST(a_foreign_radiance_map_reads)
{
    const char *path = shared_or_skip("data/env/pisa.hdr");
    struct image im;
    struct err e;
    assert_true(image_read(&im, path, &e));
    assert_int_equal(im.w, 256);
    assert_int_equal(im.h, 128);
    assert_true(image_check_finite(&im, path, &e));
    image_finish(&im);
}

TEST(bad_files_say_why)
{
    static const struct {
        const char *name, *content;
        int size;
        enum err_code code;
        const char *msg;
    } cases[] = {
        {"none.exr", NULL, 0, ERR_FILE, "cannot open: No such file or directory"},
        {"none.dng", NULL, 0, ERR_FILE, "cannot open: No such file or directory"},
        {"text.jpg", "hello", 5, ERR_DATA, "not a PNG, JPEG or TIFF picture"},
        {"empty.png", "", 0, ERR_DATA, "not a PNG, JPEG or TIFF picture: the file is empty"},
        {"text.exr", "hello", 5, ERR_DATA, "not an OpenEXR file"},
        {"text.pfm", "hello", 5, ERR_DATA, "not a PFM file: must begin with PF or Pf"},
        {"text.hdr", "hello", 5, ERR_DATA, "not a Radiance picture: must begin with #?"},
        {"zero.pfm", "Pf\n0 4\n-1\n", 10, ERR_DATA,
         "bad size 0 x 4: each side must be 1 to 65536 pixels"},
        {"minus.pfm", "Pf\n4 -3\n-1\n", 11, ERR_DATA,
         "bad size 4 x -3: each side must be 1 to 65536 pixels"},
        {"huge.pfm", "PF\n60000 60000\n-1\n", 18, ERR_DATA,
         "cut short: the header asks for 43200000000 bytes of samples, 0 follow"},
        {"long.pfm", "Pf\n1 1\n-1\nabcde", 15, ERR_DATA,
         "wrong size: the header asks for 4 bytes of samples, 5 follow"},
        {"scale.pfm", "Pf\n1 1\n0\nabcd", 13, ERR_DATA,
         "bad PFM header: scale is 0, must be -1 or 1"},
        {"nosize.hdr", "#?RADIANCE\n\n", 12, ERR_DATA, "bad Radiance header: no size line"},
        {"zero.hdr", "#?RADIANCE\n\n-Y 0 +X 5\n", 22, ERR_DATA,
         "bad size 5 x 0: each side must be 1 to 65536 pixels"},
        {"huge.hdr", "#?RADIANCE\n\n-Y 60000 +X 60000\n", 30, ERR_DATA,
         "claims 1.08e+04 million samples in a file of 30 bytes"},
        {"cut.hdr", "#?RADIANCE\n\n-Y 2 +X 1\nabcd", 26, ERR_DATA,
         "damaged or cut short: row 1 of 2 cannot be read"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const char *path = temp(cases[k].name);
        struct err e = {0};
        struct image im = {0};
        char want[512];
        if (cases[k].content)
            assert_true(outfile_write(path, cases[k].content, (size_t)cases[k].size, &e));
        assert_false(image_read(&im, path, &e));
        snprintf(want, sizeof want, "%s: %s", path, cases[k].msg);
        assert_string_equal(e.msg, want);
        assert_int_equal(e.code, cases[k].code);
        assert_null(im.px);
        unlink(path);
    }
}

TEST(a_cut_file_never_reads)
{
    static const char *const names[] = {"cut.exr", "cut.pfm", "cut.hdr", "cut.png", "cut.jpg"};
    for (int k = 0; k < 5; k++) {
        struct image im = noise(40, 50, 3);
        for (int i = 0; i < 6000; i++)
            im.px[i] = fabsf(im.px[i]);
        const char *path = temp(names[k]);
        struct err e = {0};
        size_t size;
        assert_true(image_write(&im, path, &e));
        char *data = infile_slurp(path, 1 << 20, &size, &e);
        assert_non_null(data);
        for (size_t cut = 0; cut < size; cut += cut < 500 || size - cut < 50 ? 7 : 331) {
            struct image back = {0};
            assert_true(outfile_write(path, data, cut, &e));
            if (image_read(&back, path, &e))
                fail_msg("%s reads with %zu of %zu bytes", path, cut, size);
            assert_int_equal(e.code, ERR_DATA);
        }
        free(data);
        unlink(path);
        image_finish(&im);
    }
}

TEST(non_finite_samples_are_named)
{
    struct image im = noise(5, 4, 3);
    struct err e = {0};
    assert_true(image_check_finite(&im, "x.pfm", &e));
    im.px[(2 * 5 + 3) * 3 + 1] = NAN;
    assert_false(image_check_finite(&im, "x.pfm", &e));
    assert_string_equal(e.msg, "x.pfm: pixel (3, 2) is NaN (1 such sample)");
    im.px[0] = INFINITY;
    assert_false(image_check_finite(&im, "x.pfm", &e));
    assert_string_equal(e.msg, "x.pfm: pixel (0, 0) is infinite (2 such samples)");
    image_finish(&im);
}

TEST(a_failed_write_leaves_nothing)
{
    struct image im = noise(5, 4, 2);
    struct err e = {0};
    assert_false(image_write(&im, temp("two.pfm"), &e));
    assert_string_equal(e.msg, "imgfile_two.pfm: PFM holds 1 or 3 channels, not 2: write .exr");
    assert_int_not_equal(access(temp("two.pfm"), F_OK), 0);
    assert_false(image_write(&im, temp("two.hdr"), &e));
    assert_false(image_write(&im, temp("x.gif"), &e));
    assert_string_equal(
        e.msg, "imgfile_x.gif: cannot write '.gif': must be .exr .pfm .hdr .png .jpg .tif");
    assert_false(image_write(&im, "no/such/folder.exr", &e));
    assert_int_equal(e.code, ERR_FILE);
    meta_set_text(&im.meta, "channels", "A,A");
    assert_false(image_write(&im, temp("a.exr"), &e));
    assert_int_equal(e.code, ERR_DATA);
    assert_int_not_equal(access(temp("a.exr"), F_OK), 0);
    image_finish(&im);
}

TEST_MAIN(cmocka_unit_test(float_formats_keep_every_bit),
          cmocka_unit_test(exr_keeps_the_order_of_channels_and_all_metadata),
          cmocka_unit_test(hdr_is_within_half_a_step_of_the_brightest_channel),
          cmocka_unit_test(png_is_display_srgb_and_tiff_is_linear),
          cmocka_unit_test(a_camera_jpeg_brings_its_exposure),
          cmocka_unit_test(a_foreign_radiance_map_reads), cmocka_unit_test(bad_files_say_why),
          cmocka_unit_test(a_cut_file_never_reads), cmocka_unit_test(non_finite_samples_are_named),
          cmocka_unit_test(a_failed_write_leaves_nothing))

// test_cmd_convert.c - nacre convert: pictures and heights from file to file, as a user runs it.
#include "tests/test.h"

#include "core/hfield_file.h"
#include "core/imgfile.h"
#include "core/infile.h"
#include "core/outfile.h"
#include "tests/run.h"

static void write_picture(const char *path, int nc, const char *channels)
{
    struct image im;
    struct err e;
    assert_true(image_init(&im, 12, 9, nc, &e));
    for (int k = 0; k < 12 * 9 * nc; k++)
        im.px[k] = (float)(k % 17) / 20;
    if (channels)
        meta_set_text(&im.meta, "channels", channels);
    if (!image_write(&im, path, &e))
        fail_msg("%s", e.msg);
    image_finish(&im);
}

static struct image read_picture(const char *path)
{
    struct image im = {0};
    struct err e;
    if (!image_read(&im, path, &e))
        fail_msg("%s", e.msg);
    return im;
}

static void assert_runs(const char *words)
{
    const struct run r = run_nacre(words);
    if (r.status)
        fail_msg("nacre %s: exit %d: %s", words, r.status, r.err);
}

static void assert_refused(const char *words, int status, const char *line)
{
    const struct run r = run_nacre(words);
    char want[512];
    snprintf(want, sizeof want, "nacre: convert: %s\n", line);
    assert_string_equal(r.err, want);
    assert_int_equal(r.status, status);
    assert_string_equal(r.out, "");
    assert_int_not_equal(access("out.png", F_OK), 0);
    assert_int_not_equal(access("out.exr", F_OK), 0);
    assert_int_not_equal(access("out.gsf", F_OK), 0);
}

TEST(eight_bit_pictures_become_linear_and_it_says_so)
{
    enter_scratch("convert_8bit");
    write_picture("a.exr", 3, NULL);
    assert_runs("convert a.exr a.png");
    const struct run r = run_nacre("convert a.png b.exr");
    assert_int_equal(r.status, 0);
    assert_string_equal(r.err, "a.png: 8-bit samples taken as sRGB and made linear\n");
    struct image a = read_picture("a.exr"), b = read_picture("b.exr");
    for (int k = 0; k < 12 * 9 * 3; k++)
        assert_near(b.px[k], a.px[k], 0.5 / 255 * 2.5); // half a step, the curve at its steepest
    assert_non_null(strstr(meta_text(&b.meta, "nacre.command"), "convert a.png b.exr"));
    image_finish(&a);
    image_finish(&b);
}

TEST(exposure_counts_in_stops)
{
    enter_scratch("convert_stops");
    write_picture("a.pfm", 1, NULL);
    assert_runs("convert a.pfm b.pfm --exposure -1.5");
    struct image a = read_picture("a.pfm"), b = read_picture("b.pfm");
    for (int k = 0; k < 12 * 9; k++)
        assert_near(b.px[k], a.px[k] * exp2(-1.5), 1e-7);
    image_finish(&a);
    image_finish(&b);
}

TEST(formats_of_three_channels_get_the_colours_of_a_table)
{
    enter_scratch("convert_channels");
    write_picture("a.exr", 7, "X,Y,Z,sigma.X,sigma.Y,sigma.Z,cover");
    const struct run r = run_nacre("convert a.exr b.pfm");
    assert_int_equal(r.status, 0);
    assert_string_equal(r.err, "only the channels X,Y,Z go into a .pfm file\n");
    struct image a = read_picture("a.exr"), b = read_picture("b.pfm");
    assert_int_equal(b.nc, 3);
    for (int k = 0; k < 12 * 9; k++)
        assert_near(b.px[3 * k + 2], a.px[7 * k + 2], 0);
    image_finish(&a);
    image_finish(&b);
    assert_runs("convert a.exr b.png"); // X, Y, Z are shown as sRGB
    write_picture("a.exr", 2, "u,v");
    assert_refused("convert a.exr out.png", 3,
                   "out.png: 2 channels that are neither R,G,B nor X,Y,Z nor Y: write .exr");
}

TEST(heights_need_their_units)
{
    enter_scratch("convert_heights");
    write_picture("h.pfm", 1, NULL);
    write_picture("h.tif", 1, NULL);
    assert_refused("convert h.pfm out.gsf", 3,
                   "h.pfm: the file does not say its node spacing: give --pixel (such as 0.25um)");
    assert_refused("convert h.tif out.gsf --pixel 1um", 3,
                   "h.tif: the file states no height unit: give --z-scale, the height of white "
                   "(such as 0.5um)");
    assert_refused("convert h.tif out.gsf --pixel 1um --z-scale -1um", 3,
                   "--z-scale -1e-06 m: must be positive");
    assert_runs("convert h.tif a.gsf --pixel 0.128um,0.315um --z-scale 0.5um");
    assert_runs("convert a.gsf b.x3p");
    assert_runs("convert b.x3p c.exr --pixel 0.128um,0.315um");
    assert_runs("convert c.exr d.gsf");
    assert_runs("convert d.gsf e.png --z-scale 0.5um");
    struct hfield a = {0}, d = {0};
    struct err e;
    assert_true(hfield_read(&a, "a.gsf", NULL, &e) && hfield_read(&d, "d.gsf", NULL, &e));
    assert_near(a.dx_m, 0.128e-6, 1e-20);
    assert_near(d.dy_m, 0.315e-6, 1e-20);
    for (int k = 0; k < 12 * 9; k++)
        assert_near(a.z[k], k % 17 / 20.0 * 0.5e-6, 0.51 * 0.5e-6 / 65535);
    assert_memory_equal(a.z, d.z, 12 * 9 * sizeof(float));
    struct image tif = read_picture("h.tif"), png = read_picture("e.png");
    assert_memory_equal(tif.px, png.px, 12 * 9 * sizeof(float));
    image_finish(&tif);
    image_finish(&png);
    hfield_finish(&a);
    hfield_finish(&d);
}

// Decoders talk on stderr by themselves: a user must see our line alone.
TEST(a_damaged_picture_gets_one_line)
{
    enter_scratch("convert_damaged");
    static const char *const paths[] = {"a.png", "a.jpg", "a.tif"};
    for (int k = 0; k < 3; k++) {
        struct err e;
        size_t size;
        char words[64], line[128];
        write_picture(paths[k], 3, NULL);
        char *data = infile_slurp(paths[k], 1 << 20, &size, &e);
        for (size_t i = size - 50; i < size - 26; i++) // within the samples
            data[i] =
                (char)(k == 1 ? ((size - i) % 2 ? 0 : 0xff) : ~data[i]); // jpg: ones are no code
        if (k == 2)
            memset(data + size - 120, 0xff, 60); // tif: the directory
        assert_true(outfile_write(paths[k], data, size, &e));
        free(data);
        snprintf(words, sizeof words, "convert %s out.exr", paths[k]);
        snprintf(line, sizeof line, "%s: damaged or cut short: it cannot be decoded", paths[k]);
        assert_refused(words, 3, line);
    }
}

TEST_MAIN(cmocka_unit_test(eight_bit_pictures_become_linear_and_it_says_so),
          cmocka_unit_test(exposure_counts_in_stops),
          cmocka_unit_test(formats_of_three_channels_get_the_colours_of_a_table),
          cmocka_unit_test(heights_need_their_units),
          cmocka_unit_test(a_damaged_picture_gets_one_line))

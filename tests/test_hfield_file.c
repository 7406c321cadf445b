// test_hfield_file.c - heights come back from files in metres; what is not stated is refused.
#include "core/hfield_file.h"
#include "core/infile.h"
#include "core/log.h"
#include "core/outfile.h"
#include "tests/test.h"

static struct hfield bumps(int nx, int ny)
{
    struct hfield hf;
    struct err e;
    assert_true(hfield_init(&hf, nx, ny, 0.128e-6, 0.3145e-6, &e));
    for (int k = 0; k < nx * ny; k++)
        hf.z[k] = (float)(1e-7 * sin(0.7 * k) - 2e-8);
    return hf;
}

static void assert_same_heights(const struct hfield *a, const struct hfield *b)
{
    assert_int_equal(a->nx, b->nx);
    assert_int_equal(a->ny, b->ny);
    assert_memory_equal(a->z, b->z, (size_t)(a->nx * a->ny) * sizeof *a->z);
}

static struct hfield read_back(const char *path, const struct hfield_hints *hints)
{
    struct hfield hf = {0};
    struct err e = {0};
    if (!hfield_read(&hf, path, hints, &e))
        fail_msg("%s", e.msg);
    return hf;
}

static void write_to(const struct hfield *hf, const char *path, const struct hfield_hints *hints)
{
    struct err e = {0};
    if (!hfield_write(hf, path, hints, &e))
        fail_msg("%s", e.msg);
}

TEST(heights_spacing_and_holes_survive_every_lossless_format)
{
    static const char *const paths[] = {"hf_a.gsf", "hf_a.x3p", "hf_a.exr", "hf_a.pfm"};
    const struct hfield_hints hints = {.dx_m = 0.128e-6, .dy_m = 0.3145e-6};
    for (int k = 0; k < 4; k++) {
        struct hfield hf = bumps(17, 5);
        hf.z[7] = NAN;
        meta_set_num(&hf.meta, "nacre.cutoff_per_m", 1.2e6 / 7);
        meta_set_text(&hf.meta, "nacre.note", "a < b & c");
        write_to(&hf, paths[k], NULL);
        struct hfield back = read_back(paths[k], k == 3 ? &hints : NULL);
        assert_same_heights(&hf, &back);
        assert_near(back.dx_m, hf.dx_m, 1e-22);
        assert_near(back.dy_m, hf.dy_m, 1e-22);
        double cutoff = 0;
        if (k < 3) {
            assert_true(meta_num(&back.meta, "nacre.cutoff_per_m", &cutoff));
            assert_near(cutoff, 1.2e6 / 7, 0);
            assert_string_equal(meta_text(&back.meta, "nacre.note"), "a < b & c");
        }
        unlink(paths[k]);
        hfield_finish(&hf);
        hfield_finish(&back);
    }
}

TEST(gsf_to_x3p_to_gsf_is_the_same_file)
{
    struct hfield hf = bumps(33, 21);
    size_t size[2];
    char *data[2];
    struct err e;
    meta_set_nums(&hf.meta, "nacre.offset_m", (double[]){1e-5 / 3, -2e-6}, 2);
    write_to(&hf, "hf_1.gsf", NULL);
    hfield_finish(&hf);
    hf = read_back("hf_1.gsf", NULL); // its spacing is now the quotient of what a GSF can say
    write_to(&hf, "hf_1.gsf", NULL);
    struct hfield one = read_back("hf_1.gsf", NULL);
    write_to(&one, "hf_2.x3p", NULL);
    struct hfield two = read_back("hf_2.x3p", NULL);
    write_to(&two, "hf_3.gsf", NULL);
    data[0] = infile_slurp("hf_1.gsf", 1 << 20, &size[0], &e);
    data[1] = infile_slurp("hf_3.gsf", 1 << 20, &size[1], &e);
    assert_int_equal(size[0], size[1]);
    assert_memory_equal(data[0], data[1], size[0]);
    free(data[0]);
    free(data[1]);
    hfield_finish(&hf);
    hfield_finish(&one);
    hfield_finish(&two);
    unlink("hf_1.gsf");
    unlink("hf_2.x3p");
    unlink("hf_3.gsf");
}

TEST(sixteen_bit_pictures_are_within_half_a_step)
{
    static const char *const paths[] = {"hf_b.tif", "hf_b.png"};
    const struct hfield_hints hints = {.dx_m = 1e-6, .z_scale_m = 0.5e-6};
    log_quiet = true;
    for (int k = 0; k < 2; k++) {
        struct hfield hf = bumps(17, 5);
        double lo, hi;
        hfield_range(&hf, &lo, &hi);
        write_to(&hf, paths[k], &hints);
        struct hfield back = read_back(paths[k], &hints);
        for (int i = 0; i < 17 * 5; i++)
            assert_near(back.z[i], (double)hf.z[i] - lo, 0.51 * 0.5e-6 / 65535);
        assert_near(back.dy_m, 1e-6, 0);
        unlink(paths[k]);
        hfield_finish(&hf);
        hfield_finish(&back);
    }
    log_quiet = false;
}

TEST(a_nanoscope_scan_has_the_size_and_heights_of_its_header)
{
    struct hfield hf = read_back(shared_or_skip("data/heights/di-3.di"), NULL);
    assert_int_equal(hf.nx, 256);
    assert_int_equal(hf.ny, 256);
    assert_near(hf.dx_m * hf.nx, 10e-6, 1e-18);
    assert_near(hf.dy_m * hf.ny, 10e-6, 1e-18);
    // int16 * 24.57563 V / 65536 * 790.3658 nm/V; the last row of the file is row 0
    double lo, hi;
    assert_true(hfield_range(&hf, &lo, &hi));
    assert_near(lo, -2180 * 24.57563 / 65536 * 790.3658e-9, 1e-13);
    assert_near(hi, 1903 * 24.57563 / 65536 * 790.3658e-9, 1e-13);
    assert_near(hf.z[0], hi, 1e-13);
    hfield_finish(&hf);
}

TEST(an_x3p_surface_has_pixels_that_are_not_square)
{
    struct hfield hf = read_back(shared_or_skip("data/heights/x3p-2.x3p"), NULL);
    assert_int_equal(hf.nx, 650);
    assert_int_equal(hf.ny, 650);
    assert_near(hf.dx_m, 1.27656509837346e-7, 1e-22);
    assert_near(hf.dy_m, 3.14582113527746e-7, 1e-22);
    hfield_finish(&hf);
}

TEST(bad_height_files_say_why)
{
#define GSF "Gwyddion Simple Field 1.0\n"
#define SIZE "XRes = 2\nYRes = 2\n"
#define REAL "XReal = 1e-6\nYReal = 2e-6\n"
    static const struct {
        const char *name, *content, *msg;
        enum err_code code;
    } cases[] = {
        {"none.gsf", NULL, "cannot open: No such file or directory", ERR_FILE},
        {"none.x3p", NULL, "cannot open: No such file or directory", ERR_FILE},
        {"none.di", NULL, "cannot open: No such file or directory", ERR_FILE},
        {"none.png", NULL, "cannot open: No such file or directory", ERR_FILE},
        {"text.gsf", "hello", "not a GSF file: must begin with 'Gwyddion Simple Field 1.0'",
         ERR_DATA},
        {"text.x3p", "hello", "not an X3P file, or cut short: it is no zip archive", ERR_DATA},
        {"text.di", "hello", "not a Nanoscope file: must begin with '\\*File list'", ERR_DATA},
        {"text.007", "\\*File list\n", "no height channel: must be Height or ZSensor, has none",
         ERR_DATA},
        {"end.gsf", GSF SIZE, "bad GSF header: it has no end (a NUL byte)", ERR_DATA},
        {"zero.gsf", GSF "XRes = 0\n|", "bad GSF header: XRes is 0, must be 2 to 65536", ERR_DATA},
        {"minus.gsf", GSF "XRes = 4\nYRes = -4\n|",
         "bad GSF header: YRes is -4, must be 2 to 65536", ERR_DATA},
        {"noxy.gsf", GSF SIZE REAL "ZUnits = m\n|||||",
         "the file does not say its node spacing: give --pixel (such as 0.25um)", ERR_DATA},
        {"noz.gsf", GSF SIZE REAL "XYUnits = m\n|||||",
         "the file states no height unit (ZUnits): give --z-scale", ERR_DATA},
        {"volt.gsf", GSF SIZE REAL "XYUnits = m\nZUnits = V\n|", "ZUnits: unit 'V' is not a length",
         ERR_DATA},
        {"flat.gsf", GSF SIZE "XReal = 0\nYReal = 1\nXYUnits = m\nZUnits = m\n|0123456789abcdef",
         "bad node spacing 0 x 0.5 m: must be positive", ERR_DATA},
        {"cut.gsf", GSF SIZE REAL "XYUnits = m\nZUnits = m\n|",
         "cut short: the header asks for 16 bytes of samples, 0 follow", ERR_DATA},
        {"huge.gsf", GSF "XRes=65000\nYRes=65000\n" REAL "XYUnits = m\nZUnits = m\n|",
         "cut short: the header asks for 16900000000 bytes of samples, 0 follow", ERR_DATA},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct err e = {0};
        struct hfield hf = {0};
        char path[64], want[512], text[512];
        snprintf(path, sizeof path, "hf_%s", cases[k].name);
        if (cases[k].content) {
            // '|' stands for NUL padding to the next multiple of 4, samples follow
            size_t n = strcspn(cases[k].content, "|");
            const char *samples = cases[k].content + n + (cases[k].content[n] == '|');
            memset(text, 0, sizeof text);
            memcpy(text, cases[k].content, n);
            if (cases[k].content[n])
                n = (n / 4 + 1) * 4;
            strcpy(text + n, samples);
            n += strlen(samples);
            assert_true(outfile_write(path, text, n, &e));
        }
        assert_false(hfield_read(&hf, path, NULL, &e));
        snprintf(want, sizeof want, "%s: %s", path, cases[k].msg);
        assert_string_equal(e.msg, want);
        assert_int_equal(e.code, cases[k].code);
        assert_null(hf.z);
        unlink(path);
    }
}

TEST(a_cut_height_file_never_reads)
{
    static const char *const paths[] = {"hf_c.gsf", "hf_c.x3p", "hf_c.exr"};
    for (int k = 0; k < 3; k++) {
        struct hfield hf = bumps(20, 20);
        struct err e = {0};
        size_t size;
        write_to(&hf, paths[k], NULL);
        char *data = infile_slurp(paths[k], 1 << 20, &size, &e);
        for (size_t cut = 0; cut < size; cut += 13) {
            struct hfield back = {0};
            assert_true(outfile_write(paths[k], data, cut, &e));
            if (hfield_read(&back, paths[k], NULL, &e))
                fail_msg("%s reads with %zu of %zu bytes", paths[k], cut, size);
            assert_int_equal(e.code, ERR_DATA);
        }
        free(data);
        unlink(paths[k]);
        hfield_finish(&hf);
    }
}

TEST(pictures_of_unknown_scale_are_refused)
{
    struct hfield hf = bumps(6, 4), back = {0};
    struct err e = {0};
    const struct hfield_hints z = {.z_scale_m = 1e-6}, d = {.dx_m = 1e-6}, thin = {0, 0, 1e-9};
    log_quiet = true;
    assert_false(hfield_write(&hf, "hf_d.png", NULL, &e));
    assert_string_equal(e.msg, "hf_d.png: give --z-scale, the height of white (such as 0.5um)");
    assert_false(hfield_write(&hf, "hf_d.png", &thin, &e));
    assert_int_equal(e.code, ERR_DATA);
    assert_int_not_equal(access("hf_d.png", F_OK), 0);
    write_to(&hf, "hf_d.png", &z);
    assert_false(hfield_read(&back, "hf_d.png", &z, &e));
    assert_string_equal(
        e.msg, "hf_d.png: the file does not say its node spacing: give --pixel (such as 0.25um)");
    assert_false(hfield_read(&back, "hf_d.png", &d, &e));
    assert_string_equal(e.msg, "hf_d.png: the file states no height unit: give --z-scale, the "
                               "height of white (such as 0.5um)");
    hf.z[3] = NAN;
    assert_false(hfield_write(&hf, "hf_d.png", &z, &e));
    assert_string_equal(e.msg, "hf_d.png: 1 missing nodes, which a 16-bit picture cannot hold: "
                               "write .gsf, .x3p or .exr");
    hf.z[3] = INFINITY;
    write_to(&hf, "hf_d.gsf", NULL);
    assert_false(hfield_read(&back, "hf_d.gsf", NULL, &e));
    assert_string_equal(e.msg, "hf_d.gsf: node (3, 0) is infinite");
    unlink("hf_d.png");
    unlink("hf_d.gsf");
    hfield_finish(&hf);
    log_quiet = false;
}

TEST_MAIN(cmocka_unit_test(heights_spacing_and_holes_survive_every_lossless_format),
          cmocka_unit_test(gsf_to_x3p_to_gsf_is_the_same_file),
          cmocka_unit_test(sixteen_bit_pictures_are_within_half_a_step),
          cmocka_unit_test(a_nanoscope_scan_has_the_size_and_heights_of_its_header),
          cmocka_unit_test(an_x3p_surface_has_pixels_that_are_not_square),
          cmocka_unit_test(bad_height_files_say_why),
          cmocka_unit_test(a_cut_height_file_never_reads),
          cmocka_unit_test(pictures_of_unknown_scale_are_refused))

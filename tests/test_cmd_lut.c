// test_cmd_lut.c - nacre lut as a user runs it: every input, every refusal.
#include "tests/lobes.h"
#include "tests/run.h"

#include "core/imgfile.h"

static void write_csv(const char *path, const char *rows)
{
    FILE *f = fopen(path, "w");
    fprintf(f, "%s", rows);
    fclose(f);
}

// A small photograph of lobes, mono and in colour, and its geometry record.
static void prepare(void)
{
    enter_scratch("cmd_lut");
    struct spectrum s;
    struct err e = {0};
    assert_true(illuminant_get(&s, "E", &e));
    struct lobes l = lobes_new(40, 2);
    l.h_per_px = 2e-3;
    l.light = &s;
    struct lut_pattern p = lobes_picture(&l, 120, 110, 61.25, 54.5);
    struct image mono, colour, geometry;
    assert_true(image_init(&mono, 120, 110, 1, &e) && image_init(&colour, 120, 110, 3, &e) &&
                image_init(&geometry, 120, 110, 4, &e));
    for (int k = 0; k < 120 * 110; k++) {
        mono.px[k] = p.px[k];
        for (int c = 0; c < 3; c++)
            colour.px[3 * k + c] = p.px[k] * (float)(c + 1);
        geometry.px[4 * k] = (float)((k % 120 - 61.25) * 2e-3);
        geometry.px[4 * k + 1] = (float)((k / 120 - 54.5) * 2e-3);
        geometry.px[4 * k + 2] = 2;
        geometry.px[4 * k + 3] = 0.25f;
    }
    meta_set_text(&geometry.meta, "channels", "u,v,w,weight");
    assert_true(image_write(&mono, "mono.pfm", &e) && image_write(&colour, "colour.exr", &e) &&
                image_write(&geometry, "geometry.exr", &e));
    write_csv("green.csv", "nm,value\n500,0\n520,1\n540,0\n");
    write_csv("unsorted.csv", "nm,power\n400,1\n390,1\n");
    write_csv("gap.csv", "nm,power\n400,1\n405,1\n410,1\n415,1\n430,1\n435,1\n");
    write_csv("dark.csv", "nm,power\n400,0\n500,0\n");
    image_finish(&mono);
    image_finish(&colour);
    image_finish(&geometry);
    lut_pattern_finish(&p);
    spectrum_finish(&s);
}

static struct table read_table(const char *path)
{
    struct table t = {0};
    struct err e = {0};
    if (!table_read(&t, path, NULL, &e))
        fail_msg("%s", e.msg);
    return t;
}

static double difference(const struct table *a, const struct table *b, double scale)
{
    double diff = 0, norm = 0;
    for (size_t k = 0; k < 3 * (size_t)a->n * (size_t)a->n; k++) {
        diff += pow(a->tab[k] - scale * b->tab[k], 2);
        norm += pow(a->tab[k], 2);
    }
    return sqrt(diff / norm);
}

TEST(every_way_to_say_the_same_gives_the_same_table)
{
    static const char *const same[] = {
        "lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --center 61.25,54.5 --method sampled "
        "--wavelengths 801",
        "lut mono.pfm --lambda 0.52um --h-per-pixel 2e-3 --center 61.25,54.5",
        "lut colour.exr --lambda 520nm --channel r --h-per-pixel 2e-3 --center 61.25,54.5",
        "lut colour.exr --lambda 520nm --scale 0.5 --h-per-pixel 2e-3 --center 61.25,54.5",
        "lut mono.pfm --lambda 520nm --geometry geometry.exr --scale 4",
        "lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --center 61.25,54.5 --threads 1",
    };
    prepare();
    struct run r = run_nacre("lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --center 61.25,54.5 "
                             "--illuminant D65 --f0 0.2 --size 65 --range 0.06 --power 3 -o a.exr");
    assert_int_equal(r.status, 0);
    const struct table a = read_table("a.exr");
    assert_non_null(a.cover);
    assert_string_equal(meta_text(&a.meta, "nacre.illuminant"), "D65");
    for (size_t k = 0; k < sizeof same / sizeof *same; k++) {
        char line[400];
        snprintf(line, sizeof line,
                 "%s --illuminant D65 --f0 0.2 --size 65 --range 0.06 --power 3 -o b.exr", same[k]);
        r = run_nacre(line);
        if (r.status)
            fail_msg("%s", r.err);
        struct table b = read_table("b.exr");
        if (!(difference(&a, &b, 1) < 5e-4)) // the sampled method has a cubic spline
            fail_msg("%s: differs by %g", same[k], difference(&a, &b, 1));
        table_finish(&b);
    }
    struct table whole = a;
    table_finish(&whole);
}

TEST(options_change_what_they_should)
{
    prepare();
    struct run r =
        run_nacre("lut mono.pfm --band green.csv --h-per-pixel 2e-3 --range 0.06 --size 33 "
                  "--deband --json -o a.exr");
    assert_int_equal(r.status, 0);
    assert_non_null(strstr(r.out, "\"lambda_nm\": 519.6")); // under its middle: (lm/l)^2
    assert_non_null(strstr(r.out, "\"noise_gain\": 1"));
    r = run_nacre(
        "lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.3 --size 33 -o far.exr");
    assert_int_equal(r.status, 0);
    assert_non_null(strstr(r.err, "of the nodes look beyond what the photograph saw"));
    r = run_nacre("lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --center 61.25,54.5 --range 0.06 "
                  "--size 33 --rgb -o rgb.exr");
    assert_int_equal(r.status, 0);
    r = run_nacre("lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --center 61.25,54.5 --range 0.06 "
                  "--size 33 -o xyz.exr");
    assert_int_equal(r.status, 0);
    struct table rgb = read_table("rgb.exr"), xyz = read_table("xyz.exr");
    assert_true(rgb.is_rgb && !xyz.is_rgb);
    for (int k = 0; k < 33 * 33; k++) {
        const double v[3] = {xyz.tab[3 * k], xyz.tab[3 * k + 1], xyz.tab[3 * k + 2]};
        double want[3];
        xyz_to_rgb(v, want);
        for (int c = 0; c < 3; c++)
            assert_near(rgb.tab[3 * k + c], want[c], 1e-6);
    }
    table_finish(&rgb);
    table_finish(&xyz);
    // the light: the middle of the same picture
    r = run_nacre("lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.06 --size 33 "
                  "--psf mono.pfm --psf-crop 51,44,21,21 -o psf.exr");
    assert_int_equal(r.status, 0);
}

TEST(bad_input_gives_one_line_an_exit_code_and_no_file)
{
    static const struct {
        const char *words;
        int status;
        const char *says;
    } cases[] = {
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --power 2", 3,
         "bad table power 2: must be odd"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --center 120,5", 3,
         "centre (120, 5) is outside the 120 x 110 image"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --center -1,5", 3,
         "centre (-1, 5) is outside the 120 x 110 image"},
        {"lut mono.pfm --lambda 300nm --h-per-pixel 2e-3 --range 0.1", 3,
         "wavelength 300 nm is out of range: must be 380 to 780 nm"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --illuminant D66", 3,
         "unknown illuminant 'D66'"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --illuminant unsorted.csv", 3,
         "unsorted.csv:3: wavelengths must rise"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --illuminant gap.csv", 3,
         "gap.csv: rows missing between 415 and 430 nm"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --illuminant dark.csv", 3,
         "the illuminant has no luminance"},
        {"lut mono.pfm --band dark.csv --h-per-pixel 2e-3 --range 0.1", 3,
         "dark.csv: the band lets no light through"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 0 --range 0.1", 3, "bad h per pixel 0"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 3", 3, "bad table range 3"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --f0 0", 3, "bad F0 0"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --size 1", 3,
         "bad table size 1"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --tolerance 0", 3,
         "bad tolerance 0"},
        {"lut mono.pfm --lambda 520nm --geometry mono.pfm --range 0.1", 3,
         "mono.pfm: not a geometry record: needs the channels u, v, w, weight"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --exponent auto --second "
         "mono.pfm --second-lambda 521nm",
         3, "520 and 521 nm are too close for an exponent"},
        {"lut mono.pfm --band green.csv --deband --method floor --h-per-pixel 2e-3 --range 0.1", 3,
         "only the exact method can undo the photograph's band"},
        {"lut mono.pfm --band green.csv --deband --noise-limit 1 --h-per-pixel 2e-3 --range 0.1", 3,
         "bad noise limit 1: must be above 1"},
        {"lut none.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1", 5, "none.pfm"},
        {"lut mono.pfm --lambda 520nm --range 0.1", 2,
         "give --h-per-pixel X (and --center), or --geometry FILE"},
        {"lut mono.pfm --h-per-pixel 2e-3 --range 0.1", 2,
         "give --lambda L, or --band FILE to take it from"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --center 1", 2,
         "--center needs X,Y or auto, not '1'"},
        {"lut mono.pfm --lambda 520s --h-per-pixel 2e-3 --range 0.1", 2, "--lambda"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --exponent 3", 2,
         "--exponent"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --exponent auto", 2,
         "--second PATTERN --second-lambda L"},
        {"lut mono.pfm --lambda 520nm --h-per-pixel 2e-3 --range 0.1 --deband", 2,
         "--deband needs --band FILE"},
        {"lut mono.pfm --lambda 520nm --geometry geometry.exr --h-per-pixel 1 --range 0.1", 2,
         "--geometry knows where h is"},
    };
    prepare();
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char line[400];
        snprintf(line, sizeof line, "%s -o out.exr", cases[k].words);
        const struct run r = run_nacre(line);
        if (r.status != cases[k].status || !strstr(r.err, cases[k].says) ||
            count_errors(r.err) != 1 || !access("out.exr", F_OK))
            fail_msg("%s: exit %d, %s", cases[k].words, r.status, r.err);
    }
}

TEST_MAIN(cmocka_unit_test(every_way_to_say_the_same_gives_the_same_table),
          cmocka_unit_test(options_change_what_they_should),
          cmocka_unit_test(bad_input_gives_one_line_an_exit_code_and_no_file))

// test_cmd_light.c - nacre calib light and spectral: a simulated ball, sample and grating, and what
// is refused.
#include "tests/test.h"

#include "core/geom.h"
#include "tests/run.h"

static void refused(const char *words, int status, const char *sentence)
{
    assert_refuses(words, status, sentence);
    assert_int_not_equal(access("out.yaml", F_OK), 0);
}

// The numbers behind a key.
static void said(const struct run *r, const char *key, double *out, int n)
{
    char line[80];
    snprintf(line, sizeof line, "\n%s ", key);
    const char *at = strstr(r->out, line);
    assert_non_null(at);
    at += strlen(line);
    for (int k = 0; k < n; k++) {
        char *end;
        out[k] = strtod(at, &end);
        assert_ptr_not_equal(at, end);
        at = *end == ',' ? end + 1 : end;
    }
}

static const struct vec3 camera = {0, 0, 0.5}, light = {0.3, 0.25, 1.1};

static struct vec3 in_camera(struct vec3 a)
{
    return v3(a.x, -a.y, -a.z);
}

static void write_scene(const char *path, struct vec3 at, struct vec3 n, const char *more)
{
    FILE *f = fopen(path, "w");
    fprintf(f,
            "sample: {kind: flat}\n"
            "view:\n  kind: camera\n  width: 640\n  height: 480\n  camera: [0m, 0m, 0.5m]\n"
            "  target: [0m, 0m, 0m]\n  sample: [%gm, %gm, %gm]\n  normal: [%.12g, %.12g, %.12g]\n"
            "  light: [0.3m, 0.25m, 1.1m]\n  light-diameter: 2mm\n  focal: 4mm\n  pixel: 5um\n"
            "  distortion: [-0.08, 0.02, 0.0003, -0.0002, 0]\n  defocus: 0.7px\n%s",
            at.x, at.y, at.z, n.x, n.y, n.z, more);
    fclose(f);
}

// The lens as the simulator has it, and the poses of five samples that mirror the light to the
// camera.
enum { POSES = 5 };
static void write_lens(struct vec3 at[POSES], struct vec3 n[POSES])
{
    static const double place[POSES][3] = {
        {0, 0, 0}, {0.1, -0.05, 0.02}, {-0.1, 0.03, 0}, {0.06, 0.08, -0.02}, {-0.05, -0.08, 0.03}};
    FILE *f = fopen("lens.yaml", "w");
    fprintf(f, "kind: lens\nw: 640\nh: 480\nfocal_px: [800, 800]\nfocal_sigma_px: [0, 0]\n"
               "center_px: [319.5, 239.5]\ncenter_sigma_px: [0, 0]\n"
               "distortion: [-0.08, 0.02, 0.0003, -0.0002, 0]\n"
               "distortion_sigma: [0, 0, 0, 0, 0]\n"
               "board: {cols: 3, rows: 3, square_m: 0.01}\nplane: 0\nviews:\n");
    for (int k = 0; k < POSES; k++) {
        struct frame s;
        at[k] = v3(place[k][0], place[k][1], place[k][2]);
        n[k] = v3_unit(v3_add(v3_unit(v3_sub(light, at[k])), v3_unit(v3_sub(camera, at[k]))));
        assert_true(frame_from(v3(1, 0, 0), n[k], &s));
        const struct vec3 x = in_camera(s.t), y = in_camera(v3_scale(-1, s.b)),
                          z = in_camera(v3_scale(-1, s.n));
        const struct vec3 o = v3_sub(in_camera(v3_sub(at[k], camera)),
                                     v3_scale(0.01, v3_add(x, y))); // the middle is corner (1, 1)
        fprintf(f,
                "- {image: \"b%d.png\", corners: 9, rms_px: 0.01,\n"
                "   rotation: [%.12g, %.12g, %.12g, %.12g, %.12g, %.12g, %.12g, %.12g, %.12g],\n"
                "   origin_m: [%.12g, %.12g, %.12g]}\n",
                k, x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z, o.x, o.y, o.z);
    }
    fclose(f);
}

static void assert_light(const struct run *r, double tolerance_m)
{
    double at[3];
    const struct vec3 truth = in_camera(v3_sub(light, camera));
    said(r, "position_m", at, 3);
    assert_near(v3_norm(v3_sub(v3(at[0], at[1], at[2]), truth)), 0, tolerance_m);
}

TEST(mirror_balls_tell_where_the_light_is)
{
    static const double place[4][3] = {
        {0, 0, 0.05}, {-.1, .07, 0.02}, {.1, .07, 0.02}, {.09, -.07, 0}};
    struct vec3 at[POSES], n[POSES];
    enter_scratch("calib_ball");
    write_lens(at, n);
    for (int k = 0; k < 4; k++) {
        char more[100], words[80];
        snprintf(more, sizeof more, "ball: {at: [%gm, %gm, %gm], radius: 40mm}\n", place[k][0],
                 place[k][1], place[k][2]);
        write_scene("scene.yaml", v3(0, 0, 0), v3(0, 0, 1), more);
        snprintf(words, sizeof words, "simulate scene.yaml --what ball -o ball%d.png", k);
        do_run(words);
    }
    const struct run r = do_run("calib light ball0.png ball1.png ball2.png ball3.png --lens "
                                "lens.yaml --radius 40mm -o light.yaml");
    assert_light(&r, 1e-3);
    do_run("calib geometry lens.yaml --light light.yaml -o geometry.exr");
    assert_int_equal(system("sed '1idate: \"2020-02-01\"' lens.yaml > old.yaml"), 0);
    do_run("calib geometry old.yaml --light light.yaml -o old.exr");
    refused(
        "calib spectral --lambda 530nm --grating ball0.png --lines 600/mm --geometry old.exr -o "
        "out.yaml",
        3, "old.exr: made on 2020-02-01 and valid for 30 days, but this is of 20");

    refused("calib light ball0.png --lens lens.yaml --radius 40mm -o out.yaml", 3,
            "one picture tells only the direction of the light");
    refused("calib light ball0.png ball0.png --lens lens.yaml --radius 40mm -o out.yaml", 3,
            "the lines to the light are parallel");
    refused("calib light ball0.png ball1.png --radius 40mm -o out.yaml", 2, "give the camera");
    refused("calib light ball0.png ball1.png --lens lens.yaml --radius 40mm --ball 1,2 -o out.yaml",
            2, "--ball: needs X,Y,RADIUS for each of the 2 pictures");
    do_run("simulate sim -o other.exr");
    refused("calib light ball0.png other.exr --lens lens.yaml --radius 40mm -o out.yaml", 3,
            "other.exr: lens.yaml: made at 640 x 480 pixels, but this is 1000 x 1000");
    write_scene("scene.yaml", v3(0, 0, 0), v3(0, 0, 1),
                "ball: {at: [0m, 0m, 0m], radius: 40mm, inside: 0.3, outside: 0.3}\n");
    do_run("simulate scene.yaml --what ball -o none.png");
    refused("calib light ball0.png none.png --lens lens.yaml --radius 40mm -o out.yaml", 3,
            "none.png: ");
}

TEST(specular_lobes_tell_where_the_light_is)
{
    struct vec3 at[POSES], n[POSES];
    enter_scratch("calib_lobe");
    write_lens(at, n);
    for (int k = 0; k < POSES; k++) {
        char words[80];
        write_scene("scene.yaml", at[k], n[k], "");
        snprintf(words, sizeof words, "simulate scene.yaml --what pattern -o lobe%d.exr", k);
        do_run(words);
    }
    struct run r = do_run("calib light lobe0.exr lobe1.exr lobe2.exr lobe3.exr lobe4.exr --lens "
                          "lens.yaml -o light.yaml");
    assert_light(&r, 1e-4);
    r = do_run("calib light lobe4.exr lobe2.exr lobe1.exr --lens lens.yaml --poses "
               "b4.png,b2.png,b1.png -o light.yaml");
    assert_light(&r, 1e-4);
    refused("calib light lobe4.exr lobe2.exr --lens lens.yaml -o out.yaml", 2,
            "2 pictures, but the lens record has 5 views");
    refused("calib light lobe4.exr lobe2.exr --lens lens.yaml --poses b4.png,x.png -o out.yaml", 3,
            "the lens record has no view x.png");
}

static void write_curve(const char *path, double centre_nm, double width_nm, int step_nm)
{
    FILE *f = fopen(path, "w");
    fprintf(f, "nm,value\n");
    for (int l = 380; l <= 780; l += step_nm)
        fprintf(f, "%d,%.9g\n", l, exp(-4 * log(2) * pow((l - centre_nm) / width_nm, 2)));
    fclose(f);
}

TEST(a_grating_catches_a_wrong_wavelength)
{
    double nm;
    enter_scratch("calib_spectral");
    FILE *f = fopen("scene.yaml", "w");
    fprintf(f, "sample: {kind: blazed, lines: 600/mm, blaze: 13deg}\n"
               "view: {width: 500, height: 500, h-per-pixel: 1.45e-3}\n");
    fclose(f);
    do_run("simulate scene.yaml --what pattern --filter green -o pattern.exr"); // 530 nm
    write_curve("led.csv", 560, 90, 5);
    write_curve("true.csv", 530, 20, 1);
    write_curve("readme.csv", 520, 10, 1);

    // Gaussians: the product's centre weighs theirs by 1 / width^2
    struct run r = do_run("calib spectral true.csv led.csv --grating pattern.exr --lines 600/mm "
                          "--h-per-pixel 1.45e-3 -o good.yaml");
    said(&r, "lambda_nm", &nm, 1);
    assert_near(nm, (530 / 400. + 560 / 8100.) / (1 / 400. + 1 / 8100.), 0.1);
    said(&r, "width_nm", &nm, 1);
    assert_near(nm, 1 / sqrt(1 / 400. + 1 / 8100.), 0.1);
    said(&r, "grating.lambda_nm", &nm, 1);
    assert_near(nm, 530, 0.5);
    assert_non_null(strstr(r.out, "grating.agrees           yes"));
    assert_null(strstr(r.err, "warning"));

    r = do_run("calib spectral readme.csv --grating pattern.exr --lines 600/mm --h-per-pixel "
               "1.45e-3 -o wrong.yaml");
    assert_non_null(strstr(r.out, "grating.agrees           no"));
    assert_non_null(strstr(r.err, "warning: the grating shows 530."));
    r = do_run("calib spectral --lambda 520nm --grating pattern.exr --lines 600/mm --h-per-pixel "
               "1.45e-3 -o wrong.yaml");
    assert_non_null(strstr(r.err, "but the curves say 520.0 +- 1.0 nm"));

    r = do_run("lut pattern.exr --band good.yaml --deband --h-per-pixel 1.45e-3 --range 0.3 --size "
               "64 -o lut.exr");
    said(&r, "lambda_nm", &nm, 1);
    assert_near(nm, 531.2, 0.3); // the pattern weighs lambda^-2
    do_run("calib spectral --lambda 650nm -o red.yaml");
    refused("lut pattern.exr --band red.yaml --h-per-pixel 1.45e-3 --range 0.3 --size 64 -o "
            "out.yaml",
            3, "red.yaml: made for 650 nm, but this was taken at 530 nm");
    refused("calib spectral true.csv --grating pattern.exr --h-per-pixel 1e-3 -o out.yaml", 2,
            "--grating needs its --lines");
    refused("calib spectral true.csv --grating pattern.exr --lines 300/mm --h-per-pixel 1.45e-3 -o "
            "out.yaml",
            3, "no first-order ring of 300 lines/mm stands out");
    write_curve("blue.csv", 400, 5, 1);
    assert_int_equal(system("head -40 blue.csv > cut.csv"), 0);
    assert_int_equal(system("(echo nm,value; tail -40 true.csv) > end.csv"), 0);
    refused("calib spectral cut.csv end.csv -o out.yaml", 3,
            "the curves have no wavelength in common");
    refused("calib spectral -o out.yaml", 2, "give curves");
}

TEST_MAIN(cmocka_unit_test(mirror_balls_tell_where_the_light_is),
          cmocka_unit_test(specular_lobes_tell_where_the_light_is),
          cmocka_unit_test(a_grating_catches_a_wrong_wavelength))

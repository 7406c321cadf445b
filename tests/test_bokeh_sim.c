// test_bokeh_sim.c - simulated bokeh photographs through calibration and nacre bokeh, judged by the
// simulator's truth; and what is no such photograph, refused with numbers.
#include "tests/run.h"

#include "calib/response_file.h"
#include "core/hfield_file.h"
#include "core/imgfile.h"
#include "sim/optics_ref.h"
#include "tests/noise.h"

static const double M_PER_PX = 77e-9, RADIUS = 300, CX = 371.3, CY = 352.8, LEVEL = 0.5,
                    FLOOR = 0.4, SHADE = 0.12;
#define HEIGHT_M (tan(13 * M_PI / 180) / 6e5) // of the blaze; the phone has the same

static const char blazed[] = "kind: blazed, lines: 600/mm, blaze: 13deg, r0: 0.9";
static const char phone[] = "kind: lcd, pitch: [6.2um, 7.8um], opening: [0.7, 0.75], "
                            "depth: 384.78nm, turn: 9.4deg";

static void simulate(const char *name, const char *sample, const char *bokeh)
{
    char line[300], path[40];
    snprintf(path, sizeof path, "%s.yaml", name);
    FILE *f = fopen(path, "w");
    fprintf(f,
            "sample: {%s}\nbokeh: {width: 760, height: 700, pixel: 77nm, turn: 90deg, relief: "
            "384.78nm, %s}\n",
            sample, bokeh);
    fclose(f);
    snprintf(line, sizeof line, "simulate %s.yaml --what bokeh -o %s.exr", name, name);
    const struct run r = run_nacre(line);
    if (r.status)
        fail_msg("%s", r.err);
}

static const char middle[] =
    "center-x: 371.3px, center-y: 352.8px, radius: 300px, blur-blue: 1.9px";

// Shot noise of 40,000 electrons at the level of white.
static void add_noise(const char *from, const char *to)
{
    struct image im;
    struct err e;
    uint64_t seed = 5;
    assert_true(image_read(&im, from, &e));
    for (int k = 0; k < im.w * im.h * im.nc; k++)
        im.px[k] =
            (float)fmax(0, (double)im.px[k] + 0.005 * sqrt(LEVEL * fmax(1e-4, (double)im.px[k])) *
                                                  noise_gauss(&seed));
    assert_true(image_write(&im, to, &e));
    image_finish(&im);
}

static double number(const struct run *r, const char *key, int skip)
{
    const char *at = r->out;
    for (int k = 0; k <= skip; k++) {
        at = strstr(at, key);
        if (!at)
            fail_msg("no %s in %s %s", key, r->out, r->err);
        at += strlen(key);
    }
    return strtod(at + strspn(at, "\": [\n"), NULL);
}

static struct hfield read_field(const char *path)
{
    struct hfield hf;
    struct err e = {0};
    if (!hfield_read(&hf, path, NULL, &e))
        fail_msg("%s", e.msg);
    return hf;
}

// Relative L2 distance of the first-order diffraction (T17 App. B) at orders of a lattice.
static double diffraction_error(struct hfield *a, struct hfield *b, double px_m, double py_m,
                                double turn)
{
    enum { M = 3, N = (2 * M + 1) * (2 * M + 1) - 1 };
    struct uvw at[N];
    double complex sa[N], sb[N];
    const double lambda_m = 550e-9;
    struct err e;
    int n = 0;
    for (int q = -M; q <= M; q++)
        for (int p = -M; p <= M; p++) {
            const double u = p * lambda_m / px_m, v = q * lambda_m / py_m;
            if ((p || q) && (isfinite(py_m) || !q))
                at[n++] =
                    (struct uvw){cos(turn) * u - sin(turn) * v, sin(turn) * u + cos(turn) * v, 2};
        }
    const struct optics_ref of_a = {a, 20e-6, true}, of_b = {b, 20e-6, true};
    assert_true(optics_ref_amplitude(&of_a, at, n, lambda_m, sa, &e));
    assert_true(optics_ref_amplitude(&of_b, at, n, lambda_m, sb, &e));
    double miss = 0, all = 0;
    for (int k = 0; k < n; k++) {
        miss += pow(cabs(sa[k] - sb[k]), 2);
        all += pow(cabs(sb[k]), 2);
    }
    return sqrt(miss / all);
}

// RMSE relative to the height, means taken off; `truth` loses its mean.
static double rmse(const struct hfield *hf, struct hfield *truth)
{
    const int n = hf->nx * hf->ny;
    double a = 0, b = 0, sum = 0;
    for (int k = 0; k < n; k++) {
        a += (double)hf->z[k] / n;
        b += (double)truth->z[k] / n;
    }
    for (int k = 0; k < n; k++) {
        truth->z[k] -= (float)b;
        sum += pow((double)hf->z[k] - a - (double)truth->z[k], 2) / n;
    }
    return sqrt(sum) / HEIGHT_M;
}

static struct hfield like(const struct hfield *hf)
{
    struct hfield out;
    struct err e;
    assert_true(hfield_init(&out, hf->nx, hf->ny, hf->dx_m, hf->dy_m, &e));
    return out;
}

static void assert_within_the_paper(bool noisy, double miss, double light)
{
    print_message("%s: RMSE %.2f %%, diffraction %.2f %%\n", noisy ? "noisy" : "clean", 100 * miss,
                  100 * light);
    assert_true(miss < (noisy ? 0.0583 : 0.03));
    assert_true(light < 0.1);
}

TEST(a_blazed_grating_comes_back_within_three_percent_and_with_noise_within_the_papers_figure)
{
    enter_scratch("bokeh_sim");
    simulate("blazed", blazed, middle);
    add_noise("blazed.exr", "blazed_noisy.exr");
    for (int noisy = 0; noisy < 2; noisy++) {
        struct run r =
            run_nacre(noisy ? "calib bokeh blazed_noisy.exr --lines 600/mm --blaze 13deg "
                              "-o noisy.yaml --json"
                            : "calib bokeh blazed.exr --lines 600/mm --blaze 13deg "
                              "-o clean.yaml --json");
        if (r.status)
            fail_msg("%s", r.err);
        r = run_nacre(noisy ? "bokeh blazed_noisy.exr --calibration noisy.yaml -o blazed.gsf --json"
                            : "bokeh blazed.exr --calibration clean.yaml -o blazed.gsf --json");
        assert_non_null(strstr(r.out, "\"averaged_along_lines\": true"));
        assert_near(number(&r, "period_m", 0) * 6e5, 1, 0.005);
        assert_near(number(&r, "direction_deg", 0), 0, 0.2);
        struct hfield hf = read_field("blazed.gsf"), truth = like(&hf);
        const double phase0 = (CY - round(CY)) * M_PER_PX * 6e5; // of the middle node
        for (int k = 0; k < hf.nx * hf.ny; k++) {
            double sum = 0; // mean over the pixel
            for (int p = 0; p < 20; p++) {
                const double t =
                    ((k % hf.nx - hf.nx / 2) + (p + 0.5) / 20 - 0.5) * M_PER_PX * 6e5 + phase0;
                sum += (t - floor(t)) / 20;
            }
            truth.z[k] = (float)(HEIGHT_M * sum);
        }
        const double miss = rmse(&hf, &truth);
        const double light = diffraction_error(&hf, &truth, 1 / 6e5, INFINITY, 0);
        assert_within_the_paper(noisy, miss, light);
        hfield_finish(&hf);
        hfield_finish(&truth);
    }
}

TEST(a_phone_comes_back_within_three_percent_with_its_periods_and_diffracts_as_it_should)
{
    simulate("phone", phone, middle);
    simulate("sharp", phone, "center-x: 371.3px, center-y: 352.8px, radius: 300px, blur-blue: 0px");
    add_noise("phone.exr", "phone_noisy.exr");
    struct image sharp;
    struct err e;
    assert_true(image_read(&sharp, "sharp.exr", &e));
    for (int noisy = 0; noisy < 2; noisy++) {
        const struct run r =
            run_nacre(noisy ? "bokeh phone_noisy.exr --calibration noisy.yaml -o phone.gsf --json"
                            : "bokeh phone.exr --calibration clean.yaml -o phone.gsf --json");
        if (r.status)
            fail_msg("%s", r.err);
        assert_non_null(strstr(r.out, "\"folded\": \"lattice\""));
        assert_near(number(&r, "period_m", 0) / (6.2e-6 / 3), 1, 0.005); // three equal sub-pixels
        assert_near(number(&r, "period_m", 1) / 7.8e-6, 1, 0.005);
        assert_near(number(&r, "direction_deg", 0), 9.4, 0.2);
        assert_near(number(&r, "direction_deg", 1), -80.6, 0.2);
        struct hfield hf = read_field("phone.gsf"), truth = like(&hf);
        for (int y = 0; y < hf.ny; y++)
            for (int x = 0; x < hf.nx; x++) { // the sensor shows it turned by a quarter
                const int i = (int)lround(CX) + y - hf.ny / 2, j = (int)lround(CY) - x + hf.nx / 2;
                const double r2 = (pow(i - CX, 2) + pow(j - CY, 2)) / (RADIUS * RADIUS);
                const double light =
                    (double)sharp.px[(j * sharp.w + i) * 3 + 2] / (LEVEL * (1 - SHADE * r2));
                truth.z[y * hf.nx + x] = (float)(HEIGHT_M * (light - FLOOR) / (1 - FLOOR));
            }
        const double miss = rmse(&hf, &truth);
        const double light = diffraction_error(&hf, &truth, 6.2e-6 / 3, 7.8e-6, 9.4 * M_PI / 180);
        assert_within_the_paper(noisy, miss, light);
        hfield_finish(&hf);
        hfield_finish(&truth);
    }
    image_finish(&sharp);
}

TEST(a_tile_of_a_phone_repeats_and_a_window_ends_level)
{
    struct run r =
        run_nacre("bokeh phone.exr --calibration clean.yaml --edge tile -o t.gsf --json");
    assert_true(number(&r, "tile_strain", 0) < 0.01);
    assert_near(number(&r, "tile_turned_deg", 0), 9.4, 0.1);
    assert_near(number(&r, "period_m", 0) / (6.2e-6 / 3), 1, 0.01);
    struct hfield hf = read_field("t.gsf");
    double over = 0, inside = 0; // mean square steps from a column to the next
    for (int y = 0; y < hf.ny; y++)
        for (int x = 0; x < hf.nx; x++) {
            const double d =
                pow((double)hf.z[y * hf.nx + (x + 1) % hf.nx] - (double)hf.z[y * hf.nx + x], 2);
            *(x == hf.nx - 1 ? &over : &inside) += x == hf.nx - 1 ? d : d / (hf.nx - 1);
        }
    print_message("%d x %d, steps %.3g inside, %.3g over the border\n", hf.nx, hf.ny,
                  sqrt(inside / hf.ny), sqrt(over / hf.ny));
    assert_true(over < 2 * inside);
    hfield_finish(&hf);
    r = run_nacre("bokeh phone.exr --calibration clean.yaml --edge window -o w.gsf --json");
    assert_int_equal(r.status, 0);
    hf = read_field("w.gsf");
    for (int x = 0; x < hf.nx; x++)
        assert_near(hf.z[x] / HEIGHT_M, hf.z[(hf.ny - 1) * hf.nx + x] / HEIGHT_M, 1e-3);
    hfield_finish(&hf);
}

TEST(each_channel_has_its_own_scale)
{
    struct run blue = run_nacre("bokeh phone.exr --calibration clean.yaml -o b.gsf --json"),
               red = run_nacre(
                   "bokeh phone.exr --calibration clean.yaml --channel r -o r.gsf --json");
    assert_int_equal(red.status, 0);
    assert_near(number(&red, "height_sd_m", 0) / number(&blue, "height_sd_m", 0), 1, 0.05);
}

TEST(eight_bit_photographs_are_made_linear_and_say_so)
{
    assert_int_equal(run_nacre("convert phone.exr phone.png").status, 0);
    const struct run r = run_nacre("bokeh phone.png --calibration clean.yaml -o p.gsf --json"),
                     blue = run_nacre("bokeh phone.exr --calibration clean.yaml -o b.gsf --json");
    assert_int_equal(r.status, 0);
    assert_non_null(strstr(r.err, "8-bit samples taken as sRGB and made linear"));
    assert_near(number(&r, "height_sd_m", 0) / number(&blue, "height_sd_m", 0), 1, 0.02);
}

TEST(what_eight_bits_mean_can_be_told)
{
    struct response srgb;
    struct record rec;
    struct err e;
    response_srgb(&srgb, 3);
    record_init(&rec, "response", "tests", 0.01, "none");
    assert_true(response_write(&srgb, &rec, "test", "response.yaml", &e));
    const struct run r = run_nacre("bokeh phone.png --calibration clean.yaml -o p.gsf --json"),
                     same = run_nacre("bokeh phone.png --calibration clean.yaml -o q.gsf --json "
                                      "--response response.yaml"),
                     light = run_nacre("bokeh phone.png --calibration clean.yaml -o q.gsf --json "
                                       "--response linear");
    assert_int_equal(same.status, 0);
    assert_near(number(&same, "height_sd_m", 0) / number(&r, "height_sd_m", 0), 1, 1e-3);
    assert_true(number(&light, "height_sd_m", 0) < 0.95 * number(&r, "height_sd_m", 0));
    assert_int_equal(run_nacre("bokeh phone.png --calibration clean.yaml --response none.yaml "
                               "-o never.gsf")
                         .status,
                     5);
    const struct run exr = run_nacre("deconvolve phone.exr --sigma 1.9 --response response.yaml "
                                     "-o never.exr");
    assert_int_equal(exr.status, 3);
    assert_non_null(strstr(exr.err, "not of 8 bits"));
    assert_int_not_equal(access("never.exr", F_OK), 0);
}

TEST(what_is_no_bokeh_photograph_is_refused_with_its_numbers)
{
    static const struct {
        const char *name, *sample, *bokeh, *sentence;
    } cases[] = {
        {"cut", phone, "center-x: 200px, center-y: 350px, radius: 300px", "cut by the frame"},
        {"small", phone, "center-x: 371px, center-y: 350px, radius: 12px", "disc"},
        {"fine", "kind: blazed, lines: 3000/mm, blaze: 13deg, r0: 0.9", middle,
         "finer ones than the optics show"},
        {"limit", "kind: blazed, lines: 2100/mm, blaze: 24deg, r0: 0.9", middle,
         "at the limit of the optics: their second harmonic is"},
    };
    char line[200];
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        simulate(cases[k].name, cases[k].sample, cases[k].bokeh);
        if (k == 3) { // without noise even a trace would be told apart
            snprintf(line, sizeof line, "%s.exr", cases[k].name);
            add_noise(line, line);
        }
        snprintf(line, sizeof line, "calib bokeh %s.exr --lines 600/mm --blaze 13deg -o never.yaml",
                 cases[k].name);
        const struct run r = run_nacre(line);
        print_message("%s", r.err);
        assert_int_equal(r.status, 3);
        if (!strstr(r.err, cases[k].sentence))
            fail_msg("'%s' lacks '%s'", r.err, cases[k].sentence);
        assert_int_not_equal(access("never.yaml", F_OK), 0);
    }
    struct image im, two;
    struct err e;
    simulate("left", phone, "center-x: 180px, center-y: 350px, radius: 160px");
    simulate("right", phone, "center-x: 560px, center-y: 350px, radius: 150px");
    assert_true(image_read(&im, "left.exr", &e) && image_read(&two, "right.exr", &e));
    static const char *const sentences[] = {"two discs: bright areas of",
                                            "is saturated:", "no disc"};
    for (int k = 0; k < 3; k++) {
        for (int m = 0; m < im.w * im.h * im.nc; m++)
            im.px[m] = k == 0 ? im.px[m] + two.px[m] : k == 1 ? fminf(two.px[m], 0.3f) : 0.2f;
        assert_true(image_write(&im, "bad.exr", &e));
        const struct run r = run_nacre("bokeh bad.exr --calibration clean.yaml -o never.gsf");
        print_message("%s", r.err);
        assert_int_equal(r.status, 3);
        if (!strstr(r.err, sentences[k]))
            fail_msg("'%s' lacks '%s'", r.err, sentences[k]);
        assert_int_not_equal(access("never.gsf", F_OK), 0);
    }
    image_finish(&im);
    image_finish(&two);
}

TEST_MAIN(
    cmocka_unit_test(
        a_blazed_grating_comes_back_within_three_percent_and_with_noise_within_the_papers_figure),
    cmocka_unit_test(
        a_phone_comes_back_within_three_percent_with_its_periods_and_diffracts_as_it_should),
    cmocka_unit_test(a_tile_of_a_phone_repeats_and_a_window_ends_level),
    cmocka_unit_test(each_channel_has_its_own_scale),
    cmocka_unit_test(eight_bit_photographs_are_made_linear_and_say_so),
    cmocka_unit_test(what_eight_bits_mean_can_be_told),
    cmocka_unit_test(what_is_no_bokeh_photograph_is_refused_with_its_numbers))

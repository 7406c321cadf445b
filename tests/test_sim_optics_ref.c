// test_sim_optics_ref.c - the direct sums against tables that another program made, and theory.
#include "tests/test.h"

#include "core/imgfile.h"
#include "sim/optics_ref.h"

enum { POINTS = 1440 };

// The file prints u and v to 12 digits, which alone is 2e-9 of a dark colour; they are nodes of the
// table that case.json names (501 nodes, R = 2, p = 5).
static double node_near(double u)
{
    const double s = copysign(pow(fabs(u) / 2, 0.2), u), k = rint(250 * s);
    assert_near(s, k / 250, 1e-9);
    return 2 * pow(k / 250, 5);
}

// Points of the file in its order, which keeps equal w together.
static int read_truth(const char *path, struct uvw *at, double (*xyz)[3])
{
    FILE *f = fopen(path, "r");
    char row[400];
    int n = 0;
    while (n < POINTS && fgets(row, sizeof row, f))
        n += sscanf(row, "%lf,%lf,%lf,%lf,%lf,%lf", &at[n].u, &at[n].v, &at[n].w, &xyz[n][0],
                    &xyz[n][1], &xyz[n][2]) == 6;
    fclose(f);
    for (int k = 0; k < n; k++) {
        at[k].u = node_near(at[k].u);
        at[k].v = node_near(at[k].v);
    }
    return n;
}

static void read_height(const char *path, double step_m, struct hfield *h)
{
    struct image im;
    struct err e = {0};
    if (!image_read(&im, path, &e) || !hfield_init(h, im.w, im.h, step_m, step_m, &e))
        fail_msg("%s", e.msg);
    memcpy(h->z, im.px, (size_t)(im.w * im.h) * sizeof *h->z);
    image_finish(&im);
}

TEST(sums_agree_with_the_reference_tables_to_1e_9)
{
    static struct uvw at[POINTS];
    static double truth[POINTS][3], ours[POINTS][3];
    static const char *const names[] = {"blazed", "quasi", "rough"};
#ifdef __SANITIZE_ADDRESS__
    const int few = 240;
#else
    const int few = 24;
#endif
    const int stride = getenv("NACRE_ALL_POINTS") ? 1 : few;
    struct spectrum e_light;
    struct err e = {0};
    assert_true(illuminant_get(&e_light, "E", &e));
    for (int f = 0; f < 3; f++) {
        char path[100];
        struct hfield h;
        snprintf(path, sizeof path, "reference/tables/truth_%s.csv", names[f]);
        int n = read_truth(shared_or_skip(path), at, truth);
        assert_int_equal(n, POINTS);
        for (int k = 0; k * stride < n; k++) {
            at[k] = at[k * stride];
            memcpy(truth[k], truth[k * stride], sizeof truth[k]);
        }
        n /= stride;
        snprintf(path, sizeof path, "reference/tables/height_%s.pfm", names[f]);
        read_height(shared_or_skip(path), 65e-6 / 256, &h);
        const struct optics_ref o = {&h, 65e-6, false};
        if (!optics_ref_xyz(&o, &e_light, at, n, ours, &e))
            fail_msg("%s", e.msg);
        double worst = 0, sum = 0, off = 0;
        for (int k = 0; k < n; k++) {
            double value2 = 0, off2 = 0;
            for (int c = 0; c < 3; c++) {
                value2 += truth[k][c] * truth[k][c];
                off2 += pow(ours[k][c] - truth[k][c], 2);
            }
            worst = fmax(worst, sqrt(off2 / value2));
            sum += value2;
            off += off2;
        }
        print_message("%s: %d points, relative error at worst %.1e, L2 %.1e\n", names[f], n, worst,
                      sqrt(off / sum));
        assert_true(worst < 1e-9);
        hfield_finish(&h);
    }
    spectrum_finish(&e_light);
}

static void fill(struct hfield *h, int n, double step_m, double amplitude_m, double period_m)
{
    struct err e = {0};
    assert_true(hfield_init(h, n, n, step_m, step_m, &e));
    for (int k = 0; k < n * n; k++)
        h->z[k] = (float)(amplitude_m * cos(2 * M_PI * (k % n) * step_m / period_m));
}

TEST(a_flat_surface_is_a_mirror)
{
    struct hfield h;
    struct spectrum d65;
    struct err e = {0};
    double xyz[2][3];
    const struct uvw at[2] = {{0, 0, 2}, {0.3, 0, 1.9}};
    fill(&h, 64, 0.5e-6, 0, 1);
    assert_true(illuminant_get(&d65, "D65", &e));
    const struct optics_ref o = {&h, 20e-6, false};
    assert_true(optics_ref_xyz(&o, &d65, at, 2, xyz, &e));
    assert_near(xyz[0][1], 1, 1e-12); // the light's own colour, Y = 1
    assert_near(xyz[0][0] / (xyz[0][0] + xyz[0][1] + xyz[0][2]), 0.3127, 3e-4);
    assert_true(xyz[1][1] < 1e-6); // the window reaches 1.6 sigma only: its edges leak this much
    spectrum_finish(&d65);
    hfield_finish(&h);
}

TEST(a_cosine_has_orders_of_bessel_functions)
{
    const double lambda_m = 500e-9, a_m = 60e-9, period_m = 4e-6;
    struct hfield h;
    struct err e = {0};
    fill(&h, 400, 0.25e-6, a_m, period_m);
    const struct optics_ref o = {&h, 50e-6, false}, first = {&h, 50e-6, true};
    for (int m = 0; m < 4; m++) {
        const struct uvw at = {m * lambda_m / period_m, 0, 2};
        double complex s, s1;
        assert_true(optics_ref_amplitude(&o, &at, 1, lambda_m, &s, &e));
        assert_true(optics_ref_amplitude(&first, &at, 1, lambda_m, &s1, &e));
        const double x = 2 * M_PI * 2 * a_m / lambda_m;
        assert_near(cabs(s), fabs(jn(m, x)), 1e-5); // flanks of other orders
        assert_near(cabs(s1), m == 0 ? 1 : m == 1 ? 0.5 * x : 0, 1e-5);
    }
    hfield_finish(&h);
}

TEST(heights_that_were_not_measured_are_refused)
{
    struct hfield h;
    struct err e = {0};
    double complex s;
    const struct uvw at = {0, 0, 2};
    fill(&h, 8, 1e-6, 0, 1);
    h.z[3] = NAN;
    const struct optics_ref o = {&h, 20e-6, false};
    assert_false(optics_ref_amplitude(&o, &at, 1, 500e-9, &s, &e));
    assert_string_equal(e.msg, "1 of the height field's nodes are not measured");
    assert_int_equal(e.code, ERR_DATA);
    hfield_finish(&h);
}

TEST_MAIN(cmocka_unit_test(sums_agree_with_the_reference_tables_to_1e_9),
          cmocka_unit_test(a_flat_surface_is_a_mirror),
          cmocka_unit_test(a_cosine_has_orders_of_bessel_functions),
          cmocka_unit_test(heights_that_were_not_measured_are_refused))

// test_sim_farfield.c - the simulator's far field against direct summation and against physics.
#include "tests/test.h"

#include "core/hfield_file.h"
#include "sim/energy.h"
#include "sim/farfield.h"

static void make_sample(struct sample *s, const char *text)
{
    struct yaml *y = NULL;
    struct err e = {0};
    if (!yaml_open_text(&y, "sample.yaml", text, &e) ||
        !sample_read(s, yaml_root(y), "sample.yaml", &e) || !yaml_close(y, true, &e))
        fail_msg("%s", e.msg);
}

static const char *const all_kinds[] = {
    "{kind: flat}",
    "{kind: blazed, lines: 600/mm, blaze: 13deg}",
    "{kind: cd}",
    "{kind: cd, pitch: 1.6um}",
    "{kind: lcd}",
    "{kind: lcd, pitch: [16um, 20um], depth: 90nm, turn: 17deg}",
    "{kind: tv}",
    "{kind: holographic}",
    "{kind: random}",
    "{kind: quasi-periodic, nodes: 48, tile: 12um}",
    "{kind: quasi-random, nodes: 48, tile: 12um}",
    "{kind: shapes, period: [4um, 3um], shapes: [{x: [0.1, 0.6], y: [0.2, 0.7], shear: 0.4, "
    "height: 80nm, rise: 60nm}]}",
};
enum { KINDS = sizeof all_kinds / sizeof *all_kinds };

TEST(orders_of_shapes_are_their_fourier_integrals)
{
    enum { N = 600 };
    struct sample s;
    make_sample(&s, all_kinds[KINDS - 1]);
    const double q = 3.7e6;
    for (int m = -2; m <= 2; m++)
        for (int n = -1; n <= 2; n++) {
            double complex sum = 0;
            for (int j = 0; j < N; j++)
                for (int i = 0; i < N; i++) {
                    const double x = (i + 0.5) / N, y = (j + 0.5) / N;
                    sum += sample_reflectance(&s, x * s.period_x_m, y * s.period_y_m, q) *
                           cexp(-2 * M_PI * I * (m * x + n * y));
                }
            // The midpoint rule misses the edges by a part of a cell of 1/600.
            assert_near(cabs(sum / (N * N) - sample_order(&s, m, n, q)), 0, 3e-3);
        }
    sample_finish(&s);
}

// |S|^2 of a window of Gaussian amplitude, averaged over all places of one cell, by direct sums
// over the nodes of a repeated map: the definition of docs/optics.md 4 and nothing else.
static double by_definition(const struct sample *s, double u, double v, double w, double lambda_m)
{
    const struct hfield *z = &s->map;
    const double sigma = s->coherence_m / 4;
    const int reach = (int)ceil(7 * sigma / z->dx_m), side = 2 * reach + 1;
    double *g = malloc((size_t)side * sizeof *g), power = 0, mean = 0;
    for (int i = 0; i < side; i++) {
        g[i] = exp(-0.5 * pow((i - reach) * z->dx_m / sigma, 2));
        power += g[i] * g[i];
    }
    for (int pj = 0; pj < z->ny; pj++)
        for (int pi = 0; pi < z->nx; pi++) {
            double complex sum = 0;
            for (int j = 0; j < side; j++)
                for (int i = 0; i < side; i++) {
                    const int a = (pi + i + 64 * z->nx - reach) % z->nx;
                    const int b = (pj + j + 64 * z->ny - reach) % z->ny;
                    const double x = (i - reach) * z->dx_m, y = (j - reach) * z->dy_m;
                    sum += g[i] * g[j] *
                           cexp(2 * M_PI * I / lambda_m *
                                (w * (double)z->z[b * z->nx + a] - u * x - v * y));
                }
            const double amplitude = cabs(sum);
            mean += amplitude * amplitude / (z->nx * z->ny);
        }
    free(g);
    return mean * z->dx_m * z->dy_m / (power * power * lambda_m * lambda_m);
}

TEST(pattern_is_the_mean_of_windowed_direct_sums)
{
    struct sample s;
    make_sample(&s, "{kind: quasi-random, tile: 16um, nodes: 16, period: 5um, rms: 90nm, "
                    "coherence: 16um}");
    const double top = by_definition(&s, 0, 0, 2, 530e-9);
    for (int k = 0; k < 8; k++) {
        const double u = 0.021 * k - 0.05, v = 0.06 - 0.017 * k, w = 2 - 0.01 * k;
        assert_near(farfield_ref(&s, u, v, w, 530e-9), by_definition(&s, u, v, w, 530e-9),
                    1e-11 * top);
    }
    sample_finish(&s);
}

TEST(tabulated_orders_are_as_good_as_summed_ones)
{
    for (int kind = 0; kind < KINDS; kind++) {
        struct sample s;
        struct farfield p;
        struct err e = {0};
        make_sample(&s, all_kinds[kind]);
        const struct farfield_range range = {0.4, 450e-9, 650e-9, 1.9, 2};
        if (!farfield_init(&p, &s, &range, &e))
            fail_msg("%s: %s", all_kinds[kind], e.msg);
        double top = 0, worst = 0;
        for (int k = 0; k < 40; k++) {
            const double u = k == 0 ? 0 : 0.28 * sin(1.7 * k), v = k == 0 ? 0 : 0.28 * cos(2.9 * k);
            const double w = 1.9 + 0.0025 * k, lambda_m = (450 + 5 * k) * 1e-9;
            const double ref = farfield_ref(&s, u, v, w, lambda_m);
            top = fmax(top, ref);
            worst = fmax(worst, fabs(farfield_at(&p, u, v, w, lambda_m) - ref));
        }
        if (!(worst <= 1e-9 * top))
            fail_msg("%s: off by %g of %g", all_kinds[kind], worst, top);
        farfield_finish(&p);
        sample_finish(&s);
    }
}

// Integral of D over all (u, v), real directions or not, is the mean of |r|^2: light is conserved.
TEST(all_orders_together_return_the_mean_reflectance)
{
    static const struct {
        const char *text;
        double h_max, tol; // orders past h_max are left out: what they carry
    } cases[] = {
        {"{kind: flat}", 0.1, 1e-6},
        {"{kind: random, rough: {rms: 60nm, length: 4um}}", 0.9, 1e-6},
        {"{kind: blazed, lines: 300/mm, blaze: 6deg, coherence: 20um}", 2, 0.01},
        {"{kind: holographic, pitch: 2um, coherence: 20um, rough: {rms: 0m, length: 1um}}", 2,
         1e-6},
        {"{kind: quasi-random, tile: 16um, nodes: 32, coherence: 20um}", 1.2, 1e-6},
    };
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        struct sample s;
        struct farfield p;
        struct err e = {0};
        make_sample(&s, cases[c].text);
        const double h = cases[c].h_max, lambda_m = 550e-9;
        const struct farfield_range range = {fmin(2, 1.5 * h), 540e-9, 560e-9, 2, 2};
        if (!farfield_init(&p, &s, &range, &e))
            fail_msg("%s", e.msg);
        const double step = 0.2 * lambda_m / s.coherence_m; // lobes are Gaussians: this is exact
        const int n = (int)ceil(h / step);
        double sum = 0;
        for (int j = -n; j <= n; j++)
            for (int i = -n; i <= n; i++)
                sum += step * step * farfield_at(&p, i * step, j * step, 2, lambda_m);
        assert_near(sum, 1, cases[c].tol);
        farfield_finish(&p);
        sample_finish(&s);
    }
}

TEST(a_pure_phase_returns_all_light_in_its_orders)
{
    static const struct {
        const char *text;
        int reach;
    } cases[] = {
        {"{kind: flat}", 2},
        {"{kind: blazed}", 400000}, // orders of a sawtooth fall as 1 / m^2
        {"{kind: holographic}", 24},
        {"{kind: quasi-periodic, nodes: 96, tile: 24um}", 48},
    };
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        struct sample s;
        struct energy all;
        struct err e = {0};
        make_sample(&s, cases[c].text);
        assert_true(energy_of(&s, 530e-9, cases[c].reach, &all, &e));
        assert_near(all.orders, 1, 1e-6);
        assert_near(all.reflectance, 1, 0);
        // The BRDF's 1 / cos_o makes wide orders brighter than they are.
        assert_true(all.returned >= all.propagating);
        sample_finish(&s);
    }
}

TEST(a_mask_returns_what_it_lets_through)
{
    struct sample s;
    struct energy all;
    struct err e = {0};
    make_sample(&s, "{kind: shapes, period: 4um, ground: 0.2, shapes: [{x: [0, 0.3]}]}");
    assert_true(energy_of(&s, 530e-9, 200000, &all, &e));
    assert_near(all.reflectance, 0.3 + 0.7 * 0.04, 1e-15);
    assert_near(all.orders, all.reflectance, 1e-6);
    sample_finish(&s);
}

TEST(a_height_file_is_a_cell)
{
    struct hfield h;
    struct sample s;
    struct err e = {0};
    assert_true(hfield_init(&h, 32, 16, 0.25e-6, 0.5e-6, &e));
    for (int k = 0; k < 32 * 16; k++)
        h.z[k] = (float)(1e-7 * cos(2 * M_PI * (k % 32) / 32));
    assert_true(hfield_write(&h, "cell.gsf", NULL, &e));
    make_sample(&s, "{kind: height, file: cell.gsf}");
    assert_near(s.period_x_m, 8e-6, 1e-15);
    assert_near(s.period_y_m, 8e-6, 1e-15);
    const double q = 4e6;
    assert_near(cabs(sample_order(&s, 1, 0, q)), fabs(jn(1, 2 * M_PI * q * 1e-7)), 1e-6);
    sample_finish(&s);
    hfield_finish(&h);
    remove("cell.gsf");
}

TEST(a_mask_scales_with_exponent_2_and_a_shallow_phase_with_4)
{
    static const struct {
        const char *text;
        double exponent, tol;
    } cases[] = {
        {"{kind: lcd, pitch: 20um}", 2, 1e-9},
        {"{kind: lcd, pitch: 20um, ground: 1, amplitude: 1, depth: 5nm}", 4, 0.01},
    };
    for (int c = 0; c < 2; c++) {
        struct sample s;
        make_sample(&s, cases[c].text);
        const double a = 500e-9, b = 600e-9, order = 3 / 20e-6; // off the mirror direction
        const double x = farfield_ref(&s, order * a, 0, 2, a),
                     y = farfield_ref(&s, order * b, 0, 2, b);
        assert_near(log(x / y) / log(b / a), cases[c].exponent, cases[c].tol);
        sample_finish(&s);
    }
}

TEST(a_turned_sample_turns_its_pattern)
{
    struct sample s, turned;
    make_sample(&s, "{kind: tv}");
    make_sample(&turned, "{kind: tv, turn: 30deg}");
    const double c = cos(M_PI / 6), i = sin(M_PI / 6);
    for (int k = 0; k < 20; k++) {
        const double u = 0.1 * sin(k), v = 0.1 * cos(3 * k), d = farfield_ref(&s, u, v, 2, 530e-9);
        assert_near(farfield_ref(&turned, c * u - i * v, i * u + c * v, 2, 530e-9), d,
                    1e-9 * fmax(1, d));
    }
    sample_finish(&s);
    sample_finish(&turned);
}

TEST(samples_that_cannot_be_are_refused_with_their_line)
{
    static const struct {
        const char *text, *msg;
    } bad[] = {
        {"kind: cd\npitch: -2um\n",
         "s.yaml:2: pitch: -2um is out of range: must be 100 nm to 1 mm"},
        {"kind: cd\npit: 3um\n", "s.yaml:2: pit: 3um is out of range: must be 1 nm to 1.998 um"},
        {"kind: lcd\npitch: [25um, 25um, 25um]\n",
         "s.yaml:2: pitch: 3 values, needs 2 or one for all"},
        {"kind: rose\n",
         "s.yaml:1: kind: 'rose' is not one of "
         "flat|blazed|cd|lcd|tv|holographic|random|quasi-periodic|quasi-random|height|shapes"},
        {"kind: shapes\nperiod: 2um\nshapes: [{x: [0, 0.6]}, {x: [0.5, 0.9]}]\n",
         "s.yaml:3: shapes: two shapes overlap"},
        {"kind: shapes\nperiod: 2um\nshapes: [{x: [0.6, 0.2]}]\n",
         "s.yaml:3: x and y must each be [from, to] with from < to, at most 1 apart"},
        {"kind: quasi-random\nperiod: 100um\ntile: 20um\n",
         "s.yaml:1: no wave of period 0.0001 m fits a tile of 2e-05 m"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        struct sample s = {0};
        struct yaml *y = NULL;
        struct err e = {0};
        assert_true(yaml_open_text(&y, "s.yaml", bad[k].text, &e));
        assert_false(sample_read(&s, yaml_root(y), "s.yaml", &e));
        assert_string_equal(e.msg, bad[k].msg);
        assert_int_equal(e.code, ERR_DATA);
        assert_null(s.shape);
        yaml_close(y, false, &e);
    }
}

TEST_MAIN(cmocka_unit_test(orders_of_shapes_are_their_fourier_integrals),
          cmocka_unit_test(pattern_is_the_mean_of_windowed_direct_sums),
          cmocka_unit_test(tabulated_orders_are_as_good_as_summed_ones),
          cmocka_unit_test(all_orders_together_return_the_mean_reflectance),
          cmocka_unit_test(a_pure_phase_returns_all_light_in_its_orders),
          cmocka_unit_test(a_mask_returns_what_it_lets_through),
          cmocka_unit_test(a_height_file_is_a_cell),
          cmocka_unit_test(a_mask_scales_with_exponent_2_and_a_shallow_phase_with_4),
          cmocka_unit_test(a_turned_sample_turns_its_pattern),
          cmocka_unit_test(samples_that_cannot_be_are_refused_with_their_line))

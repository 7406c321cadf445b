// test_tables.c - tables from height fields: against direct summation, and what must not change.
#include "tests/test.h"

#include "process/bessel.h"
#include "process/tables.h"
#include "process/tables_taylor.h"
#include "tests/direct_ref.h"
#include <omp.h>

enum kind { BLAZED, ROUGH, SPIKE, FLAT };

static double noise(uint32_t *state) // -1..1
{
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) / (1 << 23) - 1;
}

static struct hfield field(enum kind kind, int nx, int ny, double dx_m, double dy_m, double high_m)
{
    struct hfield hf = {0};
    struct err e = {0};
    uint32_t state = 7;
    assert_true(hfield_init(&hf, nx, ny, dx_m, dy_m, &e));
    for (int j = 0; j < ny; j++)
        for (int i = 0; i < nx; i++) {
            const double x = i * dx_m / 1.7e-6 + j * dy_m / 9e-6;
            const double z = kind == BLAZED  ? x - floor(x)
                             : kind == ROUGH ? 0.5 + 0.25 * (sin(6.1 * x) + noise(&state))
                             : kind == SPIKE ? i == nx / 2 && j == ny / 3
                                             : 0;
            hf.z[j * nx + i] = (float)(high_m * z);
        }
    return hf;
}

static struct spectrum light;

static struct tables_spec spec(enum table_basis basis, int count, int n)
{
    struct err e = {0};
    if (!light.n)
        assert_true(illuminant_get(&light, "D65", &e));
    return (struct tables_spec){.coherence_m = 20e-6,
                                .repeat = {1, 1},
                                .light = &light,
                                .step_m = 20e-9,
                                .n = n,
                                .power = 5,
                                .range = 2,
                                .basis = basis,
                                .w_max = 2,
                                .count = count,
                                .tolerance = count ? 0 : 1e-3,
                                .memory = 200000000};
}

static struct table make(const struct tables_spec *s, const struct hfield *hf)
{
    struct table t = {0};
    struct err e = {0};
    if (!tables_make(&t, s, hf, &e))
        fail_msg("%s", e.msg);
    return t;
}

// Relative L2 error over some nodes and w; every sum is taken once per point.
static double error_of(const struct table *t, const struct tables_spec *s, const struct hfield *hf,
                       int points)
{
    uint32_t state = 3;
    double apart = 0, all = 0;
    const double sigma_m = s->window == WINDOW_FLAT ? 0 : s->coherence_m / 4;
    for (int k = 0; k < points; k++) {
        const int i = (int)lrint((noise(&state) + 1) * 0.5 * (t->n - 1));
        const int j = (int)lrint((noise(&state) + 1) * 0.5 * (t->n - 1));
        const double w = s->w_min + (s->w_max - s->w_min) * (k + 0.5) / points;
        const double at[3] = {table_node(t, i), table_node(t, j), w};
        double want[3], got[3];
        direct_ref(hf, s->light, s->step_m, sigma_m, s->repeat, s->absolute, at, want);
        table_eval(t, at[0], at[1], at[2], 0, got);
        for (int c = 0; c < 3; c++) {
            assert_true(isfinite(got[c]));
            apart += (got[c] - want[c]) * (got[c] - want[c]);
            all += want[c] * want[c];
        }
    }
    return sqrt(apart / all);
}

static double stated_error(const struct table *t, int count)
{
    const struct meta_item *item = meta_find(&t->meta, "nacre.error_l2");
    assert_non_null(item);
    return item->num[count - 1];
}

TEST(bessel_functions_are_those_of_the_library)
{
    static const double z[] = {0, 1e-12, 1e-5, 0.3, 1, 7.7, 52, 331, 2000};
    double j[400];
    for (size_t k = 0; k < sizeof z / sizeof *z; k++)
        for (int n = 1; n <= 400; n += 57) {
            bessel_j(z[k], n, j);
            for (int m = 0; m < n; m++)
                assert_near(j[m], jn(m, z[k]), 1e-14);
        }
}

TEST(enough_tables_are_direct_summation)
{
    static const struct {
        enum kind kind;
        int nx, ny;
        double dx_m, dy_m, high_m, coherence_m;
    } cases[] = {
        {ROUGH, 64, 64, 0.25e-6, 0.25e-6, 400e-9, 16e-6},
        {BLAZED, 61, 37, 0.3e-6, 0.41e-6, 350e-9, 18e-6}, // primes, not square
        {BLAZED, 96, 50, 0.06e-6, 0.5e-6, 350e-9, 10e-6}, // a band narrower than the transform
        {ROUGH, 81, 90, 0.2e-6, 0.2e-6, 200e-9, 1e-6},    // a window of few nodes: cropped
        {SPIKE, 40, 33, 0.5e-6, 0.5e-6, 2e-6, 1.0},       // an even window, nearly
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct hfield hf = field(cases[k].kind, cases[k].nx, cases[k].ny, cases[k].dx_m,
                                 cases[k].dy_m, cases[k].high_m);
        struct tables_spec s = spec(TABLE_POD, 0, k % 2 ? 24 : 25);
        s.coherence_m = cases[k].coherence_m * 0.999;
        s.tolerance = 2e-6;
        struct table t = make(&s, &hf);
        assert_near(error_of(&t, &s, &hf, 60), 0, 5e-6);
        table_finish(&t);
        hfield_finish(&hf);
    }
}

TEST(the_reference_fields_are_met_with_twelve_tables)
{
    static const char *const names[] = {"blazed", "quasi", "rough"};
    for (int k = 0; k < 3; k++) {
        char name[64];
        snprintf(name, sizeof name, "reference/tables/truth_%s.csv", names[k]);
        FILE *f = fopen(shared_or_skip(name), "r");
        snprintf(name, sizeof name, "reference/tables/height_%s.pfm", names[k]);
        FILE *g = fopen(shared_or_skip(name), "rb");
        struct hfield hf = field(FLAT, 256, 256, 65e-6 / 256, 65e-6 / 256, 0);
        int w, h;
        assert_int_equal(fscanf(g, "Pf %d %d -1.0", &w, &h), 2);
        fgetc(g);
        for (int j = 255; j >= 0; j--)
            assert_int_equal(fread(hf.z + j * 256, 4, 256, g), 256);
        fclose(g);
        struct tables_spec s = spec(TABLE_POD, 12, 501);
        struct spectrum even = {0};
        struct err e = {0};
        assert_true(illuminant_get(&even, "E", &e));
        s.light = &even;
        s.step_m = 5e-9;
        s.coherence_m = 65e-6;
        struct table t = make(&s, &hf);
        double apart = 0, all = 0, at[3], want[3], got[3];
        assert_int_equal(fscanf(f, "u,v,w,X,Y,Z"), 0);
        while (fscanf(f, " %lf,%lf,%lf,%lf,%lf,%lf", at, at + 1, at + 2, want, want + 1,
                      want + 2) == 6) {
            table_eval(&t, at[0], at[1], at[2], 0, got);
            for (int c = 0; c < 3; c++) {
                apart += (got[c] - want[c]) * (got[c] - want[c]);
                all += want[c] * want[c];
            }
        }
        fclose(f);
        assert_near(sqrt(apart / all), 0, 1e-6);
        table_finish(&t);
        spectrum_finish(&even);
        hfield_finish(&hf);
    }
}

TEST(the_tolerance_is_met_with_the_least_tables)
{
    static const double tolerances[] = {1e-2, 1e-3};
    for (int kind = BLAZED; kind <= ROUGH; kind++)
        for (int k = 0; k < 2; k++) {
            struct hfield hf = field((enum kind)kind, 64, 64, 0.25e-6, 0.25e-6, 330e-9);
            struct tables_spec s = spec(TABLE_POD, 0, 31);
            s.tolerance = tolerances[k];
            struct table t = make(&s, &hf);
            assert_true(error_of(&t, &s, &hf, 150) <= tolerances[k]);
            assert_true(stated_error(&t, t.count) <= tolerances[k]);
            if (t.count > 2) // no more than one above the least
                assert_true(stated_error(&t, t.count - 2) > tolerances[k]);
            table_finish(&t);
            hfield_finish(&hf);
        }
}

TEST(pod_errs_less_than_chebyshev_and_both_state_it)
{
    for (int kind = BLAZED; kind <= ROUGH; kind++) {
        struct hfield hf = field((enum kind)kind, 64, 64, 0.25e-6, 0.25e-6, 330e-9);
        for (int count = 1; count <= 6; count++) {
            const struct tables_spec a = spec(TABLE_POD, count, 31),
                                     b = spec(TABLE_CHEBYSHEV, count, 31);
            struct table pod = make(&a, &hf), chebyshev = make(&b, &hf);
            assert_true(stated_error(&pod, count) < stated_error(&chebyshev, count));
            // 40 points of 961 nodes: the statement holds within their scatter
            const double measured = error_of(&chebyshev, &b, &hf, 40);
            assert_true(measured < 3 * stated_error(&chebyshev, count));
            assert_true(measured > stated_error(&chebyshev, count) / 3);
            table_finish(&pod);
            table_finish(&chebyshev);
        }
        hfield_finish(&hf);
    }
}

// Relative L2 error of bilinear look-up at random points of the plane.
static double error_between(const struct table *t, const struct tables_spec *s,
                            const struct hfield *hf, int points)
{
    uint32_t state = 5;
    double apart = 0, all = 0;
    for (int k = 0; k < points; k++) {
        const double u = t->range * noise(&state), v = t->range * noise(&state);
        const double at[3] = {u, v, s->w_min + (s->w_max - s->w_min) * (k + 0.5) / points};
        double want[3], got[3];
        direct_ref(hf, s->light, s->step_m, s->coherence_m / 4, s->repeat, false, at, want);
        table_eval(t, at[0], at[1], at[2], 0, got);
        for (int c = 0; c < 3; c++) {
            apart += (got[c] - want[c]) * (got[c] - want[c]);
            all += want[c] * want[c];
        }
    }
    return sqrt(apart / all);
}

TEST(between_nodes_the_error_is_stated_and_can_be_asked_for)
{
    struct hfield hf = field(ROUGH, 48, 48, 0.3e-6, 0.3e-6, 200e-9);
    struct tables_spec s = spec(TABLE_POD, 6, 41);
    s.coherence_m = 14e-6;
    s.range = 0.2;
    s.power = 1;
    double stated;
    struct table t = make(&s, &hf);
    assert_true(meta_num(&t.meta, "nacre.error_between", &stated));
    const double measured = error_between(&t, &s, &hf, 200);
    assert_true(stated > 0.003 && measured < 2 * stated && measured > stated / 2);
    table_finish(&t);
    s.n = s.count = 0;
    s.tolerance = 0.02;
    t = make(&s, &hf);
    assert_true(error_between(&t, &s, &hf, 200) <= s.tolerance);
    assert_true(t.n < 400); // and not by far
    table_finish(&t);
    s.range = 2;
    s.tolerance = 1e-5;
    struct err e = {0};
    assert_false(tables_make(&t, &s, &hf, &e));
    assert_int_equal(e.code, ERR_DATA);
    assert_non_null(strstr(e.msg, "an error of 1e-05 between nodes too takes about"));
    hfield_finish(&hf);
}

TEST(a_mirror_stays_a_mirror)
{
    struct hfield hf = field(FLAT, 50, 64, 0.3e-6, 0.25e-6, 0);
    struct tables_spec s = spec(TABLE_POD, 1, 201);
    struct table t = make(&s, &hf);
    double white[3], centre[3];
    direct_ref(&hf, &light, s.step_m, 5e-6, s.repeat, false, (double[]){0, 0, 1}, white);
    table_eval(&t, 0, 0, 1.3, 0, centre);
    for (int c = 0; c < 3; c++)
        assert_near(centre[c], white[c], 3e-7);
    assert_near(centre[1], 1, 3e-7);
    table_finish(&t);

    // f cos dw integrates to R when G / w^2 = 1: |S|^2 A / lambda^2 has the integral 1 (Parseval)
    struct err e = {0};
    double lambda_m[] = {549e-9, 550e-9, 551e-9}, line[] = {0, 1, 0};
    const struct spectrum laser = {.n = 3, .lambda_m = lambda_m, .value = line};
    s.light = &laser;
    s.step_m = 1e-9;
    s.range = 0.5; // the window's wings beyond hold less than 1e-4
    s.power = 1;
    s.coherence_m = 10e-6;
    s.absolute = true;
    if (!tables_make(&t, &s, &hf, &e))
        fail_msg("%s", e.msg);
    double sum = 0;
    for (int k = 0; k < t.n * t.n; k++)
        sum += t.tab[3 * k + 1] * t.curve[0];
    const double step = 2 * s.range / (t.n - 1);
    assert_near(sum * step * step, 1, 1e-3);
    table_finish(&t);
    hfield_finish(&hf);
}

static double apart(const struct table *a, const struct table *b, bool turned)
{
    double sum = 0, all = 0, x[3], y[3];
    for (int j = 0; j < a->n; j++)
        for (int i = 0; i < a->n; i++)
            for (double w = 0.3; w < 2; w += 0.4) {
                const double u = table_node(a, i), v = table_node(a, j);
                table_eval(a, u, v, w, 0, x);
                table_eval(b, turned ? -v : u, turned ? u : v, w, 0, y);
                for (int c = 0; c < 3; c++) {
                    sum += (x[c] - y[c]) * (x[c] - y[c]);
                    all += x[c] * x[c];
                }
            }
    return sqrt(sum / all);
}

TEST(a_shift_changes_nothing_and_a_turn_turns)
{
    const int n = 60;
    struct hfield hf = field(BLAZED, n, n, 0.3e-6, 0.3e-6, 300e-9);
    struct hfield up = field(BLAZED, n, n, 0.3e-6, 0.3e-6, 300e-9);
    struct hfield turned = field(FLAT, n, n, 0.3e-6, 0.3e-6, 0);
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            up.z[j * n + i] += 1e-6f;
            turned.z[i * n + (n - 1 - j)] = hf.z[j * n + i]; // x to y, y to -x
        }
    const struct tables_spec s = spec(TABLE_POD, 8, 41);
    struct table a = make(&s, &hf), b = make(&s, &up), c = make(&s, &turned);
    assert_near(apart(&a, &b, false), 0, 2e-6); // heights of 1 um have a float step of 1e-13 m
    assert_near(apart(&a, &c, true), 0, 1e-6);
    table_finish(&a);
    table_finish(&b);
    table_finish(&c);
    hfield_finish(&hf);
    hfield_finish(&up);
    hfield_finish(&turned);
}

TEST(copies_are_an_array_factor)
{
    struct hfield hf = field(BLAZED, 17, 15, 0.4e-6, 0.5e-6, 300e-9);
    struct tables_spec s = spec(TABLE_POD, 10, 25);
    s.power = 1;
    s.repeat[0] = 3;
    s.repeat[1] = 4;
    for (int window = WINDOW_GAUSS; window <= WINDOW_FLAT; window++) {
        s.window = (enum window)window;
        s.absolute = window == WINDOW_FLAT;
        struct table t = make(&s, &hf); // judged by a sum over all copies
        assert_near(error_of(&t, &s, &hf, 30), 0, 1e-5);
        table_finish(&t);
    }
    hfield_finish(&hf);
}

TEST(memory_and_threads_change_no_byte)
{
    struct hfield hf = field(ROUGH, 64, 64, 0.25e-6, 0.25e-6, 400e-9);
    struct tables_spec s = spec(TABLE_POD, 5, 41);
    struct table a = make(&s, &hf);
    const size_t bytes = 5 * 41 * 41 * 3 * sizeof(float);
    omp_set_num_threads(3);
    struct table b = make(&s, &hf);
    assert_memory_equal(a.tab, b.tab, bytes);
    table_finish(&b);
    s.memory = 2500000; // several parts, and samples made twice
    b = make(&s, &hf);
    assert_memory_equal(a.tab, b.tab, bytes);
    table_finish(&b);
    omp_set_num_threads(1);
    s.memory = 10000;
    struct err e = {0};
    assert_false(tables_make(&b, &s, &hf, &e));
    assert_int_equal(e.code, ERR_DATA);
    assert_non_null(strstr(e.msg, "a strip of the transforms needs"));
    table_finish(&a);
    hfield_finish(&hf);
}

TEST(no_height_breaks_it)
{
    static const struct {
        enum kind kind;
        double high_m, w_min, w_max;
        int count; // 0: for 1e-3
    } cases[] = {
        {ROUGH, 1e-9, 1e-3, 2, 0},       {ROUGH, 20e-6, 0.5, 2, 85}, {FLAT, 0, 1e-3, 2, 0},
        {SPIKE, 20e-6, 0, 2, 0},         {ROUGH, 1e-42, 0, 2, 3},    {BLAZED, 2e-6, 1.9, 2, 0},
        {BLAZED, 300e-9, 1e-3, 2e-3, 0},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct hfield hf = field(cases[k].kind, 24, 21, 0.5e-6, 0.5e-6, cases[k].high_m);
        struct tables_spec s = spec(TABLE_POD, cases[k].count, 11);
        s.w_min = cases[k].w_min;
        s.w_max = cases[k].w_max;
        struct table t = make(&s, &hf);
        const double stated = stated_error(&t, t.count); // 200 points scatter about it
        assert_true(cases[k].count || stated <= s.tolerance);
        assert_true(error_of(&t, &s, &hf, 200) <= 2 * stated + 1e-6);
        table_finish(&t);
        hfield_finish(&hf);
    }
}

TEST(the_sharp_remainder_is_a_factor_exp_y_smaller)
{
    const double y = 1.5 * M_PI; // S13 2.4.5
    assert_near(taylor_remainder(y, 20) / 2.7e-6, 1, 0.02);
    assert_near(taylor_remainder(y, 25) / 7.9e-10, 1, 0.02);
    assert_near(taylor_remainder(y, 30) / 9.0e-14, 1, 0.02);
    assert_near(taylor_remainder(y, 20) * exp(y) / 2.99e-4, 1, 0.01);
    assert_int_equal(taylor_order(y, 1e-3), 16);
    assert_in_range(taylor_order(1600, 1e-3), 4000, 5000); // 50 um: terms beyond e^709
    assert_true(isfinite(taylor_remainder(1600, 4500)));
}

TEST(taylor_tables_converge_and_know_when)
{
    struct hfield hf = field(ROUGH, 48, 48, 0.3e-6, 0.3e-6, 200e-9);
    double order, needed, bound, before = 0;
    for (int count = 3; count <= 25; count += 2) {
        struct tables_spec s = spec(TABLE_TAYLOR, count, 21);
        s.w_min = 0.6;
        struct table t = make(&s, &hf);
        const double measured = error_of(&t, &s, &hf, 40), stated = stated_error(&t, count);
        assert_true(meta_num(&t.meta, "nacre.taylor_order", &order));
        assert_true(meta_num(&t.meta, "nacre.taylor_order_needed", &needed));
        assert_true(meta_num(&t.meta, "nacre.taylor_bound", &bound));
        assert_near(order, count / 2, 0);
        assert_true(stated <= bound || stated < 1e-5); // float32 is the floor
        assert_true(measured < 3 * stated + 1e-6 && measured > stated / 4);
        if (order >= needed)
            assert_true(stated < 1e-3);
        if (count == 25)
            assert_true(before > 0 && stated < before);
        before = stated;
        table_finish(&t);
    }
    hfield_finish(&hf);
}

TEST(cancellation_in_float_tables_is_seen)
{
    struct hfield hf = field(ROUGH, 48, 48, 0.3e-6, 0.3e-6, 700e-9); // phases of 11 rad
    const struct tables_spec s = spec(TABLE_TAYLOR, 85, 11);
    struct table t = make(&s, &hf);
    double bound, rounding;
    assert_true(meta_num(&t.meta, "nacre.taylor_bound", &bound));
    assert_true(meta_num(&t.meta, "nacre.taylor_rounding", &rounding));
    assert_true(stated_error(&t, 85) > bound);
    assert_true(rounding > bound);
    table_finish(&t);
    hfield_finish(&hf);
}

TEST(impossible_requests_are_refused)
{
    struct hfield hf = field(ROUGH, 16, 16, 0.3e-6, 0.3e-6, 200e-9);
    struct err e = {0};
    struct table t = {0};
    struct tables_spec s = spec(TABLE_POD, 86, 11);
    assert_false(tables_make(&t, &s, &hf, &e));
    assert_string_equal(e.msg, "bad count 86: must be 1 to 85 tables");
    s = spec(TABLE_POD, 0, 11);
    s.tolerance = 1e-9;
    assert_false(tables_make(&t, &s, &hf, &e));
    assert_string_equal(e.msg, "bad tolerance 1e-09: must be 1e-6 to 1");
    s = spec(TABLE_POD, 1, 11);
    s.w_min = 2;
    assert_false(tables_make(&t, &s, &hf, &e));
    assert_string_equal(e.msg, "bad range of w 2,2: must rise and lie in 0 to 2");
    s = spec(TABLE_POD, 1, 11);
    s.coherence_m = -1;
    assert_false(tables_make(&t, &s, &hf, &e));
    assert_string_equal(e.msg, "bad coherence -1 m: must be above 0 and below 1 m");
    s = spec(TABLE_POD, 1, 11);
    s.step_m = 1;
    assert_false(tables_make(&t, &s, &hf, &e));
    assert_int_equal(e.code, ERR_DATA);
    s = spec(TABLE_TAYLOR, 0, 11);
    struct hfield high = field(ROUGH, 16, 16, 0.3e-6, 0.3e-6, 20e-6);
    assert_false(tables_make(&t, &s, &high, &e));
    assert_non_null(strstr(e.msg, "a Taylor series needs order"));
    hfield_finish(&high);
    s = spec(TABLE_POD, 1, 11);
    hf.z[16 * 8 + 5] = NAN;
    assert_false(tables_make(&t, &s, &hf, &e));
    assert_string_equal(e.msg, "node (5, 8) was not measured (NaN): fill the holes (--fill)");
    hfield_finish(&hf);
}

int main(void)
{
    omp_set_num_threads(1);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bessel_functions_are_those_of_the_library),
        cmocka_unit_test(enough_tables_are_direct_summation),
        cmocka_unit_test(the_reference_fields_are_met_with_twelve_tables),
        cmocka_unit_test(the_tolerance_is_met_with_the_least_tables),
        cmocka_unit_test(pod_errs_less_than_chebyshev_and_both_state_it),
        cmocka_unit_test(between_nodes_the_error_is_stated_and_can_be_asked_for),
        cmocka_unit_test(a_mirror_stays_a_mirror),
        cmocka_unit_test(a_shift_changes_nothing_and_a_turn_turns),
        cmocka_unit_test(copies_are_an_array_factor),
        cmocka_unit_test(memory_and_threads_change_no_byte),
        cmocka_unit_test(no_height_breaks_it),
        cmocka_unit_test(the_sharp_remainder_is_a_factor_exp_y_smaller),
        cmocka_unit_test(taylor_tables_converge_and_know_when),
        cmocka_unit_test(cancellation_in_float_tables_is_seen),
        cmocka_unit_test(impossible_requests_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

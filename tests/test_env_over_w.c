// test_env_over_w.c - prefiltering with tables whose weights are curves in w (height fields).
#include "tests/env_case.h"

#include "process/env_direct.h"
#include "process/env_exact.h"

enum { TABLES = 3, N = 65, SPOTS = 8 };
static const double range = .5;

// Weights as polynomials in w, whatever the basis that stores them: 1, w - 1, (w - 1)^2.
static double curve(int m, double w)
{
    return m == 0 ? 1 : m == 1 ? w - 1 : (w - 1) * (w - 1);
}

static double part(int m, double u, double v, int c)
{
    static const double share[TABLES] = {1, .4, -.3};
    return share[m] * case_pattern(u + .03 * m, v, c);
}

// The same set in each basis: Chebyshev on [0, 2] is 1, x, 2 x^2 - 1 with x = w - 1.
static struct table set_of(enum table_basis basis)
{
    struct table t;
    struct err e = {0};
    assert_true(table_init(&t, 161, range, 1, TABLES, &e));
    t.is_rgb = true;
    t.basis = basis;
    t.w_min = basis == TABLE_POD ? .1 : 0;
    t.w_max = 2;
    if (basis == TABLE_POD) {
        t.nw = 96;
        t.curve = xcalloc((size_t)(TABLES * t.nw), sizeof *t.curve);
        for (int k = 0; k < TABLES * t.nw; k++)
            t.curve[k] = curve(k / t.nw, .1 + 1.9 * (k % t.nw) / (t.nw - 1));
    }
    for (int k = 0; k < 161 * 161 * 3; k++) {
        const double u = table_node(&t, k / 3 % 161), v = table_node(&t, k / 3 / 161);
        const double a = part(0, u, v, k % 3), b = part(1, u, v, k % 3), c = part(2, u, v, k % 3);
        float *px = t.tab + k;
        const size_t next = 161 * 161 * 3;
        px[0] = (float)(basis == TABLE_TAYLOR      ? a - b + c
                        : basis == TABLE_CHEBYSHEV ? a + c / 2
                                                   : a);
        px[next] = (float)(basis == TABLE_TAYLOR ? b - 2 * c : b);
        px[2 * next] = (float)(basis == TABLE_CHEBYSHEV ? c / 2 : c);
    }
    return t;
}

// f cos i = F^2/F0^2 (1 + wi.wo)^2 / (o_n w^2) S(u, v, w), midpoints over the hemisphere.
static void truth(const struct frame *f, bool schlick, const double o[2], double rgb[3])
{
    enum { RINGS = 400, SPOKES = 1000 };
    const double on = sqrt(1 - o[0] * o[0] - o[1] * o[1]);
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int k = 0; k < RINGS * SPOKES; k++) {
        const double th = M_PI / 2 * (k / SPOKES + .5) / RINGS;
        const double phi = 2 * M_PI * (k % SPOKES + .5) / SPOKES;
        const double it = sin(th) * cos(phi), ib = sin(th) * sin(phi), w = cos(th) + on;
        const double u = it + o[0], v = ib + o[1], x = it * o[0] + ib * o[1] + cos(th) * on;
        if (fabs(u) > range || fabs(v) > range)
            continue;
        const double fresnel = schlick ? 1 + .96 / .04 * pow(1 - sqrt((1 + x) / 2), 5) : 1;
        double sky[3];
        case_sky(frame_world(f, v3(it, ib, cos(th))), sky);
        for (int c = 0; c < 3; c++) {
            double s = 0;
            for (int m = 0; m < TABLES; m++)
                s += curve(m, w) * part(m, u, v, c);
            rgb[c] += sin(th) * fresnel * (1 + x) * (1 + x) / (w * w) * s * sky[c] / on *
                      (M_PI / 2 / RINGS) * (2 * M_PI / SPOKES);
        }
    }
}

TEST(tables_over_w_are_filtered_as_their_definition_says)
{
    static const enum table_basis bases[] = {TABLE_TAYLOR, TABLE_CHEBYSHEV, TABLE_POD};
    struct environment env = case_environment(128, &case_axes);
    const struct frame f = case_frame(.3, .8, -.2, -.1, .4, .9);
    double o[SPOTS][2], want[2][SPOTS][3], direct[SPOTS][3];
    int node[SPOTS][2];
    for (int k = 0; k < SPOTS; k++)
        for (int x = 0; x < 2; x++) { // out to 0.9
            const double a = 2.4 * k, r = .9 * sqrt((k + .5) / SPOTS);
            node[k][x] = 32 + (int)lround(32 * r * (x ? sin(a) : cos(a)));
            o[k][x] = env_map_cosine(node[k][x], N);
        }
#pragma omp parallel for schedule(dynamic)
    for (int k = 0; k < 2 * SPOTS; k++)
        truth(&f, k / SPOTS, o[k % SPOTS], want[k / SPOTS][k % SPOTS]);
    for (int q = 0; q < 6; q++) {
        const struct fresnel fresnel = {q % 2 == 1, .04};
        const struct env_how how = {.tolerance = 1e-3, .detail_rad = M_PI / 128};
        struct table t = set_of(bases[q / 2]);
        struct env_kernel kernel;
        struct image map;
        struct err e = {0};
        assert_true(env_kernel_init(&kernel, &t, &fresnel, &how, &e));
        assert_true(env_exact(&kernel, &env, &f, N, &map, &e));
        assert_true(env_direct(&t, &fresnel, &env, &f, SPOTS, (const double(*)[2])o, direct, &e));
        double off[3] = {0}, all = 0;
        for (int k = 0; k < 3 * SPOTS; k++) {
            const double x = want[q % 2][k / 3][k % 3], got = direct[k / 3][k % 3];
            const double read = (double)map.px[(node[k / 3][1] * N + node[k / 3][0]) * 3 + k % 3];
            off[0] += (read - x) * (read - x);
            off[1] += (got - x) * (got - x);
            off[2] += (read - got) * (read - got);
            all += x * x;
        }
        print_message("basis %d %s, %d terms: exact %.1e, direct %.1e, apart %.1e\n", bases[q / 2],
                      q % 2 ? "Schlick" : "constant", kernel.terms.n, sqrt(off[0] / all),
                      sqrt(off[1] / all), sqrt(off[2] / all));
        assert_true(off[0] < all * 2.5e-6 && off[1] < all * 2.5e-6 && off[2] < all * 1e-6);
        env_kernel_finish(&kernel);
        image_finish(&map);
        table_finish(&t);
    }
    environment_finish(&env);
}

TEST_MAIN(cmocka_unit_test(tables_over_w_are_filtered_as_their_definition_says))

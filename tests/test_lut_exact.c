// test_lut_exact.c - the fast method against closed-form patterns, the plain method and itself.
#include "tests/lobes.h"

#include <omp.h>

static void run(const struct lut_request *r, struct table *t)
{
    struct err e = {0};
    struct lut_report report;
    if (!lut_build(r, t, &report, &e))
        fail_msg("%s", e.msg);
}

struct score {
    double l2, worst; // relative L2, and the largest error over the largest value
};

// Every `stride`-th node (both ways) within |u|, |v| <= reach against the closed form.
static struct score judge(const struct table *t, const struct lobes *l, int stride, double reach)
{
    double diff = 0, norm = 0, worst = 0, peak = 0;
    for (int j = 1; j < t->n; j += stride)
        for (int i = 1; i < t->n; i += stride) {
            const double u = table_node(t, i), v = table_node(t, j);
            if (fabs(u) > reach || fabs(v) > reach)
                continue;
            double truth[3];
            lobes_truth(l, u, v, 1601, truth);
            for (int c = 0; c < 3; c++) {
                const double d =
                    t->tab[((size_t)j * (size_t)t->n + (size_t)i) * 3 + (size_t)c] - truth[c];
                diff += d * d;
                norm += truth[c] * truth[c];
                worst = fmax(worst, fabs(d));
                peak = fmax(peak, truth[c]);
            }
        }
    return (struct score){sqrt(diff / norm), worst / peak};
}

TEST(it_meets_the_closed_form_for_many_requests)
{
    static const struct {
        int w, h;
        double cx, cy, h_per_px, sigma, lambda_m, exponent;
        const char *light;
        int n;
        double range;
        int power;
        double limit;
    } cases[] = {
        {300, 300, 149.7, 150.2, 2e-3, 2.2, 520e-9, 2, "E", 201, 0.2, 1, 1e-5},
        {300, 300, 149.7, 150.2, 2e-3, 2.2, 520e-9, 2, "D65", 201, 0.2, 5, 3e-5},
        {300, 300, 149.7, 150.2, 2e-3, 2.2, 520e-9, 4, "F11", 200, 0.2, 3, 3e-5},
        {400, 300, 110.2, 160.9, 1e-3, 3, 680e-9, 2, "A", 151, 0.07, 1, 3e-5},
        {300, 400, 180.5, 120, 5e-3, 2, 420e-9, 2, "F2", 333, 0.4, 9, 5e-5},
        {300, 300, 150, 150, 2e-3, 1.5, 520e-9, 2, "E", 201, 0.2, 1, 1e-4},
        // 1.1 px is under-sampled: the photograph itself is aliased by 2e-3 (exp(-pi^2 sigma^2 /
        // 2))
        {300, 300, 150, 150, 2e-3, 1.1, 520e-9, 2, "inverse-A", 201, 0.2, 1, 1e-3},
        {300, 300, 150, 150, 2e-3, 2.2, 520e-9, 2, "E", 501, 0.01, 1, 3e-5},
        {300, 300, 150, 150, 2e-3, 2.2, 780e-9, 2, "E", 101, 2, 5, 3e-5},
        {300, 300, 150, 150, 2e-3, 2.2, 380e-9, 2, "D50", 100, 0.3, 7, 3e-5},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct spectrum s;
        struct err e = {0};
        assert_true(illuminant_get(&s, cases[k].light, &e));
        struct lobes l = lobes_new(90, cases[k].sigma);
        l.exponent = cases[k].exponent;
        l.lambda_m = cases[k].lambda_m;
        l.h_per_px = cases[k].h_per_px;
        l.light = &s;
        struct lut_pattern p = lobes_picture(&l, cases[k].w, cases[k].h, cases[k].cx, cases[k].cy);
        struct table t;
        run(&(struct lut_request){.pattern = &p,
                                  .lambda_m = l.lambda_m,
                                  .light = &s,
                                  .f0 = 1,
                                  .exponent = l.exponent,
                                  .n = cases[k].n,
                                  .range = cases[k].range,
                                  .power = cases[k].power,
                                  .method = LUT_EXACT,
                                  .tolerance = 1e-4},
            &t);
        const struct score got = judge(&t, &l, 17, INFINITY);
        if (!(got.l2 < cases[k].limit && got.worst < 3 * cases[k].limit))
            fail_msg("case %zu: relative L2 %.2g, largest %.2g of the peak", k, got.l2, got.worst);
        table_finish(&t);
        lut_pattern_finish(&p);
        spectrum_finish(&s);
    }
}

TEST_MAIN(cmocka_unit_test(it_meets_the_closed_form_for_many_requests))

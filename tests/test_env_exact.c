// test_env_exact.c - prefiltering by plane convolutions and by full integration, against judges.
#include "tests/env_case.h"

#include "core/imgfile.h"
#include "process/env_direct.h"
#include "process/env_exact.h"

static const struct fresnel fresnels[2] = {{false, 1}, {true, .04}};

static struct image filtered(const struct table *t, const struct fresnel *f,
                             const struct environment *env, const struct frame *frame, int n)
{
    struct env_kernel k;
    struct image out;
    struct err e = {0};
    assert_true(env_kernel_init(&k, t, f, 1e-3, 0, M_PI / env->map.h, &e));
    assert_true(env_exact(&k, env, frame, n, &out, &e));
    env_kernel_finish(&k);
    return out;
}

// Relative L2 over nodes spread over the disk, and the worst node.
struct off {
    double sum, all, worst;
};
static void compare(struct off *o, const double *got, const double *want)
{
    for (int c = 0; c < 3; c++) {
        o->sum += (got[c] - want[c]) * (got[c] - want[c]);
        o->all += want[c] * want[c];
        o->worst = fmax(o->worst, fabs(got[c] / want[c] - 1));
    }
}

TEST(exact_and_direct_agree_with_an_independent_integral)
{
    struct environment env = case_environment(128, &case_axes);
    const struct frame frame = case_frame(.3, .8, -.2, -.1, .4, .9);
    static const int powers[] = {1, 3};
    for (int p = 0; p < 2; p++) {
        struct table t = case_table(p ? 301 : 161, .5, powers[p]);
        struct image map[2];
        for (int s = 0; s < 2; s++)
            map[s] = filtered(&t, &fresnels[s], &env, &frame, 65);
        struct off exact[2] = {0}, direct = {0};
        for (int k = 0; k < 12; k++) {
            const double r = sqrt((k + .5) / 12.3), a = 2.4 * k; // out to 0.97
            const int i = (int)lround(32 + 32 * r * cos(a)), j = (int)lround(32 + 32 * r * sin(a));
            const double o[2] = {env_map_cosine(i, 65), env_map_cosine(j, 65)};
            for (int s = 0; s < 2; s++) {
                double want[3], got[3], rgb[3];
                struct err e = {0};
                case_truth(&frame, &case_axes, .5, fresnels[s].schlick, .04, o[0], o[1], want);
                for (int c = 0; c < 3; c++)
                    got[c] = (double)map[s].px[(j * 65 + i) * 3 + c];
                compare(&exact[s], got, want);
                if (p || s || k % 4)
                    continue;
                assert_true(env_direct(&t, &fresnels[s], &env, &frame, 1, (const double(*)[2]) & o,
                                       &rgb, &e));
                compare(&direct, rgb, want);
            }
        }
        for (int s = 0; s < 2; s++) {
            print_message("power %d %s: L2 %.1e, worst %.1e\n", powers[p],
                          s ? "Schlick" : "constant", sqrt(exact[s].sum / exact[s].all),
                          exact[s].worst);
            assert_true(sqrt(exact[s].sum / exact[s].all) < 1e-3);
            assert_true(exact[s].worst < 5e-3);
            image_finish(&map[s]);
        }
        if (!p)
            assert_true(sqrt(direct.sum / direct.all) < 1e-3);
        table_finish(&t);
    }
    environment_finish(&env);
}

// Bilinear in the map, as a renderer reads it.
static double map_at(const struct image *im, double o_t, double o_b, int c)
{
    const double x = (o_t + 1) / 2 * (im->w - 1), y = (o_b + 1) / 2 * (im->w - 1);
    const int i = (int)x, j = (int)y;
    const float *p = im->px + (j * im->w + i) * 3 + c;
    return (1 - y + j) * ((1 - x + i) * (double)p[0] + (x - i) * (double)p[3]) +
           (y - j) * ((1 - x + i) * (double)p[3 * im->w] + (x - i) * (double)p[3 * im->w + 3]);
}

TEST(the_reference_environment_is_met)
{
    struct environment env;
    struct table t;
    struct err e = {0};
    const struct table_nodes nodes = {.6, 1};
    const char *truth = shared_or_skip("reference/env/truth.csv");
    assert_true(table_read(&t, shared_or_skip("reference/env/lut.pfm"), &nodes, &e));
    assert_true(environment_read(&env, shared_or_skip("reference/env/env.pfm"), &e));
    const struct frame frame = {{0.02485224698535815, 0.932164182982101, -0.3611818126443947},
                                {0.9128326633481851, -0.16846041833715697, -0.3719645361836648},
                                {-0.4075768572238095, -0.32045440146607745, -0.855096533753108}};
    for (int s = 0; s < 2; s++) {
        struct image map = filtered(&t, &fresnels[s], &env, &frame, 1024);
        struct off exact = {0}, direct = {0};
        double v[8];
        char line[300];
        FILE *f = fopen(truth, "r");
        assert_non_null(fgets(line, sizeof line, f));
        while (fgets(line, sizeof line, f)) {
            double rgb[3], got[3];
            assert_int_equal(sscanf(line, "%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", v, v + 1, v + 2, v + 3,
                                    v + 4, v + 5, v + 6, v + 7),
                             8);
            for (int c = 0; c < 3; c++)
                got[c] = map_at(&map, v[0], v[1], c);
            compare(&exact, got, v + 2 + 3 * s);
            if (direct.all > 0 && fabs(v[1]) < .55)
                continue; // the judge is slow: the middle and the rim will do
            const double o[1][2] = {{v[0], v[1]}};
            assert_true(env_direct(&t, &fresnels[s], &env, &frame, 1, o, &rgb, &e));
            compare(&direct, rgb, v + 2 + 3 * s);
        }
        fclose(f);
        print_message("exact: L2 %.1e, worst %.1e; direct: L2 %.1e, worst %.1e\n",
                      sqrt(exact.sum / exact.all), exact.worst, sqrt(direct.sum / direct.all),
                      direct.worst);
        assert_true(sqrt(exact.sum / exact.all) < 2e-3 && exact.worst < 1e-2);
        assert_true(sqrt(direct.sum / direct.all) < 2e-4 && direct.worst < 1e-3);
        image_finish(&map);
    }
    table_finish(&t);
    environment_finish(&env);
}

TEST_MAIN(cmocka_unit_test(exact_and_direct_agree_with_an_independent_integral),
          cmocka_unit_test(the_reference_environment_is_met))

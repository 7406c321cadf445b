// test_factor.c - tables as products of filters: error, directions, kinds, files.
#include "tests/env_case.h"

#include "process/factor.h"

// Lobes on a lattice along two directions, so many of them, each `width` wide.
static struct table lattice(int n, int power, const double angle[2], const int count[2],
                            double width, bool cross_only)
{
    struct table t;
    struct err e = {0};
    assert_true(table_init(&t, n, .5, power, 1, &e));
    t.is_rgb = true;
    for (int p = -count[0]; p <= count[0]; p++)
        for (int q = -count[1]; q <= count[1]; q++) {
            if (cross_only && p && q)
                continue;
            for (int c = 0; c < 3; c++) {
                const double d = .1 + .01 * (1 - c), high = exp(-.2 * (p * p + q * q));
                const double x = d * (p * cos(angle[0]) + q * cos(angle[1]));
                const double y = d * (p * sin(angle[0]) + q * sin(angle[1]));
                for (int j = 0; j < n; j++)
                    for (int i = 0; i < n; i++) {
                        const double u = table_node(&t, i) - x, v = table_node(&t, j) - y;
                        const double r2 = (u * u + v * v) / (width * width);
                        if (r2 < 50)
                            t.tab[(j * n + i) * 3 + c] += (float)(high * exp(-.5 * r2));
                    }
            }
        }
    return t;
}

static double rebuilt_error(const struct factors *f, const struct table *t)
{
    double wrong = 0, all = 0;
    for (int j = 0; j < t->n; j++)
        for (int i = 0; i < t->n; i++)
            for (int c = 0; c < 3; c++) {
                const double s = (double)t->tab[(j * t->n + i) * 3 + c];
                double sum = 0;
                for (int r = 0; r < f->rank; r++)
                    sum +=
                        (double)(f->f[0][(r * f->n + i) * 3 + c] * f->f[1][(r * f->n + j) * 3 + c]);
                wrong += (s - sum) * (s - sum);
                all += s * s;
            }
    return sqrt(wrong / all);
}

TEST(an_axis_aligned_lattice_is_one_product_and_each_rank_reports_its_error)
{
    const double square[2] = {0, M_PI / 2}, oblique[2] = {.3, 1.6};
    struct factors f;
    struct err e = {0};
    struct table t = lattice(201, 1, square, (int[]){4, 4}, .015, false);
    assert_true(factor(&f, &t, 1, false, true, &e));
    assert_int_equal(f.kind, FACTOR_COMPOSITION);
    assert_true(f.error[3] < 1e-5);
    factors_finish(&f);
    table_finish(&t);

    t = lattice(201, 1, oblique, (int[]){4, 4}, .015, false);
    assert_true(factor(&f, &t, 6, false, true, &e));
    for (int k = 1; k < 6; k++)
        assert_true(f.error[4 * k + 3] < f.error[4 * k - 1]);
    assert_near(rebuilt_error(&f, &t), f.error[4 * 5 + 3], 1e-5);
    factors_finish(&f);
    table_finish(&t);
}

TEST(main_directions_are_found_and_made_axes)
{
    static const double angles[][2] = {{.3, 1.6}, {2.5, 1.2}, {.8, 2.35}, {0, M_PI / 2}};
    for (int k = 0; k < 4; k++)
        for (int power = 1; power <= 3; power += 2) {
            double found[2];
            struct table t = lattice(241, power, angles[k], (int[]){4, 3}, .012, false);
            factor_directions(&t, M_PI / 3, found);
            if (fabs(sin(found[0] - angles[k][0])) > .1) { // either may be the brighter
                const double swap = found[0];
                found[0] = found[1];
                found[1] = swap;
            }
            for (int q = 0; q < 2; q++)
                assert_near(sin(found[q] - angles[k][q]), 0, .01);
            struct factors plain, straight;
            struct err e = {0};
            assert_true(factor(&plain, &t, 1, false, false, &e));
            assert_true(factor(&straight, &t, 1, true, false, &e));
            print_message("angles %d power %d: plain %.3f straight %.3f\n", k, power,
                          plain.error[3], straight.error[3]);
            // Round lobes become oval on oblique axes: not quite one product, but nearly.
            assert_true(straight.error[3] < .15);
            assert_true(k == 3 || straight.error[3] < .4 * plain.error[3]);
            factors_finish(&plain);
            factors_finish(&straight);
            table_finish(&t);
        }
}

TEST(sums_and_lines_are_told_from_compositions)
{
    static const double diagonals[2] = {M_PI / 4, 3 * M_PI / 4};
    static const struct {
        int count[2];
        bool cross;
        enum factor_kind kind;
    } cases[] = {{{4, 4}, true, FACTOR_SUM},
                 {{4, 0}, false, FACTOR_LINE},
                 {{4, 4}, false, FACTOR_COMPOSITION}};
    for (int k = 0; k < 3; k++) {
        struct table t = lattice(241, 1, diagonals, cases[k].count, .01, cases[k].cross);
        struct factors f;
        struct err e = {0};
        assert_true(factor(&f, &t, 2, false, true, &e));
        assert_int_equal(f.kind, cases[k].kind);
        if (f.kind != FACTOR_COMPOSITION) {
            // A line's filter holds all of the power: sum S du dv.
            double line = 0, all = 0;
            for (int i = 0; i < f.n; i++)
                line += (double)f.f[0][3 * i + 1] + (f.f[1] ? (double)f.f[1][3 * i + 1] : 0);
            for (int i = 0; i < t.n * t.n; i++)
                all += (double)t.tab[3 * i + 1];
            line *= 2 * f.range / (f.n - 1);
            all *= t.range * t.range * 4 / (t.n - 1) / (t.n - 1);
            assert_near(line, all, .01 * all);
            assert_int_equal(f.rank, 1);
            assert_near(fabs(f.axis[0][0] * f.axis[0][1]), .5, .01);
            print_message("kind %d error %.3f\n", f.kind, f.error[3]);
            assert_true(f.error[3] < .05);
        }
        factors_finish(&f);
        table_finish(&t);
    }
}

TEST(factors_survive_a_file)
{
    const double angle[2] = {.3, 1.6};
    struct table t = lattice(61, 1, angle, (int[]){4, 4}, .02, false);
    struct factors f, g;
    struct err e = {0};
    char path[] = "/tmp/nacre_factors_XXXXXX.exr";
    assert_true(mkstemps(path, 4) >= 0);
    assert_true(factor(&f, &t, 3, true, false, &e));
    assert_true(factors_write(&f, path, &e));
    assert_true(factors_read(&g, path, &e));
    assert_int_equal(g.n, f.n);
    assert_int_equal(g.rank, 3);
    assert_near(g.axis[1][0], f.axis[1][0], 0);
    assert_memory_equal(g.f[1], f.f[1], (size_t)(f.n * 3 * 3) * sizeof(float));
    assert_false(factors_write(&f, "/tmp/x.pfm", &e));
    assert_int_equal(e.code, ERR_USAGE);
    unlink(path);
    factors_finish(&f);
    factors_finish(&g);
    table_finish(&t);
}

TEST(impossible_ranks_are_refused)
{
    const double angle[2] = {0, 1.6};
    struct table t = lattice(21, 1, angle, (int[]){1, 1}, .02, false);
    struct factors f;
    struct err e = {0};
    assert_false(factor(&f, &t, 22, false, false, &e));
    assert_int_equal(e.code, ERR_DATA);
    assert_string_equal(e.msg, "bad rank 22: must be 1 to 21, the table's nodes a side");
    assert_false(factor(&f, &t, 0, false, false, &e));
    table_finish(&t);
}

TEST_MAIN(cmocka_unit_test(an_axis_aligned_lattice_is_one_product_and_each_rank_reports_its_error),
          cmocka_unit_test(main_directions_are_found_and_made_axes),
          cmocka_unit_test(sums_and_lines_are_told_from_compositions),
          cmocka_unit_test(factors_survive_a_file), cmocka_unit_test(impossible_ranks_are_refused))

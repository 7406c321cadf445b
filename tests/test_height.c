// test_height.c - height fields levelled, cut, turned and resampled against closed forms.
#include "tests/test.h"

#include "process/level.h"
#include "process/periods.h"
#include "process/regrid.h"
#include "process/roughness.h"

static struct hfield made(int nx, int ny, double dx_m, double dy_m, double (*z)(double, double))
{
    struct hfield hf;
    struct err e;
    assert_true(hfield_init(&hf, nx, ny, dx_m, dy_m, &e));
    for (int j = 0; j < ny; j++)
        for (int i = 0; i < nx; i++)
            hf.z[j * nx + i] = (float)z(i * dx_m, j * dy_m);
    return hf;
}

static double plane(double x, double y)
{
    return 3e-7 + 0.02 * x - 0.05 * y;
}
static double bowl(double x, double y)
{
    return 1e-7 + 400 * x * x - 300 * y * x + 100 * y * y + 0.01 * x;
}
static double waves(double x, double y) // 4 um along x and 6 um along y, 100 and 40 nm
{
    return 1e-7 * cos(2 * M_PI * x / 4e-6) + 4e-8 * cos(2 * M_PI * y / 6e-6);
}

TEST(levelling_takes_a_form_and_leaves_holes)
{
    static const struct {
        enum level how;
        double (*z)(double, double);
        double left_m; // float rounding of heights of some um
    } cases[] = {{LEVEL_PLANE, plane, 1e-12}, {LEVEL_QUADRIC, bowl, 1e-12}};
    for (int k = 0; k < 2; k++) {
        struct hfield hf = made(61, 47, 1e-7, 2e-7, cases[k].z);
        struct err e;
        hf.z[7 * 61 + 3] = NAN;
        if (!hfield_level(&hf, cases[k].how, &e))
            fail_msg("%s", e.msg);
        assert_true(isnan(hf.z[7 * 61 + 3]));
        for (int p = 0; p < 61 * 47; p++)
            if (p != 7 * 61 + 3)
                assert_near(hf.z[p], 0, cases[k].left_m);
        hfield_finish(&hf);
    }
}

TEST(rows_lose_their_own_median_and_the_field_its_mean)
{
    struct hfield hf = made(5, 3, 1e-6, 1e-6, plane);
    struct err e;
    assert_true(hfield_level(&hf, LEVEL_ROWS, &e));
    for (int k = 0; k < 15; k++)
        assert_near(hf.z[k], 0.02e-6 * (k % 5 - 2), 1e-13);
    for (int k = 0; k < 15; k++)
        hf.z[k] = (float)(1e-9 * k);
    assert_true(hfield_level(&hf, LEVEL_MEAN, &e));
    assert_near(hf.z[7], 0, 1e-15);
    for (int k = 0; k < 15; k++)
        hf.z[k] = k % 5 == 2 ? 1e-9f : NAN; // one column: no tilt along x
    assert_false(hfield_level(&hf, LEVEL_PLANE, &e));
    assert_non_null(strstr(e.msg, "3 measured nodes do not determine a form of 3 terms"));
    hfield_finish(&hf);
}

TEST(roughness_is_that_of_the_standard)
{
    // a sine over whole periods: Sq = a / sqrt 2, Sa = 2 a / pi, Ssk = 0, Sku = 3/2
    struct hfield hf = made(400, 10, 1e-7, 1e-7, plane);
    struct roughness r;
    struct err e;
    for (int k = 0; k < 4000; k++)
        hf.z[k] = (float)(5e-6 + 1e-7 * sin(2 * M_PI * (k % 400 + 0.5) / 40));
    hf.z[3] = NAN;
    assert_true(hfield_roughness(&r, &hf, &e));
    assert_near(r.sq_m / 1e-7, M_SQRT1_2, 1e-4); // 40 samples a period, one missing
    assert_near(r.sa_m / 1e-7, 2 / M_PI, 1e-3);
    assert_near(r.sz_m / 1e-7, 2 * cos(M_PI / 40), 1e-5);
    assert_near(r.mean_m, 5e-6, 3e-11); // the missing one was above it
    assert_near(r.ssk, 0, 2e-3);
    assert_near(r.sku, 1.5, 1e-3);
    for (int k = 0; k < 4000; k++)
        hf.z[k] = NAN;
    assert_false(hfield_roughness(&r, &hf, &e));
    assert_string_equal(e.msg, "no node was measured");
    hfield_finish(&hf);
}

TEST(a_part_keeps_its_place)
{
    struct hfield hf = made(100, 80, 1e-7, 2e-7, plane), part;
    struct err e;
    assert_true(hfield_crop(&part, &hf, 2e-6, 4e-6, 3e-6, 5e-6, &e));
    assert_int_equal(part.nx, 30);
    assert_int_equal(part.ny, 25);
    assert_near(part.z[0], plane(2e-6, 4e-6), 1e-13);
    assert_near(meta_find(&part.meta, "nacre.offset_m")->num[1], 4e-6, 1e-18);
    hfield_finish(&part);
    assert_false(hfield_crop(&part, &hf, 8e-6, 0, 3e-6, 1e-6, &e));
    assert_non_null(strstr(e.msg, "is not a part of the field of 10 x 16 um (100 x 80 nodes)"));
    hfield_finish(&hf);
}

TEST(a_quarter_turn_moves_nodes_and_four_are_none)
{
    struct hfield hf = made(7, 5, 1e-7, 3e-7, bowl), turned;
    struct err e;
    hf.z[4] = NAN;
    assert_true(hfield_turn(&turned, &hf, M_PI / 2, &e));
    assert_int_equal(turned.nx, 5);
    assert_near(turned.dx_m, 3e-7, 0);
    // what lay along x lies along y: node (i, j) goes to (4 - j, i)
    assert_near(turned.z[2 * 5 + 3], hf.z[1 * 7 + 2], 0);
    assert_true(isnan(turned.z[4 * 5 + 4]));
    for (int k = 1; k < 4; k++) {
        struct hfield next;
        assert_true(hfield_turn(&next, &turned, M_PI / 2, &e));
        hfield_finish(&turned);
        turned = next;
    }
    assert_memory_equal(turned.z, hf.z, 35 * sizeof(float));
    hfield_finish(&turned);
    hfield_finish(&hf);
}

TEST(turning_adds_to_the_direction_of_a_period_and_keeps_planes)
{
    struct hfield hf = made(300, 240, 1e-7, 1.3e-7, waves), turned;
    struct period p[2];
    struct err e;
    assert_true(hfield_turn(&turned, &hf, 20 * M_PI / 180, &e));
    assert_near(turned.dy_m, 1e-7, 0);
    assert_int_equal(hfield_periods(&turned, p, &e), 2);
    assert_near(p[0].direction_rad * 180 / M_PI, 20, 0.02);
    assert_near(p[0].period_m / 4e-6, 1, 5e-4);
    assert_near(p[1].direction_rad * 180 / M_PI, -70, 0.1);
    assert_int_equal(hfield_missing(&turned), 0);
    hfield_finish(&turned);
    hfield_finish(&hf);
    hf = made(200, 90, 1e-7, 1e-7, plane); // narrow: touches the long sides only
    for (int k = 0; k < 2; k++) {
        assert_true(hfield_turn(&turned, &hf, (k ? 40 : 8) * M_PI / 180, &e));
        const double steepest = atan2(-0.05, 0.02) + (k ? 40 : 8) * M_PI / 180;
        const double dzdx = turned.z[1] - turned.z[0], dzdy = turned.z[turned.nx] - turned.z[0];
        assert_near(dzdx / 1e-7, hypot(0.05, 0.02) * cos(steepest), 1e-4);
        assert_near(dzdy / 1e-7, hypot(0.05, 0.02) * sin(steepest), 1e-4);
        hfield_finish(&turned);
    }
    hfield_finish(&hf);
}

TEST(resampling_keeps_planes_and_waves_and_forgets_what_the_new_nodes_cannot_hold)
{
    struct hfield hf = made(200, 120, 1e-7, 2e-7, plane), next;
    struct err e;
    static const double steps[][2] = {{0.37e-7, 0.9e-7}, {3e-7, 5e-7}, {1e-7, 2e-7}};
    for (int k = 0; k < 3; k++) {
        assert_true(hfield_resample(&next, &hf, steps[k][0], steps[k][1], &e));
        for (int p = 0; p < next.nx * next.ny; p++)
            assert_near(next.z[p], plane(p % next.nx * steps[k][0], p / next.nx * steps[k][1]),
                        3e-12);
        hfield_finish(&next);
    }
    hfield_finish(&hf);
    hf = made(401, 301, 1e-7, 1e-7, waves); // finer: the waves themselves
    assert_true(hfield_resample(&next, &hf, 0.4e-7, 0.4e-7, &e));
    for (int p = 0; p < next.nx * next.ny; p++) {
        const int i = p % next.nx, j = p / next.nx;
        if (i > 20 && j > 20 && i < next.nx - 20 && j < next.ny - 20)
            assert_near(next.z[p], waves(i * 0.4e-7, j * 0.4e-7), 1e-12);
    }
    hfield_finish(&next);
    // far coarser than 4 um: their Gaussian share at that period, exp(-2 (pi sigma / period)^2)
    assert_true(hfield_resample(&next, &hf, 3e-6, 1e-7, &e));
    const double sigma = 0.375 * sqrt(9 - 0.01), left = exp(-2 * pow(M_PI * sigma / 4, 2));
    const int j = 150, i = 6; // the middle
    assert_near(next.z[j * next.nx + i],
                1e-7 * left * cos(2 * M_PI * i * 3e-6 / 4e-6) +
                    4e-8 * cos(2 * M_PI * j * 1e-7 / 6e-6),
                2e-10);
    hfield_finish(&next);
    assert_false(hfield_resample(&next, &hf, 1, 1e-7, &e));
    assert_non_null(strstr(e.msg, "leaves 1 x 301 nodes"));
    hfield_finish(&hf);
}

TEST(holes_stay_where_they_are)
{
    struct hfield hf = made(100, 100, 1e-7, 1e-7, waves), next;
    struct err e;
    for (int j = 40; j < 60; j++)
        for (int i = 40; i < 60; i++)
            hf.z[j * 100 + i] = NAN;
    assert_true(hfield_resample(&next, &hf, 0.5e-7, 0.5e-7, &e));
    assert_true(isnan(next.z[100 * next.nx + 100]));
    assert_near((double)hfield_missing(&next), 1600, 80);
    hfield_finish(&next);
    assert_true(hfield_turn(&next, &hf, 0.5, &e));
    assert_near((double)hfield_missing(&next), 400, 40);
    hfield_finish(&next);
    hfield_finish(&hf);
}

TEST_MAIN(
    cmocka_unit_test(levelling_takes_a_form_and_leaves_holes),
    cmocka_unit_test(rows_lose_their_own_median_and_the_field_its_mean),
    cmocka_unit_test(roughness_is_that_of_the_standard), cmocka_unit_test(a_part_keeps_its_place),
    cmocka_unit_test(a_quarter_turn_moves_nodes_and_four_are_none),
    cmocka_unit_test(turning_adds_to_the_direction_of_a_period_and_keeps_planes),
    cmocka_unit_test(resampling_keeps_planes_and_waves_and_forgets_what_the_new_nodes_cannot_hold),
    cmocka_unit_test(holes_stay_where_they_are))

// test_tile.c - tiles continue over their borders, windows end level.
#include "tests/test.h"

#include "process/tile.h"

// Crossed waves of 23.4 and 17.7 nodes, the lattice turned by `turn`.
static struct hfield waves(int nx, int ny, double turn)
{
    struct hfield hf;
    struct err e;
    assert_true(hfield_init(&hf, nx, ny, 1e-7, 1e-7, &e));
    for (int j = 0; j < ny; j++)
        for (int i = 0; i < nx; i++) {
            const double x = cos(turn) * i + sin(turn) * j, y = cos(turn) * j - sin(turn) * i;
            hf.z[j * nx + i] =
                (float)(1e-7 * (cos(2 * M_PI * x / 23.4) + 0.5 * cos(2 * M_PI * y / 17.7)) + 5e-7);
        }
    return hf;
}

// Largest step between neighbours, over the border (wrapping) or inside.
static double step(const struct hfield *hf, bool border)
{
    double most = 0;
    for (int j = 0; j < hf->ny; j++)
        for (int i = 0; i < hf->nx; i++) {
            const int right = (i + 1) % hf->nx, down = (j + 1) % hf->ny;
            const double here = (double)hf->z[j * hf->nx + i];
            if ((right == 0) == border)
                most = fmax(most, fabs((double)hf->z[j * hf->nx + right] - here));
            if ((down == 0) == border)
                most = fmax(most, fabs((double)hf->z[down * hf->nx + i] - here));
        }
    return most;
}

TEST(a_tile_continues_over_its_borders_as_it_does_inside)
{
    static const double turns[] = {0, 0.16, 0.7};
    for (int k = 0; k < 3; k++) {
        struct hfield hf = waves(400, 300, turns[k]);
        struct err e;
        double seam;
        const double before = step(&hf, false);
        assert_true(hfield_tile(&hf, &seam, &e));
        assert_true(hf.nx > 200 && hf.nx <= 350 && hf.ny > 150 && hf.ny <= 263);
        print_message("turn %.2f: %d x %d, seam %.3f, steps %.3g inside %.3g over the border\n",
                      turns[k], hf.nx, hf.ny, seam, step(&hf, false), step(&hf, true));
        assert_true(step(&hf, true) < 1.1 * before);
        assert_true(step(&hf, false) < 1.3 * before);
        if (k == 0)
            assert_true(seam < 0.1); // whole periods were found
        hfield_finish(&hf);
    }
}

TEST(a_window_ends_level_and_leaves_the_middle)
{
    struct hfield hf = waves(200, 160, 0.2), before = waves(200, 160, 0.2);
    hfield_window(&hf);
    for (int i = 0; i < 200; i++)
        assert_near(hf.z[i] * 1e7, hf.z[159 * 200 + i] * 1e7, 0.02);
    assert_true(step(&hf, true) < 1e-9);
    for (int j = 40; j < 120; j++)
        for (int i = 40; i < 160; i++)
            assert_near(hf.z[j * 200 + i] * 1e7, before.z[j * 200 + i] * 1e7, 1e-4);
    hfield_finish(&hf);
    hfield_finish(&before);
}

TEST(what_cannot_be_a_tile_is_refused)
{
    struct hfield hf = waves(30, 100, 0);
    struct err e;
    double seam;
    assert_false(hfield_tile(&hf, &seam, &e));
    assert_int_equal(e.code, ERR_DATA);
    hfield_finish(&hf);
    hf = waves(50, 50, 0);
    hf.z[7] = NAN;
    assert_false(hfield_tile(&hf, &seam, &e));
    assert_non_null(strstr(e.msg, "1 heights are missing"));
    hfield_finish(&hf);
}

TEST_MAIN(cmocka_unit_test(a_tile_continues_over_its_borders_as_it_does_inside),
          cmocka_unit_test(a_window_ends_level_and_leaves_the_middle),
          cmocka_unit_test(what_cannot_be_a_tile_is_refused))

// test_lattice.c - lattices of periodic pictures, also where the strongest peaks are not those of
// the longest periods; what is no lattice; cells folded from it.
#include "tests/test.h"

#include "process/cell.h"
#include "tests/noise.h"

enum { W = 500, H = 460 };
static const struct disc disc = {243.3, 231.8, 220, 0};

// 1 + sum of waves c cos(2 pi (p k0 + q k1).x + phase) + noise.
struct wave {
    int p, q;
    double c;
};

static void paint(float *px, const double k0[2], const double k1[2], const struct wave *wave, int n,
                  double noise)
{
    uint64_t seed = 3;
    for (int j = 0; j < H; j++)
        for (int i = 0; i < W; i++) {
            double v = 1 + noise * noise_gauss(&seed);
            for (int m = 0; m < n; m++)
                v += wave[m].c * cos(2 * M_PI *
                                     ((wave[m].p * k0[0] + wave[m].q * k1[0]) * (i - disc.cx_px) +
                                      (wave[m].p * k0[1] + wave[m].q * k1[1]) * (j - disc.cy_px)));
            px[j * W + i] = hypot(i - disc.cx_px, j - disc.cy_px) < disc.radius_px ? (float)v : 1;
        }
}

static float px[W * H];

TEST(all_peaks_stand_on_the_lattice_that_is_found)
{
    static const struct {
        double k0[2], k1[2];
        struct wave wave[4];
        double noise;
    } cases[] = {
        {{0.03, 0.004}, {-0.003, 0.025}, {{1, 0, .2}, {0, 1, .1}, {1, 1, .02}}, 0.005},
        // only multiples of 2 and 3 of k0 show: their difference is the lattice's
        {{0.021, 0.002}, {0.004, 0.031}, {{2, 0, .2}, {0, 1, .1}, {3, 1, .05}, {3, 0, .02}}, 0.002},
        // centred: no peak has p + q odd
        {{0.02, 0}, {0, 0.03}, {{1, 1, .2}, {1, -1, .2}, {2, 0, .05}}, 0.01},
        {{0.05, 0}, {0, 0.05}, {{1, 0, .2}, {0, 1, .2}}, 0},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct lattice l;
        struct err e;
        paint(px, cases[k].k0, cases[k].k1, cases[k].wave, 4, cases[k].noise);
        if (!lattice_find(&l, &disc, px, W, H, &e))
            fail_msg("case %zu: %s", k, e.msg);
        for (int m = 0; m < 4 && cases[k].wave[m].c > 0; m++) {
            double nx, ny;
            const struct wave *v = &cases[k].wave[m];
            const double x = v->p * cases[k].k0[0] + v->q * cases[k].k1[0],
                         y = v->p * cases[k].k0[1] + v->q * cases[k].k1[1];
            lattice_nearest(&l, x, y, &nx, &ny);
            assert_near(nx, x, 2e-5);
            assert_near(ny, y, 2e-5);
        }
        const double area = l.kx[0] * l.ky[1] - l.ky[0] * l.kx[1],
                     all = cases[k].k0[0] * cases[k].k1[1] - cases[k].k0[1] * cases[k].k1[0];
        assert_near(area / all, k == 2 ? 2 : 1, 1e-3); // no finer than it needs to be
    }
}

TEST(a_cell_holds_the_picture_and_its_noise)
{
    static const double k0[] = {0.03, 0.004}, k1[] = {-0.003, 0.025};
    static const struct wave wave[] = {{1, 0, .2}, {0, 1, .1}, {1, 1, .02}};
    struct lattice l;
    struct cell c;
    struct err e;
    paint(px, k0, k1, wave, 3, 0.01);
    assert_true(lattice_find(&l, &disc, px, W, H, &e));
    assert_true(cell_fold(&c, &l, &disc, px, W, H, &e));
    assert_true(cell_sharpen(&c, 0.5, &e));
    assert_true(cell_refold(&c, &disc, px, W, H, &e));
    assert_true(cell_sharpen(&c, 0.5, &e));
    cell_judge(&c, &disc, px, W, H);
    assert_near(c.noise, 0.01, 0.0005);
    assert_true(c.unexplained < 0.002);
    double square = 0;
    int n = 0;
    for (int j = 150; j < 300; j++)
        for (int i = 150; i < 350; i++, n++) {
            double v = 1;
            for (int m = 0; m < 3; m++)
                v += wave[m].c * cos(2 * M_PI *
                                     ((wave[m].p * k0[0] + wave[m].q * k1[0]) * (i - disc.cx_px) +
                                      (wave[m].p * k0[1] + wave[m].q * k1[1]) * (j - disc.cy_px)));
            square += pow(cell_at(&c, c.sharp, i, j) - v, 2);
        }
    print_message("noise %.4f, unexplained %.1e, rms off %.4f\n", c.noise, c.unexplained,
                  sqrt(square / n));
    assert_true(sqrt(square / n) < 0.004);
    cell_finish(&c);
}

TEST(what_is_no_lattice_is_told)
{
    static const double k0[] = {0.03, 0.004}, k1[] = {-0.003, 0.025}, odd[] = {0.0173, 0.0071};
    static const struct wave lines[] = {{1, 0, .2}, {2, 0, .1}}, few[] = {{1, 0, .2}, {0, 1, .2}};
    static const double slow[] = {0.002, 0};
    struct lattice l;
    struct err e;
    paint(px, k0, k1, lines, 2, 0.01);
    assert_false(lattice_find(&l, &disc, px, W, H, &e));
    assert_non_null(strstr(e.msg, "in one direction"));
    paint(px, slow, k1, few, 2, 0.001);
    assert_false(lattice_find(&l, &disc, px, W, H, &e));
    paint(px, k0, k1, few, 2, 0);
    for (int j = 0; j < H; j++)
        for (int i = 0; i < W; i++) // a third wave that fits no cell
            if (hypot(i - disc.cx_px, j - disc.cy_px) < disc.radius_px)
                px[j * W + i] += 0.1f * cosf((float)(2 * M_PI * (odd[0] * i + odd[1] * j)));
    assert_false(lattice_find(&l, &disc, px, W, H, &e));
    print_message("%s\n", e.msg);
    assert_non_null(strstr(e.msg, "stands beside it"));
}

TEST_MAIN(cmocka_unit_test(all_peaks_stand_on_the_lattice_that_is_found),
          cmocka_unit_test(a_cell_holds_the_picture_and_its_noise),
          cmocka_unit_test(what_is_no_lattice_is_told))

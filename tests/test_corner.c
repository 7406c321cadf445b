// test_corner.c - corners of a chessboard to thousandths of a pixel, also under uneven light.
#include "tests/test.h"

#include "calib/corner.h"
#include "core/mem.h"

enum { W = 240, H = 200, COLS = 6, ROWS = 5, FINE = 16 };
static const double side_px = 30, turn_rad = 0.12, left = 52.3, top = 44.7;

static void corner_at(int k, double out[2])
{
    const double x = side_px * (k % COLS), y = side_px * (k / COLS);
    out[0] = left + cos(turn_rad) * x - sin(turn_rad) * y;
    out[1] = top + sin(turn_rad) * x + cos(turn_rad) * y;
}

// Where a share of a blur lies: a tent of two pixels.
static double tent(double share)
{
    return share < 0.5 ? sqrt(2 * share) - 1 : 1 - sqrt(2 * (1 - share));
}

// Every pixel the mean of FINE^2 points; the light rises by `rise_px` of its middle along x.
static float *photograph(double rise_px)
{
    float *light = xcalloc(W * H, sizeof *light);
    for (int j = 0; j < H; j++)
        for (int i = 0; i < W; i++) {
            int white = 0;
            for (int k = 0; k < FINE * FINE; k++) {
                const double x = i + tent((k % FINE + 0.5) / FINE) - left;
                const double y = j + tent((k / FINE + (k % FINE + 0.5) / FINE) / FINE) - top;
                const double a = (cos(turn_rad) * x + sin(turn_rad) * y) / side_px;
                const double b = (cos(turn_rad) * y - sin(turn_rad) * x) / side_px;
                white += ((int)floor(a) + (int)floor(b)) & 1;
            }
            const double paper = 0.04 + 0.76 * white / (FINE * FINE);
            light[j * W + i] = (float)(paper * (1 + rise_px * (i - W / 2)));
        }
    return light;
}

TEST(uneven_light_shifts_no_corner)
{
    static const double rises_px[] = {0, 0.001, -0.003};
    const struct board b = {.cols = COLS, .rows = ROWS, .square_m = 0.02};
    for (size_t r = 0; r < sizeof rises_px / sizeof *rises_px; r++) {
        int id[COLS * ROWS];
        double px[COLS * ROWS][2], square = 0;
        struct corners c = {COLS * ROWS, id, px};
        float *light = photograph(rises_px[r]);
        for (int k = 0; k < c.n; k++) {
            id[k] = k;
            corner_at(k, px[k]);
            px[k][0] += k % 2 ? 0.3 : -0.2; // as a first look sees them
        }
        corners_refine(&b, &c, light, W, H);
        for (int k = 0; k < c.n; k++) {
            double at[2];
            corner_at(k, at);
            square +=
                (px[k][0] - at[0]) * (px[k][0] - at[0]) + (px[k][1] - at[1]) * (px[k][1] - at[1]);
        }
        print_message("light rises by %g a px: %.2g px\n", rises_px[r], sqrt(square / c.n));
        assert_true(sqrt(square / c.n) < 3e-3);
        free(light);
    }
}

TEST_MAIN(cmocka_unit_test(uneven_light_shifts_no_corner))

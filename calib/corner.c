// corner.c - Gauss-Newton on the model of a blurred corner.
//
// Light that rises by 0.1 % a pixel shifts a corner by 0.01 px. Its rise cannot be told from one
// corner where markers reach into the window, but from all of them: how far black is from white is
// a smooth function over the board.
#define _GNU_SOURCE
#include "calib/corner.h"
#include "calib/normal.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { REACH_PX = 12 };
enum { X, Y, ANGLE_1, ANGLE_2, LEVEL, SWING, BLUR, UNKNOWNS };

// An edge behind a Gaussian blur, averaged over a pixel: integral of erf, and its derivatives by
// the distance and by the blur.
static double edge(double across, double blur, double *by_across, double *by_blur)
{
    double part[2], bell[2], all[2];
    for (int k = 0; k < 2; k++) {
        const double t = across + (k ? 0.5 : -0.5);
        part[k] = erf(t / (M_SQRT2 * blur));
        bell[k] = sqrt(2 / M_PI) * exp(-0.5 * t * t / (blur * blur));
        all[k] = t * part[k] + blur * bell[k];
    }
    *by_across = part[1] - part[0];
    *by_blur = bell[1] - bell[0];
    return all[1] - all[0];
}

// The model at (x, y) and its derivatives by the unknowns, under a light that rises by rise[2] a
// px.
static double model(const double p[UNKNOWNS], const double rise_px[2], double x, double y,
                    double d[UNKNOWNS])
{
    const double dx = x - p[X], dy = y - p[Y];
    double side[2], rise[2], blur[2], along[2];
    for (int q = 0; q < 2; q++) {
        const double c = cos(p[ANGLE_1 + q]), i = sin(p[ANGLE_1 + q]);
        along[q] = c * dx + i * dy;
        side[q] = edge(c * dy - i * dx, p[BLUR], &rise[q], &blur[q]);
    }
    const double lit = 1 + rise_px[0] * dx + rise_px[1] * dy, swing = p[SWING] * lit;
    const double one = swing * rise[0] * side[1], two = swing * rise[1] * side[0];
    const double paper = p[LEVEL] + p[SWING] * side[0] * side[1];
    d[X] = one * sin(p[ANGLE_1]) + two * sin(p[ANGLE_2]) - paper * rise_px[0];
    d[Y] = -one * cos(p[ANGLE_1]) - two * cos(p[ANGLE_2]) - paper * rise_px[1];
    d[ANGLE_1] = -one * along[0];
    d[ANGLE_2] = -two * along[1];
    d[LEVEL] = lit;
    d[SWING] = lit * side[0] * side[1];
    d[BLUR] = swing * (blur[0] * side[1] + blur[1] * side[0]);
    return paper * lit;
}

// The pixels to fit: a disc, of which only those within `beside` of either edge are board and not
// marker.
struct window {
    double middle[2], direction[2], reach, beside, rise_px[2];
    const float *light; // [h][w]
    int w, h;
};

static bool is_clear(const struct window *a, int i, int j)
{
    double off[2];
    for (int q = 0; q < 2; q++)
        off[q] = fabs(cos(a->direction[q]) * (j - a->middle[1]) -
                      sin(a->direction[q]) * (i - a->middle[0]));
    return i >= 0 && j >= 0 && i < a->w && j < a->h && fmin(off[0], off[1]) < a->beside;
}

// Misses of the pixels in the window, and the normal equations of a step when n is not NULL.
static double misses(const double p[UNKNOWNS], const struct window *a, struct normal *n)
{
    static const int all[UNKNOWNS] = {0, 1, 2, 3, 4, 5, 6};
    double sum = 0, d[UNKNOWNS];
    const int r = (int)ceil(a->reach);
    const int ci = (int)lround(a->middle[0]), cj = (int)lround(a->middle[1]);
    for (int j = cj - r; j <= cj + r; j++)
        for (int i = ci - r; i <= ci + r; i++) {
            const double far = hypot(i - a->middle[0], j - a->middle[1]) / a->reach;
            if (far > 1 || !is_clear(a, i, j))
                continue;
            const double weight = 1 - far * far;
            const double miss = (double)a->light[(size_t)j * (size_t)a->w + (size_t)i] -
                                model(p, a->rise_px, i, j, d);
            sum += weight * miss * miss;
            if (n)
                normal_add(n, UNKNOWNS, all, d, miss, weight);
        }
    return sum;
}

// Mean and swing of the window for the directions in p.
static void levels(const struct window *a, double p[UNKNOWNS])
{
    const int r = (int)a->reach, ci = (int)lround(a->middle[0]), cj = (int)lround(a->middle[1]);
    double sum = 0, count = 0, quadrants = 0, d[UNKNOWNS];
    p[LEVEL] = 0;
    p[SWING] = 1;
    for (int pass = 0; pass < 2; pass++)
        for (int j = cj - r; j <= cj + r; j++)
            for (int i = ci - r; i <= ci + r; i++) {
                if (!is_clear(a, i, j))
                    continue;
                const double x = (double)a->light[(size_t)j * (size_t)a->w + (size_t)i];
                if (pass == 0) {
                    sum += x;
                    count++;
                } else {
                    quadrants += (x - sum / count) * model(p, a->rise_px, i, j, d);
                }
            }
    p[LEVEL] = sum / count;
    p[SWING] = quadrants / count;
}

// Returns how far white is from black, NAN where the model does not fit.
static double refine(double at[2], const struct window *a)
{
    double p[UNKNOWNS] = {at[0], at[1], a->direction[0], a->direction[1], 0, 1, 0.7};
    levels(a, p);
    double now = misses(p, a, NULL), damping = 1e-3;
    for (int turn = 0; turn < 60 && damping < 1e6; turn++) {
        struct normal n;
        double step[UNKNOWNS], to[UNKNOWNS];
        struct err ignored;
        normal_init(&n, UNKNOWNS);
        misses(p, a, &n);
        for (int k = 0; k < UNKNOWNS; k++)
            n.a[k * UNKNOWNS + k] *= 1 + damping;
        const bool ok = normal_solve(&n, step, NULL, &ignored);
        normal_finish(&n);
        for (int k = 0; k < UNKNOWNS; k++)
            to[k] = p[k] + step[k];
        const double then =
            ok && to[BLUR] > 0.05 && to[BLUR] < a->reach ? misses(to, a, NULL) : INFINITY;
        if (!(then < now)) {
            damping *= 10;
            continue;
        }
        memcpy(p, to, sizeof p);
        now = then;
        damping *= 0.1;
        if (hypot(step[X], step[Y]) < 1e-6)
            break;
    }
    if (!(hypot(p[X] - at[0], p[Y] - at[1]) < fmin(2, 0.4 * a->reach)))
        return NAN;
    at[0] = p[X];
    at[1] = p[Y];
    return fabs(p[SWING]);
}

// The step from corner to corner along the board's rows (axis 0) or columns, where neighbours show
// it.
static bool step_at(const struct board *b, const double (*at)[2], const bool *known, int id,
                    int axis, double step[2])
{
    const int by = axis ? b->cols : 1, place = axis ? id / b->cols : id % b->cols;
    const int count = axis ? b->rows : b->cols;
    const int lo = place > 0 && known[id - by] ? id - by : id;
    const int hi = place < count - 1 && known[id + by] ? id + by : id;
    if (lo == hi)
        return false;
    for (int k = 0; k < 2; k++)
        step[k] = (at[hi][k] - at[lo][k]) * by / (hi - lo);
    return true;
}

// How the light rises at each corner, per px, from a plane through the swings, or a quadratic where
// there are many. [n][2]
static void find_rises(const struct corners *c, const double *swing, double (*rise_px)[2])
{
    static const int all[6] = {0, 1, 2, 3, 4, 5};
    enum { FEWEST = 12, MANY = 24 };
    double q[6] = {0}, middle[2] = {0};
    struct normal n;
    struct err ignored;
    for (int k = 0; k < c->n; k++)
        for (int d = 0; d < 2; d++)
            middle[d] += c->px[k][d] / c->n;
    const int terms = c->n < MANY ? 3 : 6;
    normal_init(&n, terms);
    for (int k = 0; k < c->n; k++) {
        const double x = c->px[k][0] - middle[0], y = c->px[k][1] - middle[1];
        if (!isnan(swing[k]))
            normal_add(&n, terms, all, (double[]){1, x, y, x * x, x * y, y * y}, swing[k], 1);
    }
    const bool ok = n.count >= FEWEST && normal_solve(&n, q, NULL, &ignored);
    normal_finish(&n);
    for (int k = 0; k < c->n; k++) {
        const double x = c->px[k][0] - middle[0], y = c->px[k][1] - middle[1];
        const double level = q[0] + x * (q[1] + q[3] * x + q[4] * y) + y * (q[2] + q[5] * y);
        rise_px[k][0] = ok ? (q[1] + 2 * q[3] * x + q[4] * y) / level : 0;
        rise_px[k][1] = ok ? (q[2] + q[4] * x + 2 * q[5] * y) / level : 0;
    }
}

// The window of corner k; false where its neighbours do not tell one.
static bool find_window(const struct board *b, const struct corners *c, const double (*at)[2],
                        const bool *known, int k, struct window *a)
{
    double step[2][2];
    if (!step_at(b, at, known, c->id[k], 0, step[0]) ||
        !step_at(b, at, known, c->id[k], 1, step[1]))
        return false;
    for (int q = 0; q < 2; q++) {
        a->middle[q] = c->px[k][q];
        a->direction[q] = atan2(step[q][1], step[q][0]);
    }
    const double side = fmin(hypot(step[0][0], step[0][1]), hypot(step[1][0], step[1][1])) *
                        fabs(sin(a->direction[1] - a->direction[0]));
    a->reach = fmin(REACH_PX, 0.4 * side);
    a->beside = INFINITY;
    if (b->marker_m > 0) // markers begin (square - marker) / 2 beside the edges
        a->beside = fmax(1, 0.4 * (1 - b->marker_m / b->square_m) * side);
    return a->reach >= 3;
}

void corners_refine(const struct board *b, struct corners *c, const float *light, int w, int h)
{
    const size_t all = (size_t)b->cols * (size_t)b->rows, n = (size_t)c->n;
    double(*at)[2] = xcalloc(all, sizeof *at); // by id
    bool *known = xcalloc(all, sizeof *known);
    double *swing = xcalloc(n + 1, sizeof *swing), (*rise_px)[2] = xcalloc(n + 1, sizeof *rise_px);
    for (int k = 0; k < c->n; k++) {
        memcpy(at[c->id[k]], c->px[k], sizeof *at);
        known[c->id[k]] = true;
    }
    for (int pass = 0; pass < 2; pass++) { // as if lit evenly, then as it is
        for (int k = 0; k < c->n; k++) {
            struct window a = {
                .rise_px = {rise_px[k][0], rise_px[k][1]}, .light = light, .w = w, .h = h};
            const bool clear = find_window(b, c, (const double(*)[2])at, known, k, &a);
            swing[k] = clear ? refine(c->px[k], &a) : NAN;
        }
        find_rises(c, swing, rise_px);
    }
    free(at);
    free(known);
    free(swing);
    free(rise_px);
}

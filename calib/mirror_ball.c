// mirror_ball.c - a mirror ball in a picture, and the line from it to the light.
//
// The rays to the outline of a ball make a cone: r.q = 1 for all of them, q = axis / cos(half
// angle), which is a linear fit and exact for any lens that is known. With the radius the half
// angle gives the distance.
#define _GNU_SOURCE
#include "calib/light.h"
#include "calib/normal.h"
#include "core/mem.h"
#include "core/sort.h"
#include <stdlib.h>
#include <string.h>

enum { ANGLES = 720 };

struct view {
    const struct lens *lens;
    const float *light; // [h][w]
    int w, h;
};

struct circle {
    double x, y, r; // px
};

static double at(const struct view *v, double x, double y) // bilinear; NAN outside
{
    const int i = (int)floor(x), j = (int)floor(y);
    if (!(x >= 0 && y >= 0 && i + 1 < v->w && j + 1 < v->h))
        return NAN;
    const float *p = v->light + (size_t)j * (size_t)v->w + (size_t)i;
    const double f = x - i, g = y - j;
    return (1 - g) * ((1 - f) * (double)p[0] + f * (double)p[1]) +
           g * ((1 - f) * (double)p[v->w] + f * (double)p[v->w + 1]);
}

struct blob {
    int n, left, right, top, bottom;
    double x, y; // sums
};

// All pixels joined to k that are at or beyond `level` on that side; marks them. stack[w h].
static struct blob flood(const struct view *v, int k, double level, bool above, char *mark,
                         int *stack)
{
    struct blob b = {0, v->w, -1, v->h, -1, 0, 0};
    int top = 0;
    stack[top++] = k;
    mark[k] = 1;
    while (top) {
        const int here = stack[--top], i = here % v->w, j = here / v->w;
        b.n++;
        b.x += i;
        b.y += j;
        b.left = i < b.left ? i : b.left;
        b.right = i > b.right ? i : b.right;
        b.top = j < b.top ? j : b.top;
        b.bottom = j > b.bottom ? j : b.bottom;
        for (int q = 0; q < 4; q++) {
            const int x = i + (q == 0) - (q == 1), y = j + (q == 2) - (q == 3);
            const int next = y * v->w + x;
            if (x < 0 || y < 0 || x >= v->w || y >= v->h || mark[next] ||
                (above ? (double)v->light[next] < level : (double)v->light[next] > level))
                continue;
            mark[next] = 1;
            stack[top++] = next;
        }
    }
    return b;
}

// The level that splits the samples best (Otsu 1979); `sorted` rises.
static double split(const float *sorted, size_t n)
{
    double all = 0, below = 0, best = -1, level = 0;
    for (size_t k = 0; k < n; k++)
        all += (double)sorted[k];
    for (size_t k = 0; k + 1 < n; k++) {
        below += (double)sorted[k];
        const double a = (double)(k + 1), b = (double)n - a;
        const double gap = below / a - (all - below) / b;
        if (sorted[k] < sorted[k + 1] && a * b * gap * gap > best) {
            best = a * b * gap * gap;
            level = 0.5 * ((double)sorted[k] + (double)sorted[k + 1]);
        }
    }
    return level;
}

// The largest thing that differs from the picture's border.
static bool guess_circle(const struct view *v, struct circle *c, struct err *e)
{
    enum { MOST = 40000 };
    const size_t n = (size_t)v->w * (size_t)v->h;
    const size_t rim = 2 * ((size_t)v->w + (size_t)v->h);
    float *probe = xcalloc(MOST, sizeof *probe), *border = xcalloc(rim, sizeof *border);
    const size_t count = sorted_probe(v->light, n, probe, MOST);
    size_t m = 0;
    for (int i = 0; i < v->w; i++) {
        border[m++] = v->light[i];
        border[m++] = v->light[(size_t)(v->h - 1) * (size_t)v->w + (size_t)i];
    }
    for (int j = 0; j < v->h; j++) {
        border[m++] = v->light[(size_t)j * (size_t)v->w];
        border[m++] = v->light[(size_t)j * (size_t)v->w + (size_t)v->w - 1];
    }
    sort_floats(border, m);
    const double level = split(probe, count * 99 / 100); // the light's mirror image is no level
    const bool above = (double)border[m / 2] < level;
    free(probe);
    free(border);
    char *mark = sample_alloc(n, 1, "picture", e);
    int *stack = mark ? sample_alloc(n, sizeof *stack, "picture", e) : NULL;
    struct blob largest = {0};
    for (size_t k = 0; stack && k < n; k++) {
        const bool is_thing = above ? (double)v->light[k] >= level : (double)v->light[k] <= level;
        if (mark[k] || !is_thing)
            continue;
        const struct blob b = flood(v, (int)k, level, above, mark, stack);
        if (b.n > largest.n)
            largest = b;
    }
    free(mark);
    if (!stack)
        return false;
    free(stack);
    *c = (struct circle){largest.x / largest.n, largest.y / largest.n, sqrt(largest.n / M_PI)};
    const int wide = largest.right - largest.left + 1, high = largest.bottom - largest.top + 1;
    if (largest.n < 200 || wide > 2 * high || high > 2 * wide)
        return err_set(e, ERR_DATA, "no ball is seen: give its place by --ball X,Y,RADIUS");
    return true;
}

// Where the outline is along one direction from the middle: the centre of the steepest change of
// that sign, near `near_px` within `reach_px`. NAN: none.
static double outline_at(const struct view *v, const struct circle *c, double angle, double sign,
                         double near_px, double reach_px)
{
    const double step = 0.25, half = 4, x = cos(angle), y = sin(angle);
    double best = 0, where = NAN;
    for (double s = near_px - reach_px; s <= near_px + reach_px; s += step) {
        const double rise = sign * (at(v, c->x + (s + 1) * x, c->y + (s + 1) * y) -
                                    at(v, c->x + (s - 1) * x, c->y + (s - 1) * y));
        if (rise > best) {
            best = rise;
            where = s;
        }
    }
    double spread = 0;
    for (int round = 0; round < 4 && !isnan(where); round++) {
        double sum = 0, moment = 0, square = 0;
        for (double s = -half; s <= half + 1e-9; s += step) {
            const double t = where + s, d = 0.5;
            const double rise = sign * (at(v, c->x + (t + d) * x, c->y + (t + d) * y) -
                                        at(v, c->x + (t - d) * x, c->y + (t - d) * y));
            const double weight = fmax(0, rise - 0.02 * best);
            sum += weight;
            moment += weight * s;
            square += weight * s * s;
        }
        where = sum > 0 ? where + moment / sum : NAN;
        spread = square / sum - moment / sum * moment / sum;
    }
    // A blur of variance s^2 moves a round edge inwards by s^2 / (2 R). The difference taken above
    // has 1/12 of its own.
    return where + fmax(0, spread - 1. / 12) / (2 * where);
}

// Does the outline go up or down outwards?
static double outline_sign(const struct view *v, const struct circle *c)
{
    double sum = 0;
    for (int k = 0; k < ANGLES; k++) {
        const double a = 2 * M_PI * k / ANGLES, x = cos(a), y = sin(a);
        const double out = at(v, c->x + 1.15 * c->r * x, c->y + 1.15 * c->r * y);
        const double in = at(v, c->x + 0.85 * c->r * x, c->y + 0.85 * c->r * y);
        if (!isnan(out) && !isnan(in))
            sum += out - in;
    }
    return sum < 0 ? -1 : 1;
}

// q of the cone by least squares, without rays that miss by more than three times the median.
static bool fit_cone(const struct view *v, const double (*edge)[2], int n, struct ball *ball,
                     double *cos_half, struct err *e)
{
    const double focal_px = v->lens->camera.focal_px[0];
    double limit = INFINITY, q[3] = {0}, *miss = xcalloc((size_t)n, sizeof *miss);
    bool ok = true;
    for (int round = 0; ok && round < 6; round++) {
        struct normal sums;
        normal_init(&sums, 3);
        for (int k = 0; k < n; k++) {
            const struct vec3 r = lens_ray(v->lens, edge[k][0], edge[k][1]);
            if (round == 0 || miss[k] <= limit)
                normal_add(&sums, 3, (int[]){0, 1, 2}, (double[]){r.x, r.y, r.z}, 1, 1);
        }
        ok = normal_solve(&sums, q, NULL, e);
        normal_finish(&sums);
        const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
        *cos_half = 1 / length;
        if (!(length > 1))
            ok = err_set(e, ERR_DATA, "the outline is not that of a ball");
        double *sorted = xcalloc((size_t)n, sizeof *sorted), sum = 0;
        int used = 0;
        for (int k = 0; ok && k < n; k++) {
            const struct vec3 r = lens_ray(v->lens, edge[k][0], edge[k][1]);
            const double off = r.x * q[0] + r.y * q[1] + r.z * q[2] - 1;
            miss[k] = sorted[k] = fabs(off) / sqrt(length * length - 1) * focal_px;
            if (miss[k] <= limit) {
                sum += miss[k] * miss[k];
                used++;
            }
        }
        ball->rms_px = sqrt(sum / used);
        sort_doubles(sorted, (size_t)n);
        limit = fmax(0.02, 3 * sorted[n / 2]);
        free(sorted);
    }
    free(miss);
    ball->center_m = v3_scale(*cos_half, v3(q[0], q[1], q[2])); // unit for now
    return ok;
}

static bool find_ball(const struct view *v, double radius_m, struct circle c, bool sure,
                      struct ball *ball, struct err *e)
{
    double edge[ANGLES][2], cos_half = 1;
    const double sign = outline_sign(v, &c);
    int n = 0;
    for (int k = 0; k < ANGLES; k++) {
        const double a = 2 * M_PI * k / ANGLES;
        const double s = outline_at(v, &c, a, sign, c.r, (sure ? 0.25 : 0.2) * c.r);
        if (isnan(s))
            continue;
        edge[n][0] = c.x + s * cos(a);
        edge[n++][1] = c.y + s * sin(a);
    }
    if (n < ANGLES / 2)
        return err_set(e, ERR_DATA,
                       "the ball's outline is seen on %d %% of its way only (needs 50)",
                       100 * n / ANGLES);
    if (!fit_cone(v, (const double(*)[2])edge, n, ball, &cos_half, e))
        return false;
    if (ball->rms_px > 0.02 * c.r)
        return err_set(e, ERR_DATA, "the outline misses a ball's by %.1f px", ball->rms_px);
    ball->center_m = v3_scale(radius_m / sqrt(1 - cos_half * cos_half), ball->center_m);
    return true;
}

// The middle of a spot above its floor. A spot whose top is cut off by the sensor keeps its flanks:
// the top of the round Gaussian through them, from a linear fit of the logarithm.
static void spot_middle(const struct view *v, const struct blob *b, double floor, double top,
                        double out[2])
{
    const int left = b->left - 3, high = b->top - 3;
    double sum = 0, moment[2] = {0}, c[4];
    int cut = 0;
    struct normal n;
    struct err ignored;
    normal_init(&n, 4);
    for (int j = high; j <= b->bottom + 3; j++)
        for (int i = left; i <= b->right + 3; i++) {
            if (i < 0 || j < 0 || i >= v->w || j >= v->h)
                continue;
            const double s = (double)v->light[(size_t)j * (size_t)v->w + (size_t)i] - floor;
            const double x = i - left, y = j - high;
            sum += s;
            moment[0] += s * i;
            moment[1] += s * j;
            if (s > 0.98 * (top - floor))
                cut++;
            else if (s > 0.02 * (top - floor))
                normal_add(&n, 4, (int[]){0, 1, 2, 3}, (double[]){1, x, y, x * x + y * y}, log(s),
                           s * s);
        }
    out[0] = moment[0] / sum;
    out[1] = moment[1] / sum;
    if (cut >= 4 && n.count >= 8 && normal_solve(&n, c, NULL, &ignored) && c[3] < 0) {
        out[0] = left - 0.5 * c[1] / c[3];
        out[1] = high - 0.5 * c[2] / c[3];
    }
    normal_finish(&n);
}

// The middle of the brightest spot on the ball.
static bool find_spot(const struct view *v, double radius_m, struct ball *ball, struct err *e)
{
    const double far = v3_norm(ball->center_m), sine = 0.97 * radius_m / far;
    const struct vec3 axis = v3_unit(ball->center_m);
    const size_t n = (size_t)v->w * (size_t)v->h;
    float *inside = sample_alloc(n, sizeof *inside, "picture", e);
    char *mark = inside ? sample_alloc(n, 1, "picture", e) : NULL;
    int *stack = mark ? sample_alloc(n, sizeof *stack, "picture", e) : NULL;
    size_t m = 0;
    int peak = -1;
    double x, y, reach_px;
    lens_project(v->lens, ball->center_m, &x, &y);
    reach_px = 2 * v->lens->camera.focal_px[0] * radius_m / far;
    for (int j = (int)fmax(0, y - reach_px); stack && j < fmin(v->h, y + reach_px); j++)
        for (int i = (int)fmax(0, x - reach_px); i < fmin(v->w, x + reach_px); i++) {
            if (v3_norm(v3_cross(lens_ray(v->lens, i, j), axis)) > sine)
                continue;
            const int k = j * v->w + i;
            inside[m++] = v->light[k];
            if (peak < 0 || v->light[k] > v->light[peak])
                peak = k;
        }
    bool ok = stack && m > 0;
    if (ok) {
        sort_floats(inside, m);
        const double base = (double)inside[m / 2], top = (double)v->light[peak];
        const double spread = (double)(inside[m * 9 / 10] - inside[m / 10]);
        const struct blob b = flood(v, peak, base + 0.2 * (top - base), true, mark, stack);
        if (!(top > base + 3 * spread) || top <= base || (size_t)b.n > m / 4)
            ok = err_set(e, ERR_DATA, "no mirror image of the light stands out on the ball");
        if (ok)
            spot_middle(v, &b, base, top, ball->spot_px);
    } else if (stack) {
        err_set(e, ERR_DATA, "the ball is not in the picture");
    }
    free(stack);
    free(mark);
    free(inside);
    return ok;
}

bool light_ball(const struct lens *l, double radius_m, const double guess[3], const float *light,
                int w, int h, struct ball *ball, struct line *line, struct err *e)
{
    const struct view v = {l, light, w, h};
    struct circle c = {0};
    struct ball b;
    if (guess)
        c = (struct circle){guess[0], guess[1], guess[2]};
    if ((!guess && !guess_circle(&v, &c, e)) || !find_ball(&v, radius_m, c, guess != NULL, &b, e) ||
        !find_spot(&v, radius_m, &b, e))
        return false;
    const struct vec3 ray = lens_ray(l, b.spot_px[0], b.spot_px[1]);
    const double along = v3_dot(ray, b.center_m);
    const double root2 = along * along - v3_dot(b.center_m, b.center_m) + radius_m * radius_m;
    const struct vec3 x = v3_scale(along - sqrt(fmax(0, root2)), ray);
    const struct vec3 n = v3_unit(v3_sub(x, b.center_m));
    *line = (struct line){x, v3_sub(ray, v3_scale(2 * v3_dot(ray, n), n))};
    *ball = b;
    return true;
}

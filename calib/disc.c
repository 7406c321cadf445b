// disc.c - finding the disc of a bokeh photograph, and its even light.
#define _GNU_SOURCE // M_PI
#include "calib/disc.h"
#include "calib/normal.h"
#include "calib/poly.h"
#include "core/mem.h"
#include "core/sort.h"
#include <math.h>
#include <stdlib.h>

enum { RAYS = 720, BLOCKS = 160 }; // blocks across the picture for the first look

// The picture in block means: coarse enough that lines inside the disc blur away.
struct coarse {
    int w, h, side; // blocks; pixels a side
    float *v;
    double dark, bright; // 5th and 95th percentiles
};

static void coarse_make(struct coarse *c, const float *px, int w, int h)
{
    c->side = (w > h ? w : h) / BLOCKS + 1;
    c->w = w / c->side;
    c->h = h / c->side;
    const size_t n = (size_t)c->w * (size_t)c->h;
    c->v = xcalloc(n, sizeof *c->v);
    for (int j = 0; j < c->h * c->side; j++)
        for (int i = 0; i < c->w * c->side; i++)
            c->v[j / c->side * c->w + i / c->side] +=
                px[(size_t)j * (size_t)w + (size_t)i] / (float)(c->side * c->side);
    float *sorted = xcalloc(n, sizeof *sorted);
    for (size_t k = 0; k < n; k++)
        sorted[k] = c->v[k];
    sort_floats(sorted, n);
    c->dark = (double)sorted[n / 20];
    c->bright = (double)sorted[n - 1 - n / 20];
    if (c->bright - c->dark < 0.2 * ((double)sorted[n - 1] - c->dark)) // a small disc
        c->bright = 0.8 * (double)sorted[n - 1] + 0.2 * c->dark;
    free(sorted);
}

struct blob {
    long area; // blocks
    double x, y;
};

// Marks the bright blocks that hang together with (i, j), also across gaps of two blocks.
static struct blob fill(const struct coarse *c, bool *seen, int *stack, int i, int j, double level)
{
    struct blob b = {0};
    int n = 0;
    stack[n++] = j * c->w + i;
    seen[j * c->w + i] = true;
    while (n) {
        const int at = stack[--n], x0 = at % c->w, y0 = at / c->w;
        b.area++;
        b.x += x0;
        b.y += y0;
        for (int y = y0 - 2; y <= y0 + 2; y++)
            for (int x = x0 - 2; x <= x0 + 2; x++)
                if (x >= 0 && y >= 0 && x < c->w && y < c->h && !seen[y * c->w + x] &&
                    (double)c->v[y * c->w + x] > level) {
                    seen[y * c->w + x] = true;
                    stack[n++] = y * c->w + x;
                }
    }
    b.x /= (double)b.area;
    b.y /= (double)b.area;
    return b;
}

static bool one_blob(const struct coarse *c, struct blob *out, struct err *e)
{
    const size_t n = (size_t)c->w * (size_t)c->h;
    bool *seen = xcalloc(n, sizeof *seen);
    int *stack = xcalloc(n, sizeof *stack);
    const double level = c->dark + 0.35 * (c->bright - c->dark);
    struct blob best = {0}, second = {0};
    for (int j = 0; j < c->h; j++)
        for (int i = 0; i < c->w; i++)
            if (!seen[j * c->w + i] && (double)c->v[j * c->w + i] > level) {
                const struct blob b = fill(c, seen, stack, i, j, level);
                second = b.area > best.area ? best : b.area > second.area ? b : second;
                best = b.area > best.area ? b : best;
            }
    free(seen);
    free(stack);
    if (!(c->bright - c->dark > 0.3 * c->bright))
        return err_set(
            e, ERR_DATA,
            "no disc: the picture's bright parts (%.3g) stand out of its dark ones (%.3g) "
            "too little",
            c->bright, c->dark);
    if (best.area < 12)
        return err_set(e, ERR_DATA, "no disc: nothing bright is larger than %d pixels",
                       4 * c->side);
    if (16 * second.area > best.area)
        return err_set(e, ERR_DATA,
                       "two discs: bright areas of %.3g and %.3g pixels at (%.0f, %.0f) and "
                       "(%.0f, %.0f)",
                       (double)best.area * c->side * c->side,
                       (double)second.area * c->side * c->side, best.x * c->side, best.y * c->side,
                       second.x * c->side, second.y * c->side);
    *out = best;
    return true;
}

static double sample(const float *px, int w, double x, double y)
{
    const int i = (int)x, j = (int)y;
    const double a = x - i, b = y - j;
    const float *p = px + (size_t)j * (size_t)w + (size_t)i;
    return (1 - b) * ((1 - a) * (double)p[0] + a * (double)p[1]) +
           b * ((1 - a) * (double)p[w] + a * (double)p[w + 1]);
}

static bool inside(double x, double y, int w, int h)
{
    return x >= 0 && y >= 0 && x < w - 1 && y < h - 1;
}

// The outermost place on a ray where the level is crossed; -1 when it is bright to the frame, 0
// when it is never bright.
static double rim(const float *px, int w, int h, double cx, double cy, double angle, double level,
                  double radius_max)
{
    const double dx = cos(angle), dy = -sin(angle);
    double before = 0, found = 0;
    bool at_frame = false;
    for (double r = radius_max; r > 1; r -= 0.5) {
        const double x = cx + r * dx, y = cy + r * dy;
        if (!inside(x, y, w, h))
            continue;
        const double v = sample(px, w, x, y);
        if (v >= level) {
            at_frame = found == 0 && before == 0;
            found = before > 0 && before < level ? r + 0.5 * (v - level) / (v - before) : r;
            break;
        }
        before = v > 0 ? v : 1e-30;
    }
    return at_frame ? -1 : found;
}

// Circle through the rim's points, points off it weighing less (Tukey); Gauss-Newton.
static bool fit_circle(struct disc *d, const double *r, double cx, double cy)
{
    double scale = 0.1 * d->radius_px;
    for (int round = 0; round < 12; round++) {
        struct normal s;
        struct err ignored;
        double step[3], sum = 0, weights = 0;
        normal_init(&s, 3);
        for (int k = 0; k < RAYS; k++) {
            if (!(r[k] > 0))
                continue;
            const double a = 2 * M_PI * k / RAYS, x = cx + r[k] * cos(a) - d->cx_px,
                         y = cy - r[k] * sin(a) - d->cy_px, rho = hypot(x, y);
            const double off = rho - d->radius_px, q = off / (4 * scale);
            const double w = fabs(q) < 1 ? (1 - q * q) * (1 - q * q) : 0;
            normal_add(&s, 3, (int[]){0, 1, 2}, (double[]){x / rho, y / rho, 1}, off, w);
            sum += w * off * off;
            weights += w;
        }
        const bool ok = normal_solve(&s, step, NULL, &ignored);
        normal_finish(&s);
        if (!ok)
            return false;
        d->cx_px += step[0];
        d->cy_px += step[1];
        d->radius_px += step[2];
        d->residual_px = sqrt(sum / weights);
        scale = fmax(d->residual_px, 0.25);
    }
    return true;
}

static bool check(const struct disc *d, const float *px, int w, int h, double dark,
                  double inside_sum, struct err *e)
{
    float top = 0;
    long at_top = 0, n = 0;
    double out = 0;
    for (int j = 0; j < h; j++)
        for (int i = 0; i < w; i++) {
            const float v = px[(size_t)j * (size_t)w + (size_t)i];
            const double rho = hypot(i - d->cx_px, j - d->cy_px);
            if (rho > 1.05 * d->radius_px)
                out += fmax(0, (double)v - dark);
            if (rho > d->radius_px)
                continue;
            n++;
            at_top = v > top ? 1 : at_top + (v == top);
            top = v > top ? v : top;
        }
    if (at_top > n / 100 && at_top > 100)
        return err_set(e, ERR_DATA, "the disc is saturated: %.1f %% of it is at the largest sample",
                       100.0 * (double)at_top / (double)n);
    if (out > 0.5 * inside_sum)
        return err_set(e, ERR_DATA, "no disc: as much light outside it (%.0f %%) as inside",
                       100 * out / inside_sum);
    return true;
}

bool disc_find(struct disc *out, const float *px, int w, int h, struct err *e)
{
    if (w < 64 || h < 64)
        return err_set(e, ERR_DATA, "no disc: the picture is only %d x %d pixels", w, h);
    struct coarse c;
    struct blob b = {0};
    coarse_make(&c, px, w, h);
    const bool found = one_blob(&c, &b, e);
    const double dark = c.dark, level = dark + 0.4 * (c.bright - dark);
    const double cx = (b.x + 0.5) * c.side, cy = (b.y + 0.5) * c.side;
    struct disc d = {cx, cy, sqrt((double)b.area / M_PI) * c.side, 0};
    const double all = (double)b.area * c.side * c.side * (c.bright - dark);
    free(c.v);
    if (!found)
        return false;
    double r[RAYS];
    int cut = 0;
    for (int k = 0; k < RAYS; k++) {
        r[k] = rim(px, w, h, cx, cy, 2 * M_PI * k / RAYS, level, 2 * d.radius_px + 8);
        cut += r[k] < 0;
    }
    if (cut > RAYS / 50)
        return err_set(e, ERR_DATA, "%s is cut by the frame over %.0f %% of its rim",
                       cut > RAYS / 2 ? "no disc: what is bright" : "the disc", 100.0 * cut / RAYS);
    if (!fit_circle(&d, r, cx, cy) || !(d.radius_px > 8))
        return err_set(e, ERR_DATA, "no disc: the bright area has no round rim");
    if (d.residual_px > 0.03 * d.radius_px)
        return err_set(
            e, ERR_DATA,
            "no single disc: the rim is off a circle of %.0f px by %.1f px rms (two discs "
            "that overlap, or another shape)",
            d.radius_px, d.residual_px);
    if (d.cx_px - d.radius_px < 0 || d.cy_px - d.radius_px < 0 || d.cx_px + d.radius_px > w - 1 ||
        d.cy_px + d.radius_px > h - 1)
        return err_set(e, ERR_DATA,
                       "the disc (centre %.0f, %.0f, radius %.0f px) is cut by the frame of "
                       "%d x %d",
                       d.cx_px, d.cy_px, d.radius_px, w, h);
    if (!check(&d, px, w, h, dark, all, e))
        return false;
    *out = d;
    return true;
}

bool disc_light_fit(struct disc_light *out, const struct disc *d, const float *px,
                    const float *pattern, int w, int h, struct err *e)
{
    struct disc_light l = {.disc = *d};
    struct normal s;
    int at[POLY_TERMS];
    double m[POLY_TERMS], all[POLY_TERMS] = {0}, sum = 0;
    long n = 0;
    for (int k = 0; k < POLY_TERMS; k++)
        at[k] = k;
    normal_init(&s, POLY_TERMS);
    for (int j = 0; j < h; j++)
        for (int i = 0; i < w; i++) {
            const double x = (i - d->cx_px) / d->radius_px, y = (j - d->cy_px) / d->radius_px;
            if (x * x + y * y > 0.97 * 0.97)
                continue;
            const size_t here = (size_t)j * (size_t)w + (size_t)i;
            poly_terms(x, y, m);
            for (int k = 0; k < POLY_TERMS; k++) {
                all[k] += m[k];
                m[k] *= pattern ? (double)pattern[here] : 1;
            }
            normal_add(&s, POLY_TERMS, at, m, (double)px[here], 1);
            n++;
        }
    const bool ok = n > 0 && normal_solve(&s, l.term, NULL, e);
    normal_finish(&s);
    for (int k = 0; k < POLY_TERMS; k++)
        sum += l.term[k] * all[k];
    if (!ok || !(sum > 0))
        return err_set(e, ERR_DATA, "the disc's light cannot be fitted: it is dark");
    l.level = sum / (double)n;
    l.mean = 1;
    for (int k = 0; k < POLY_TERMS; k++)
        l.term[k] /= l.level;
    *out = l;
    return true;
}

double disc_light_at(const struct disc_light *l, double i, double j)
{
    const double light = poly_at(l->term, (i - l->disc.cx_px) / l->disc.radius_px,
                                 (j - l->disc.cy_px) / l->disc.radius_px);
    return l->level * fmax(light, 0.02); // a fit's wiggle must not divide by nothing
}

void disc_light_relate(struct disc_light *l, double level)
{
    l->mean *= l->level / level;
    l->level = level;
}

void disc_flatten(const struct disc_light *l, const float *px, int w, int h, float *out)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < h; j++)
        for (int i = 0; i < w; i++) {
            const size_t k = (size_t)j * (size_t)w + (size_t)i;
            const bool in = hypot(i - l->disc.cx_px, j - l->disc.cy_px) <= l->disc.radius_px;
            out[k] = in ? (float)((double)px[k] / disc_light_at(l, i, j)) : (float)l->mean;
        }
}

// factor_lines.c - the main directions of a pattern, and the pattern along them (R17 4.2).
#define _GNU_SOURCE
#include "process/factor_lines.h"
#include "core/mem.h"
#include "core/sort.h"
#include "process/cv_warp.h"
#include "process/table_cubic.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ANGLES = 720 };

static double green_on_line(const struct table *t, double angle)
{
    double sum = 0, out[3];
    for (int k = 1; k < t->n; k++) {
        const double r = t->range * k / (t->n - 1), u = r * cos(angle), v = r * sin(angle);
        table_eval(t, u, v, 0, 0, out);
        sum += out[1];
        table_eval(t, -u, -v, 0, 0, out);
        sum += out[1];
    }
    return sum;
}

// The top of the parabola through an angle and its neighbours.
static double refine(const double *green, int k)
{
    const double l = green[(k + ANGLES - 1) % ANGLES], c = green[k], r = green[(k + 1) % ANGLES];
    const double bend = l - 2 * c + r, shift = bend < 0 ? .5 * (l - r) / bend : 0;
    return (k + fmax(-.5, fmin(.5, shift))) * M_PI / ANGLES;
}

void factor_directions(const struct table *t, double apart, double angle[2])
{
    double green[ANGLES], best = -INFINITY;
    int at[2] = {0, ANGLES / 2};
#pragma omp parallel for
    for (int k = 0; k < ANGLES; k++)
        green[k] = green_on_line(t, k * M_PI / ANGLES);
    const int least = (int)ceil(apart / M_PI * ANGLES);
    for (int k = 0; k < ANGLES; k++)
        for (int m = k + least; m < ANGLES && m - k <= ANGLES - least; m++)
            if (green[k] + green[m] > best) {
                best = green[k] + green[m];
                at[0] = green[k] >= green[m] ? k : m;
                at[1] = at[0] == k ? m : k;
            }
    for (int k = 0; k < 2; k++)
        angle[k] = refine(green, at[k]);
}

static bool uniform_copy(const struct table *t, struct table *out, struct err *e)
{
    if (!table_init(out, t->n, t->range, 1, 1, e))
        return false;
    out->is_rgb = true;
    const size_t n = (size_t)t->n;
    if (t->power == 1) {
        memcpy(out->tab, t->tab, n * n * 3 * sizeof *t->tab);
        return true;
    }
#pragma omp parallel for
    for (int j = 0; j < t->n; j++)
        for (int i = 0; i < t->n; i++) {
            double rgb[3];
            table_cubic(t, table_node(out, i), table_node(out, j), 0, rgb);
            for (int c = 0; c < 3; c++)
                out->tab[((size_t)j * n + (size_t)i) * 3 + (size_t)c] = (float)rgb[c];
        }
    return true;
}

// Pixel of `to` for each pixel of `from`, both uniform, where `from` runs along the axes `m`.
static bool warp(const struct table *in, const struct table *out, const double m[2][2],
                 struct err *e)
{
    const double half_in = .5 * (in->n - 1), half_out = .5 * (out->n - 1);
    const double scale = out->range / half_out * half_in / in->range, reach = half_out;
    double from[3][2] = {{half_out, half_out}}, to[3][2] = {{half_in, half_in}}, map[2][3];
    for (int k = 0; k < 2; k++)
        for (int x = 0; x < 2; x++) {
            from[k + 1][x] = half_out + (k == x ? reach : 0);
            to[k + 1][x] = half_in + reach * scale * m[k][x];
        }
    return cv_affine(from, to, map, e) &&
           cv_warp(in->tab, in->n, in->n, map, out->tab, out->n, out->n, e);
}

static void invert(const double m[2][2], double out[2][2])
{
    const double det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    out[0][0] = m[1][1] / det;
    out[0][1] = -m[0][1] / det;
    out[1][0] = -m[1][0] / det;
    out[1][1] = m[0][0] / det;
}

static double lobe_half_width(const struct table *t)
{
    double peak[3], out[3];
    table_eval(t, 0, 0, 0, 0, peak);
    for (int k = 1; k < t->n / 16; k++) {
        const double r = 2 * t->range * k / (t->n - 1);
        double sum = 0;
        for (int a = 0; a < 32; a++) {
            table_eval(t, r * cos(a * M_PI / 16), r * sin(a * M_PI / 16), 0, 0, out);
            sum += out[1] / 32;
        }
        if (sum < .5 * peak[1])
            return r;
    }
    return t->range / 8;
}

bool aligned_init(struct aligned *al, const struct table *t, const double angle[2], double range,
                  struct err *e)
{
    struct table uniform = {0};
    double inverse[2][2];
    *al = (struct aligned){0};
    for (int k = 0; k < 2; k++) {
        al->axis[k][0] = cos(angle[k]);
        al->axis[k][1] = sin(angle[k]);
    }
    invert(al->axis, inverse);
    const double reach =
        fmax(fabs(inverse[0][0]) + fabs(inverse[1][0]), fabs(inverse[0][1]) + fabs(inverse[1][1]));
    if (range <= 0)
        range = fmin(2, t->range * reach);
    const int n = 1 + 2 * (int)ceil(.5 * (t->n - 1) * range / t->range - 1e-9);
    const bool ok = uniform_copy(t, &uniform, e) && table_init(&al->t, n, range, 1, 1, e) &&
                    warp(&uniform, &al->t, al->axis, e);
    al->t.is_rgb = true;
    al->half_width = lobe_half_width(t);
    table_finish(&uniform);
    if (!ok)
        aligned_finish(al);
    return ok;
}

void aligned_finish(struct aligned *al)
{
    table_finish(&al->t);
}

bool aligned_back(const struct aligned *al, const struct table *t, struct table *out, struct err *e)
{
    double inverse[2][2];
    struct table uniform = {0};
    invert(al->axis, inverse);
    if (!table_init(&uniform, t->n, t->range, 1, 1, e))
        return false;
    if (!warp(&al->t, &uniform, inverse, e)) {
        table_finish(&uniform);
        return false;
    }
    if (t->power == 1) {
        *out = uniform;
        return true;
    }
    const bool ok = table_init(out, t->n, t->range, t->power, 1, e);
    for (int j = 0; ok && j < t->n; j++)
        for (int i = 0; i < t->n; i++) {
            double rgb[3];
            table_cubic(&uniform, table_node(t, i), table_node(t, j), 0, rgb);
            for (int c = 0; c < 3; c++)
                out->tab[((size_t)j * (size_t)t->n + (size_t)i) * 3 + (size_t)c] = (float)rgb[c];
        }
    table_finish(&uniform);
    return ok;
}

// Whether node j of one axis is near the line of the other axis.
static bool on_line(const struct aligned *al, int j)
{
    const double sine = al->axis[0][0] * al->axis[1][1] - al->axis[0][1] * al->axis[1][0];
    return fabs(table_node(&al->t, j) * sine) <= 3 * al->half_width;
}

enum factor_kind aligned_kind(const struct aligned *al)
{
    const struct table *t = &al->t;
    const size_t nodes = (size_t)t->n * (size_t)t->n;
    float *sum = xcalloc(nodes, sizeof *sum), *sorted = xcalloc(nodes, sizeof *sorted);
    for (size_t k = 0; k < nodes; k++)
        sorted[k] = sum[k] = t->tab[3 * k] + t->tab[3 * k + 1] + t->tab[3 * k + 2];
    sort_floats(sorted, nodes);
    const double floor_ = (double)sorted[nodes / 2];
    double off = 0, on[2] = {0};
    for (int j = 0; j < t->n; j++)
        for (int i = 0; i < t->n; i++) {
            const double x = fmax(0, (double)sum[j * t->n + i] - floor_);
            const bool on_a = on_line(al, j), on_b = on_line(al, i);
            if (on_a != on_b)
                on[on_b] += x;
            else if (!on_a)
                off += x;
        }
    free(sum);
    free(sorted);
    const double all = off + on[0] + on[1];
    if (!(all > 0) || off > .1 * all)
        return FACTOR_COMPOSITION;
    return fmin(on[0], on[1]) < .1 * all ? FACTOR_LINE : FACTOR_SUM;
}

// A line as a filter along it and a profile across it, whose sum is 1.
struct line {
    struct aligned al; // along the line and at right angles to it
    double *across;    // [n]
};

static void line_filter(struct line *l, bool with_lobe, float *f)
{
    const struct table *t = &l->al.t;
    const int n = t->n;
    const double step = 2 * t->range / (n - 1);
    double all = 0;
    memset(f, 0, (size_t)n * 3 * sizeof *f);
    for (int j = 0; j < n; j++) {
        if (!on_line(&l->al, j))
            continue;
        for (int i = 0; i < n; i++) {
            const float *px = t->tab + 3 * ((size_t)j * (size_t)n + (size_t)i);
            if (on_line(&l->al, i) && !with_lobe)
                continue;
            for (int c = 0; c < 3; c++) {
                f[3 * i + c] += (float)(step * (double)px[c]);
                l->across[j] += fmax(0, (double)px[c]);
            }
        }
        all += l->across[j];
    }
    for (int j = 0; j < n && all > 0; j++)
        l->across[j] /= all * step;
}

// Linear between the n samples; x in 0..n-1, the last one by rounding too.
static double between(const double *v, int n, double x)
{
    const int i = x < n - 2 ? (int)x : n - 2;
    return v[i] + (x - i) * (v[i + 1] - v[i]);
}

static double betweenf(const float *v, int n, double x, int c)
{
    const int i = x < n - 2 ? (int)x : n - 2;
    return (double)v[3 * i + c] + (x - i) * (double)(v[3 * i + 3 + c] - v[3 * i + c]);
}

static void line_error(const struct factors *f, const struct line *line, const struct table *t,
                       double error[4])
{
    double wrong[4] = {0}, all[4] = {0};
    for (int j = 0; j < t->n; j++)
        for (int i = 0; i < t->n; i++) {
            const double u = table_node(t, i), v = table_node(t, j);
            double sum[3] = {0};
            for (int k = 0; k < 2 && f->f[k]; k++) {
                const double(*axis)[2] = line[k].al.axis;
                const double a = u * axis[0][0] + v * axis[0][1];
                const double b = u * axis[1][0] + v * axis[1][1];
                if (fmax(fabs(a), fabs(b)) >= f->range)
                    continue;
                const double scale = .5 * (f->n - 1) / f->range, mid = .5 * (f->n - 1);
                const double p = between(line[k].across, f->n, mid + scale * b);
                for (int c = 0; c < 3; c++)
                    sum[c] += p * betweenf(f->f[k], f->n, mid + scale * a, c);
            }
            for (int c = 0; c < 3; c++) {
                const double s = (double)t->tab[(j * t->n + i) * 3 + c];
                wrong[c] += (s - sum[c]) * (s - sum[c]);
                all[c] += s * s;
            }
        }
    for (int c = 0; c < 3; c++) {
        wrong[3] += wrong[c];
        all[3] += all[c];
    }
    for (int c = 0; c < 4; c++)
        error[c] = all[c] > 0 ? sqrt(wrong[c] / all[c]) : 0;
}

bool factor_lines(struct factors *f, const struct table *t, const double angle[2], struct err *e)
{
    struct line line[2] = {0};
    const int lines = f->kind == FACTOR_SUM ? 2 : 1;
    bool ok = true;
    f->rank = 1;
    f->error = xcalloc(4, sizeof *f->error);
    for (int k = 0; k < lines && ok; k++) {
        const double axes[2] = {angle[k], angle[k] + M_PI / 2};
        const struct table *at = &line[k].al.t;
        ok = aligned_init(&line[k].al, t, axes, fmin(2, M_SQRT2 * t->range), e);
        if (!ok)
            break;
        f->n = at->n;
        f->range = at->range;
        f->power = 1;
        memcpy(f->axis[k], line[k].al.axis[0], sizeof f->axis[k]);
        if (lines == 1)
            memcpy(f->axis[1], line[0].al.axis[1], sizeof f->axis[1]);
        line[k].across = xcalloc((size_t)f->n, sizeof *line[k].across);
        f->f[k] = sample_alloc((size_t)f->n * 3, sizeof **f->f, "factors", e);
        ok = f->f[k] != NULL;
        if (ok)
            line_filter(&line[k], k == 0, f->f[k]);
    }
    if (ok)
        line_error(f, line, t, f->error);
    for (int k = 0; k < 2; k++) {
        aligned_finish(&line[k].al);
        free(line[k].across);
    }
    return ok;
}

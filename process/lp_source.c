// lp_source.c - reads a picture along rows and columns, where a ring's samples lie.
#define _GNU_SOURCE
#include "process/lp_source.h"
#include "core/mem.h"
#include "process/bspline.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static int tiles(int n)
{
    return (n + LP_TILE - 1) / LP_TILE;
}

// A tile is live when it or a neighbour holds anything but zeros: further off, what a spline rings
// is below single precision.
static uint8_t *find_live(const float *px, int w, int h)
{
    const int nx = tiles(w), ny = tiles(h);
    uint8_t *any = xcalloc((size_t)nx * (size_t)ny, 1), *live = xcalloc((size_t)nx * (size_t)ny, 1);
#pragma omp parallel for
    for (int ty = 0; ty < ny; ty++)
        for (int j = ty * LP_TILE; j < h && j < (ty + 1) * LP_TILE; j++)
            for (int i = 0; i < w; i++)
                any[ty * nx + i / LP_TILE] |= px[(size_t)j * (size_t)w + (size_t)i] != 0;
    for (int ty = 0; ty < ny; ty++)
        for (int tx = 0; tx < nx; tx++)
            for (int y = ty > 0 ? ty - 1 : 0; y <= ty + 1 && y < ny; y++)
                for (int x = tx > 0 ? tx - 1 : 0; x <= tx + 1 && x < nx; x++)
                    live[ty * nx + tx] |= any[y * nx + x];
    free(any);
    return live;
}

// to[w][h] = the transpose of from[h][w], in squares that fit the cache.
static void transpose(const float *from, int w, int h, float *to)
{
    enum { SIDE = 32 };
#pragma omp parallel for
    for (int i0 = 0; i0 < w; i0 += SIDE)
        for (int j0 = 0; j0 < h; j0 += SIDE)
            for (int i = i0; i < i0 + SIDE && i < w; i++)
                for (int j = j0; j < j0 + SIDE && j < h; j++)
                    to[(size_t)i * (size_t)h + (size_t)j] = from[(size_t)j * (size_t)w + (size_t)i];
}

bool lp_source_init(struct lp_source *s, const struct lp_picture *p, struct err *e)
{
    const size_t count = (size_t)p->w * (size_t)p->h;
    struct lp_source got = {.coef = sample_alloc(count, sizeof(float), "pattern", e)};
    got.turned = got.coef ? sample_alloc(count, sizeof(float), "pattern", e) : NULL;
    if (!got.turned) {
        free(got.coef);
        return false;
    }
    memcpy(got.coef, p->px, count * sizeof(float));
    got.live = find_live(p->px, p->w, p->h);
    const int nx = tiles(p->w), ny = tiles(p->h);
    got.live_turned = xcalloc((size_t)nx * (size_t)ny, 1);
    for (int y = 0; y < ny; y++)
        for (int x = 0; x < nx; x++)
            got.live_turned[x * ny + y] = got.live[y * nx + x];
    bspline_fit_image(got.coef, p->w, p->h, BSPLINE_QUINTIC);
    transpose(got.coef, p->w, p->h, got.turned);
    got.rows = (struct lp_view){got.coef, p->h, p->w, p->cy, p->cx, got.live};
    got.columns = (struct lp_view){got.turned, p->w, p->h, p->cx, p->cy, got.live_turned};
    got.reach[0] = p->w - p->cx;
    got.reach[1] = p->h - p->cy;
    got.reach[2] = p->cx + 1;
    got.reach[3] = p->cy + 1;
    *s = got;
    return true;
}

void lp_source_finish(struct lp_source *s)
{
    free(s->coef);
    free(s->turned);
    free(s->live);
    free(s->live_turned);
    *s = (struct lp_source){0};
}

// Where x lies in 0..n-1, and its weight: 1 inside, falling to 0 over one pixel outside.
static inline double into_frame(double x, int n, double *weight)
{
    const double inside = x < 0 ? 0 : x > n - 1 ? n - 1 : x;
    const double outside = fabs(x - inside);
    *weight = outside < 1 ? 1 - outside : 0;
    return inside;
}

static inline int cell(double x, int n) // x in 0..n-1
{
    const int i = (int)x;
    return i < n - 2 ? i : n - 2;
}

double lp_source_at(const struct lp_source *s, double x, double y)
{
    const struct lp_view *v = &s->rows;
    double weight_x, weight_y, sum = 0;
    x = into_frame(v->c_at + x, v->width, &weight_x);
    y = into_frame(v->c_line + y, v->lines, &weight_y);
    if (weight_x * weight_y == 0)
        return 0;
    const int i = cell(x, v->width), j = cell(y, v->lines);
    float wx[6], wy[6];
    bspline_weights_5((float)(x - i), wx);
    bspline_weights_5((float)(y - j), wy);
    for (int b = 0; b < 6; b++) {
        const float *row = v->coef + (size_t)bspline_mirror(j - 2 + b, v->lines) * (size_t)v->width;
        double line = 0;
        for (int a = 0; a < 6; a++)
            line += (double)wx[a] * row[bspline_mirror(i - 2 + a, v->width)];
        sum += wy[b] * line;
    }
    return sum * weight_x * weight_y;
}

size_t lp_source_scratch(const struct lp_source *s)
{
    const int longest = s->rows.width > s->rows.lines ? s->rows.width : s->rows.lines;
    return (size_t)longest + 2 * LP_EDGE;
}

// line[from..to] = the six rows of coefficients around y, blended.
__attribute__((target_clones("avx512f", "avx2", "default"))) static void
blend_lines(const struct lp_view *v, double y, float scale, int from, int to, float *line)
{
    const int j = cell(y, v->lines);
    float w[6];
    bspline_weights_5((float)(y - j), w);
    const float *r[6];
    for (int b = 0; b < 6; b++) {
        w[b] *= scale;
        r[b] = v->coef + (size_t)bspline_mirror(j - 2 + b, v->lines) * (size_t)v->width;
    }
    for (int i = from; i <= to; i++)
        line[i] = w[0] * r[0][i] + w[1] * r[1][i] + w[2] * r[2][i] + w[3] * r[3][i] +
                  w[4] * r[4][i] + w[5] * r[5][i];
}

// row[q] = the line at `at` + q step, 16 samples.
__attribute__((target_clones("avx512f", "avx2", "default"))) static void
read_line(const float *line, int n, double at, double step, float *row)
{
    for (int q = 0; q < 16; q++) {
        const double x = at + q * step;
        const double inside = x < 0 ? 0 : x > n - 1 ? n - 1 : x;
        const double outside = fabs(x - inside);
        const int whole = (int)inside, i = whole < n - 2 ? whole : n - 2;
        float w[6];
        bspline_weights_5((float)(inside - i), w);
        const float *c = line + i - 2;
        const float sum =
            w[0] * c[0] + w[1] * c[1] + w[2] * c[2] + w[3] * c[3] + w[4] * c[4] + w[5] * c[5];
        row[q] = outside < 1 ? sum * (float)(1 - outside) : 0;
    }
}

static bool is_live(const struct lp_view *v, double y, double from, double to)
{
    const int nx = tiles(v->width);
    const uint8_t *row = v->live + (int)y / LP_TILE * nx;
    const int last = to > v->width - 1 ? nx - 1 : (int)to / LP_TILE;
    for (int t = from > 0 ? (int)from / LP_TILE : 0; t <= last; t++)
        if (row[t])
            return true;
    return false;
}

void lp_source_ring(const struct lp_source *s, int sector, double a, double t0, double dt, int rays,
                    float *line, float *row, uint8_t *live)
{
    const struct lp_view *v = sector % 2 ? &s->rows : &s->columns;
    double weight;
    const double y = into_frame(v->c_line + (sector < 2 ? a : -a), v->lines, &weight);
    const double first = v->c_at + t0 * a, step = dt * a, last = first + step * (rays - 1);
    memset(row, 0, (size_t)rays * sizeof *row);
    memset(live, 0, (size_t)rays / 16);
    if (weight == 0 || last <= -1 || first >= v->width || !is_live(v, y, first, last))
        return;
    const int n = v->width;
    const int from = first - 4 > 0 ? (int)first - 4 : 0;
    const int to = last + 4 < n - 1 ? (int)last + 4 : n - 1;
    line += LP_EDGE;
    blend_lines(v, y, (float)weight, from, to > LP_EDGE ? to : LP_EDGE, line);
    for (int k = 1; k <= LP_EDGE; k++) {
        line[-k] = line[k];
        line[n - 1 + k] = line[n - 1 - k];
    }
    for (int k = 0; k < rays; k += 16) {
        const double at = first + k * step, end = at + 15 * step;
        if (end <= -1 || at >= n || !is_live(v, y, at, end))
            continue;
        live[k / 16] = 1;
        read_line(line, n, at, step, row + k);
    }
}

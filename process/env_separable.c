// env_separable.c - a lat-long map blurred by the factors of a diffraction table.
//
// R17's pass finds the light direction of every tap at every pixel. Around a pole the sphere looks
// the same at each column, so a tap's row and its shift in columns are found once per row, and a
// pass is sums of shifted rows.
#define _GNU_SOURCE
#include "process/env_separable.h"
#include "core/mem.h"
#include "process/table_cubic.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool env_taps(struct env_taps *t, const struct factors *f, int filter, int rank, int taps,
              struct err *e)
{
    enum { FINE = 16 }; // samples of a filter averaged to a tap
    const struct table nodes = {.n = f->n, .range = f->range, .power = f->power};
    const float *from = f->f[filter] + (size_t)rank * (size_t)f->n * 3;
    *t = (struct env_taps){.h = sample_alloc((size_t)taps, sizeof *t->h, "filter", e),
                           .rgb = sample_alloc((size_t)taps * 3, sizeof *t->rgb, "filter", e)};
    if (!t->h || !t->rgb) {
        env_taps_finish(t);
        return false;
    }
    const double reach = fmin(f->range, 1), step = 2 * reach / taps;
    for (int k = 0; k < taps; k++) {
        const double h = -reach + (k + .5) * step, c = sqrt(1 - h * h);
        double rgb[3] = {0}, w[STENCIL];
        for (int m = 0; m < FINE; m++) {
            int first;
            if (!table_stencil(&nodes, h + step * ((m + .5) / FINE - .5), &first, w))
                continue;
            for (int q = 0; q < STENCIL && first + q < f->n; q++)
                for (int x = 0; x < 3; x++)
                    rgb[x] += w[q] / FINE * (double)from[3 * (first + q) + x];
        }
        if (rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0)
            continue;
        t->h[t->n] = (float)h;
        for (int x = 0; x < 3; x++)
            t->rgb[3 * t->n + x] = (float)(rgb[x] * step * (1 + c) * (1 + c) / (4 * c));
        t->n++;
    }
    return true;
}

void env_taps_finish(struct env_taps *t)
{
    free(t->h);
    free(t->rgb);
    *t = (struct env_taps){0};
}

struct frame separable_turn(const struct frame *f)
{
    return (struct frame){f->t, v3_scale(-1, f->b), v3_scale(-1, f->n)};
}

void separable_axis(const struct factors *f, int filter, const struct frame *frame, bool rotate,
                    double axis[2])
{
    axis[0] = f->axis[filter][0];
    axis[1] = f->axis[filter][1];
    if (rotate)
        return;
    // Columns and rows at the normal; at a pole any direction serves.
    const double r = hypot(frame->n.x, frame->n.z);
    const struct vec3 right = r > 1e-9 ? v3(-frame->n.z / r, 0, frame->n.x / r) : v3(1, 0, 0);
    const struct vec3 down = v3_cross(frame->n, right);
    const struct vec3 a = v3_add(v3_scale(axis[0], frame->t), v3_scale(axis[1], frame->b));
    axis[0] = v3_dot(a, right);
    axis[1] = v3_dot(a, down);
}

void env_turn(const struct environment *env, const struct frame *turn, bool back, struct image *out)
{
#pragma omp parallel for
    for (int j = 0; j < out->h; j++)
        for (int i = 0; i < out->w; i++) {
            const struct vec3 d = latlong_dir(i, j, out->w, out->h);
            double rgb[3];
            environment_radiance(env, back ? frame_local(turn, d) : frame_world(turn, d), rgb);
            for (int c = 0; c < 3; c++)
                out->px[((size_t)j * (size_t)out->w + (size_t)i) * 3 + (size_t)c] = (float)rgb[c];
        }
}

// A map as planes, each row twice behind itself and one row beyond either pole, so that any shift
// is a run: [3][h + 2][line].
struct wide {
    int w, h;
    size_t line;
    float *px;
};

static bool wide_init(struct wide *m, int w, int h, struct err *e)
{
    *m = (struct wide){.w = w, .h = h, .line = ((size_t)w * 2 + 31) / 16 * 16};
    m->px = sample_alloc(3 * (size_t)(h + 2) * m->line, sizeof *m->px, "map", e);
    return m->px != NULL;
}

static float *wide_row(const struct wide *m, int c, int j)
{
    return m->px + ((size_t)c * (size_t)(m->h + 2) + (size_t)(j + 1)) * m->line;
}

static void wide_close(struct wide *m)
{
    const size_t w = (size_t)m->w;
#pragma omp parallel for
    for (int k = 0; k < 3 * m->h; k++) {
        float *row = wide_row(m, k / m->h, k % m->h);
        memcpy(row + w, row, w * sizeof *row);
        memcpy(row + 2 * w, row, (m->line - 2 * w) * sizeof *row);
    }
    for (int c = 0; c < 3; c++)
        for (int pole = 0; pole < 2; pole++) { // seen from the other side: half a turn on
            const float *from = wide_row(m, c, pole ? m->h - 1 : 0);
            float *to = wide_row(m, c, pole ? m->h : -1);
            for (size_t i = 0; i < m->line; i++)
                to[i] = from[(i + w / 2) % w];
        }
}

static void wide_take(struct wide *m, const struct image *im)
{
#pragma omp parallel for
    for (int j = 0; j < m->h; j++)
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < m->w; i++)
                wide_row(m, c, j)[i] =
                    im->px[((size_t)j * (size_t)m->w + (size_t)i) * 3 + (size_t)c];
    wide_close(m);
}

// Where a tap reads, for all columns of a row: two rows, a shift, four weights.
struct reads {
    int row, shift;
    float w[4];
};

static void place_taps(const struct env_taps *t, const double axis[2], int w, int h, int j,
                       struct reads *out)
{
    const double th = M_PI * (j + .5) / h;
    const struct vec3 r = v3(0, cos(th), -sin(th)), right = v3(1, 0, 0);
    const struct vec3 down = v3(0, -sin(th), -cos(th));
    const struct vec3 a = v3_add(v3_scale(axis[0], right), v3_scale(axis[1], down));
    for (int k = 0; k < t->n; k++) {
        // Algorithm 2: h = (h, 0, 1 + sqrt(1 - h^2)) in the frame of r; wi = h - r.
        const double u = (double)t->h[k];
        const struct vec3 wi = v3_add(v3_scale(u, a), v3_scale(sqrt(1 - u * u), r));
        double col, row;
        latlong_pixel(wi, w, h, &col, &row);
        const double x = col - (.5 * w - .5) + w; // shift from this pixel's own column
        const int y0 = (int)floor(row), x0 = (int)floor(x);
        const float fy = (float)(row - y0), fx = (float)(x - x0);
        out[k] = (struct reads){
            y0, x0 % w, {(1 - fy) * (1 - fx), (1 - fy) * fx, fy * (1 - fx), fy * fx}};
    }
}

enum { BLOCK = 64 };

// sum[BLOCK] over the taps of one channel, columns from i on.
__attribute__((target_clones("avx512f", "avx2", "default"))) static void
blur_block(const struct wide *m, const struct env_taps *t, const struct reads *at, int c, int i,
           float *restrict sum)
{
    float acc[BLOCK] = {0};
    for (int k = 0; k < t->n; k++) {
        const float *a = wide_row(m, c, at[k].row) + at[k].shift + i, *b = a + m->line;
        const float weight = t->rgb[3 * k + c];
        const float w0 = weight * at[k].w[0], w1 = weight * at[k].w[1];
        const float w2 = weight * at[k].w[2], w3 = weight * at[k].w[3];
        for (int x = 0; x < BLOCK; x++)
            acc[x] += w0 * a[x] + w1 * a[x + 1] + (w2 * b[x] + w3 * b[x + 1]);
    }
    memcpy(sum, acc, sizeof acc);
}

// One pass: out = (add ? out : 0) + blur of in.
static void blur(const struct wide *in, const struct env_taps *t, const double axis[2], bool add,
                 struct wide *out)
{
#pragma omp parallel
    {
        struct reads *at = xcalloc((size_t)t->n + 1, sizeof *at);
#pragma omp for schedule(dynamic, 4)
        for (int j = 0; j < in->h; j++) {
            place_taps(t, axis, in->w, in->h, j, at);
            for (int c = 0; c < 3; c++)
                for (int i = 0; i < in->w; i += BLOCK) {
                    float sum[BLOCK], *to = wide_row(out, c, j) + i;
                    blur_block(in, t, at, c, i, sum);
                    for (int x = 0; x < BLOCK && i + x < in->w; x++)
                        to[x] = add ? to[x] + sum[x] : sum[x];
                }
        }
        free(at);
    }
    wide_close(out);
}

static bool filter(const struct factors *f, int which, int rank, const struct separable *how,
                   const struct frame *frame, const struct wide *in, bool add, struct wide *out,
                   struct err *e)
{
    struct env_taps t;
    double axis[2];
    if (!env_taps(&t, f, which, rank, how->taps, e))
        return false;
    separable_axis(f, which, frame, how->rotate, axis);
    blur(in, &t, axis, add, out);
    env_taps_finish(&t);
    return true;
}

static bool filters(const struct factors *f, const struct separable *how, const struct frame *frame,
                    const struct wide *in, struct wide *out, struct err *e)
{
    if (f->kind != FACTOR_COMPOSITION)
        return filter(f, 0, 0, how, frame, in, false, out, e) &&
               (f->kind == FACTOR_LINE || filter(f, 1, 0, how, frame, in, true, out, e));
    struct wide mid;
    bool ok = wide_init(&mid, in->w, in->h, e);
    for (int r = 0; r < f->rank && ok; r++) // R17 eq. 10 and 11 as printed would mix the ranks
        ok = filter(f, 1, r, how, frame, in, false, &mid, e) &&
             filter(f, 0, r, how, frame, &mid, r > 0, out, e);
    free(mid.px);
    return ok;
}

static void wide_give(const struct wide *m, struct image *out)
{
    const float scale = (float)(16 * M_PI * M_PI);
#pragma omp parallel for
    for (int j = 0; j < m->h; j++)
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < m->w; i++)
                out->px[((size_t)j * (size_t)m->w + (size_t)i) * 3 + (size_t)c] =
                    scale * wide_row(m, c, j)[i];
}

bool env_separable(const struct factors *f, const struct environment *env,
                   const struct frame *frame, const struct separable *how, struct image *out,
                   struct err *e)
{
    const int w = how->width, h = w / 2;
    if (w < 4 || w % 2 || w > 32768)
        return err_set(e, ERR_DATA, "bad map width %d: must be even, 4 to 32768", w);
    if (how->taps < 1 || how->taps > 16384)
        return err_set(e, ERR_DATA, "bad number of taps %d: must be 1 to 16384", how->taps);
    const struct frame turn =
        how->rotate ? separable_turn(frame) : (struct frame){{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    struct wide in = {0}, sum = {0};
    struct environment turned = {0};
    bool ok =
        wide_init(&in, w, h, e) && wide_init(&sum, w, h, e) && image_init(&turned.map, w, h, 3, e);
    if (ok) {
        env_turn(env, &turn, false, &turned.map);
        wide_take(&in, &turned.map);
        ok = filters(f, how, frame, &in, &sum, e) && image_init(out, w, h, 3, e);
    }
    if (ok && how->rotate) {
        wide_give(&sum, &turned.map);
        env_turn(&turned, &turn, true, out);
    } else if (ok) {
        wide_give(&sum, out);
    }
    environment_finish(&turned);
    free(in.px);
    free(sum.px);
    return ok;
}

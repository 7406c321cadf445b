// align.c - sub-pixel shifts between frames of different exposure.
#include "process/align.h"
#include "calib/bracket.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

enum { SIDE_MAX = 900, LEVELS = 4 };

// Radiance in blocks of `step` pixels, all channels together; NAN where any sample says nothing.
struct picture {
    int w, h, step;
    float *px; // [h][w], owned
};

// How a frame's sample becomes radiance; NAN for saturated or dark ones.
struct source {
    const struct hdr_frames *f;
    const struct bracket *b;
    const struct response *r;
    int frame;
    float table[RESPONSE_CHANNELS][RESPONSE_CODES];
};

static void fill_table(struct source *s)
{
    for (int c = 0; c < s->b->nc; c++)
        for (int z = 0; z < RESPONSE_CODES; z++)
            s->table[c][z] = response_code_ok(s->r, z)
                                 ? (float)(exp(s->r->log_x[c][z]) / s->b->time_s[s->frame])
                                 : NAN;
}

static float sample(const struct source *s, size_t k, int c)
{
    if (s->b)
        return s->table[c][s->b->code[s->frame][k]];
    const float x = s->f->px[s->frame][k];
    return (double)x < 0.95 * s->f->saturation ? x / (float)s->f->time_s[s->frame] : NAN;
}

static bool picture_make(struct picture *p, const struct source *s, int w, int h, int nc,
                         struct err *e)
{
    const int step = 2 * (((w > h ? w : h) - 1) / (2 * SIDE_MAX) + 1); // even: whole mosaic cells
    *p = (struct picture){.w = w / step, .h = h / step, .step = step};
    p->px = sample_alloc((size_t)p->w * (size_t)p->h, sizeof(float), "picture", e);
    if (!p->px)
        return false;
#pragma omp parallel for schedule(static)
    for (int j = 0; j < p->h; j++)
        for (int i = 0; i < p->w; i++) {
            float sum = 0;
            for (int y = j * step; y < (j + 1) * step; y++)
                for (int x = i * step; x < (i + 1) * step; x++)
                    for (int c = 0; c < nc; c++)
                        sum += sample(
                            s, ((size_t)y * (size_t)w + (size_t)x) * (size_t)nc + (size_t)c, c);
            p->px[j * p->w + i] = sum;
        }
    return true;
}

static bool halve(struct picture *to, const struct picture *p, struct err *e)
{
    *to = (struct picture){.w = p->w / 2, .h = p->h / 2, .step = 2 * p->step};
    to->px = sample_alloc((size_t)to->w * (size_t)to->h + 1, sizeof(float), "picture", e);
    if (!to->px)
        return false;
    for (int j = 0; j < to->h; j++)
        for (int i = 0; i < to->w; i++) {
            const float *a = p->px + 2 * j * p->w + 2 * i;
            to->px[j * to->w + i] = a[0] + a[1] + a[p->w] + a[p->w + 1];
        }
    return true;
}

// One level: b(x + d) = scale * a(x) with d = (x0, y0) + the small rest that is returned in blocks.
// Weights 1 / a^2: relative differences, so that the brightest spot is not all that counts.
static bool solve(const struct picture *a, const struct picture *b, int x0, int y0, double d[2],
                  double *sigma)
{
    double xx = 0, xy = 0, yy = 0, xr = 0, yr = 0, rr = 0, top = 0, ab = 0, aa = 0;
    long n = 0;
    for (int k = 0; k < a->w * a->h; k++)
        if ((double)a->px[k] > top)
            top = (double)a->px[k];
    for (int pass = 0; pass < 2; pass++) // first the common scale, then the shift
        for (int j = 1; j < a->h - 1; j++)
            for (int i = 1; i < a->w - 1; i++) {
                const int u = i + x0, v = j + y0;
                if (u < 1 || v < 1 || u >= b->w - 1 || v >= b->h - 1)
                    continue;
                const float *p = a->px + j * a->w + i;
                const double q = (double)b->px[v * b->w + u];
                const double gx = 0.5 * ((double)p[1] - (double)p[-1]),
                             gy = 0.5 * ((double)p[a->w] - (double)p[-a->w]);
                const double z = (double)p[0];
                if (!isfinite(q) || !isfinite(gx) || !isfinite(gy) || !(z > 1e-3 * top))
                    continue;
                const double w = 1 / (z * z);
                if (pass == 0) {
                    ab += w * z * q;
                    aa += w * z * z;
                    continue;
                }
                const double r = z - q * aa / ab; // = gx dx + gy dy for b(x + d) = a(x)
                const double wr = w / (1 + w * r * r / (0.1 * 0.1)); // what moved weighs little
                xx += wr * gx * gx;
                xy += wr * gx * gy;
                yy += wr * gy * gy;
                xr += wr * gx * r;
                yr += wr * gy * r;
                rr += wr * r * r;
                n++;
            }
    const double det = xx * yy - xy * xy;
    if (n < 100 || !(det > 1e-3 * xx * yy))
        return false;
    d[0] = (yy * xr - xy * yr) / det;
    d[1] = (xx * yr - xy * xr) / det;
    *sigma = sqrt(rr / (double)n * (xx + yy) / det);
    return true;
}

static bool shift_of(const struct picture *a, const struct picture *b, struct shift *out,
                     struct err *e)
{
    struct picture pa[LEVELS] = {*a}, pb[LEVELS] = {*b};
    int levels = 1;
    bool ok = true;
    for (; ok && levels < LEVELS && pa[levels - 1].w >= 64 && pa[levels - 1].h >= 64; levels++)
        ok = halve(&pa[levels], &pa[levels - 1], e) && halve(&pb[levels], &pb[levels - 1], e);
    double x = 0, y = 0;
    *out = (struct shift){.sigma_px = INFINITY};
    for (int k = levels; ok && k-- > 0;) {
        double d[2], sigma;
        const int x0 = (int)lround(x / pa[k].step), y0 = (int)lround(y / pa[k].step);
        if (!solve(&pa[k], &pb[k], x0, y0, d, &sigma))
            continue;
        for (int m = 0; m < 2; m++) // beyond a block the gradient knows the direction only
            d[m] = fmax(-1, fmin(1, d[m]));
        x = (x0 + d[0]) * pa[k].step;
        y = (y0 + d[1]) * pa[k].step;
        *out = (struct shift){x, y, sigma * pa[k].step, k == 0};
    }
    for (int k = 1; k < levels; k++) {
        free(pa[k].px);
        free(pb[k].px);
    }
    return ok;
}

static bool align(struct source *s, int n, int w, int h, int nc, const double *time_s,
                  struct shift *shift, struct err *e)
{
    int at[BRACKET_MAX];
    struct picture last = {0};
    bool ok = true;
    for (int j = 0; j < n; j++) {
        int k = j;
        for (; k > 0 && time_s[at[k - 1]] > time_s[j]; k--)
            at[k] = at[k - 1];
        at[k] = j;
    }
    for (int k = 0; ok && k < n; k++) {
        struct picture now = {0};
        struct shift step = {.known = true};
        s->frame = at[k];
        if (s->b)
            fill_table(s);
        ok = picture_make(&now, s, w, h, nc, e) && (!k || shift_of(&last, &now, &step, e));
        if (ok) {
            const struct shift *from = k ? &shift[at[k - 1]] : &(struct shift){.known = true};
            shift[at[k]] = step.known
                               ? (struct shift){from->dx_px + step.dx_px, from->dy_px + step.dy_px,
                                                hypot(from->sigma_px, step.sigma_px), true}
                               : (struct shift){from->dx_px, from->dy_px, from->sigma_px, false};
        }
        free(last.px);
        last = now;
    }
    free(last.px);
    return ok;
}

bool align_frames(const struct hdr_frames *f, struct shift *shift, struct err *e)
{
    struct source s = {.f = f};
    return align(&s, f->n, f->w, f->h, f->nc, f->time_s, shift, e);
}

bool align_codes(const struct bracket *b, const struct response *r, struct shift *shift,
                 struct err *e)
{
    struct source s = {.b = b, .r = r};
    return align(&s, b->n, b->w, b->h, b->nc, b->time_s, shift, e);
}

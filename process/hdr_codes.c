// hdr_codes.c - merging 8-bit codes by tables: what a code adds to numerator and denominator.
//
// All frames of a pixel share one radiance, so weights by relative variance are weights by
// variance, and 1 / sigma^2 of ln X depends on the code alone: 2 table reads a sample.
#include "calib/bracket.h"
#include "core/mem.h"
#include "process/hdr.h"
#include "process/hdr_out.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = RESPONSE_CODES, PART = 256 };

struct pair {
    float num, den;
};

// log_mean: sums of logarithms (Debevec). Otherwise den is a plain weight and num = weight X / t.
static void fill(struct pair t[N], const struct response *r, int c, double time_s,
                 enum hdr_method method)
{
    for (int z = 0; z < N; z++) {
        double w = 0;
        const double log_e = r->log_x[c][z] - log(time_s), sigma = r->log_sigma[c][z];
        const double centred = (z - 127.5) / 127.5;
        if (response_code_ok(r, z))
            w = method == HDR_POISSON   ? 1 / (sigma * sigma)
                : method == HDR_DEBEVEC ? (z < 128 ? z + 1 : 256 - z)
                                        : exp(-4 * centred * centred) * time_s * time_s;
        t[z] = (struct pair){(float)(w * (method == HDR_DEBEVEC ? log_e : exp(log_e))), (float)w};
    }
}

struct tables {
    struct pair (*pair)[RESPONSE_CHANNELS][N]; // [n]
    float bright[RESPONSE_CHANNELS];           // radiance where all frames are saturated
    float relative2[RESPONSE_CHANNELS]; // squared relative error of a code, for methods whose
                                        // weights are no inverse variances
};

// Adds a frame's codes [n] to the sums; n is a multiple of the channels.
static void add_codes(const struct pair table[RESPONSE_CHANNELS][N], int nc, const uint8_t *code,
                      int n, struct pair *sum)
{
    for (int i = 0; i < n; i += nc)
        for (int c = 0; c < nc; c++) {
            const struct pair *p = &table[c][code[i + c]];
            sum[i + c].num += p->num;
            sum[i + c].den += p->den;
        }
}

// Pixels [from, to) of row j, few enough that their sums and a frame's tables stay in the nearest
// cache.
static void merge_part(const struct bracket *b, const struct response *r, const struct tables *t,
                       const int shortest, enum hdr_method method, int j, int from, int to,
                       struct hdr_out *o)
{
    const int nc = b->nc, n = (to - from) * nc;
    const size_t at = ((size_t)j * (size_t)b->w + (size_t)from) * (size_t)nc;
    struct pair sum[PART * RESPONSE_CHANNELS] = {0};
    for (int k = 0; k < b->n; k++)
        if (nc == 3) // the count as a constant: the loop unrolls
            add_codes(t->pair[k], 3, b->code[k] + at, n, sum);
        else
            add_codes(t->pair[k], nc, b->code[k] + at, n, sum);
    for (int i = 0; i < to - from; i++)
        for (int c = 0; c < nc; c++) {
            const struct pair s = sum[i * nc + c];
            if (s.den > 0) {
                float v = s.num / s.den;
                if (method == HDR_DEBEVEC)
                    v = expf(v);
                const float relative2 = method == HDR_POISSON ? 1 / s.den : t->relative2[c];
                hdr_out_set(o, from + i, j, c, v, v * v * relative2, HDR_MEASURED);
            } else if (b->code[shortest][at + (size_t)(i * nc + c)] > r->code_max) {
                hdr_out_set(o, from + i, j, c, t->bright[c], 0, HDR_SATURATED);
            } else {
                hdr_out_set(o, from + i, j, c, 0, 0, HDR_BLACK);
            }
        }
}

bool hdr_merge_codes(const struct bracket *b, const struct response *r, enum hdr_method method,
                     struct image *out, struct hdr_counts *counts, struct err *e)
{
    if (b->n < 2 || b->n > BRACKET_MAX)
        return err_set(e, ERR_DATA, "a bracket needs 2 to %d frames, not %d", BRACKET_MAX, b->n);
    if (b->nc != r->nc)
        return err_set(e, ERR_DATA, "frames have %d channels, the response %d", b->nc, r->nc);
    struct hdr_out o;
    if (!hdr_out_init(&o, b->w, b->h, b->nc, e))
        return false;
    struct tables t = {.pair = xcalloc((size_t)b->n, sizeof *t.pair)};
    int shortest = 0;
    for (int k = 0; k < b->n; k++) {
        if (b->time_s[k] < b->time_s[shortest])
            shortest = k;
        for (int c = 0; c < b->nc; c++)
            fill(t.pair[k][c], r, c, b->time_s[k], method);
    }
    for (int c = 0; c < b->nc; c++) {
        const double sigma = r->log_sigma[c][RESPONSE_MIDDLE];
        t.bright[c] = (float)(exp(r->log_x[c][r->code_max]) / b->time_s[shortest]);
        t.relative2[c] = (float)(sigma * sigma);
    }
#pragma omp parallel for schedule(static)
    for (int j = 0; j < b->h; j++)
        for (int from = 0; from < b->w; from += PART)
            merge_part(b, r, &t, shortest, method, j, from, from + PART < b->w ? from + PART : b->w,
                       &o);
    free(t.pair);
    return hdr_out_take(&o, out, counts, e);
}

// debevec.c - the response of a camera from a bracket, by least squares (Debevec & Malik 1997).
//
// The unknown curve is ln X = base + delta: the sRGB curve plus a smooth difference, so that codes
// no pixel has seen follow the sRGB curve's shape. Every ln E is eliminated from the normal
// equations, which leaves 256 unknowns a channel however many pixels are used.
#include "calib/bracket.h"
#include "calib/normal.h"
#include "calib/response.h"
#include "calib/response_prior.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = RESPONSE_CODES, ROUNDS = 4 };

// Of the picked pixels so many count as independent: what is left over is mostly not noise but
// colour mixing, JPEG and glare, alike for neighbours. Between 10 and 150 the result hardly moves.
static const double INDEPENDENT = 40;
// Prior sigma of ln t: shutters keep 1 % and some 20 us.
static double time_sigma(double t_s)
{
    return 0.01 + 20e-6 / t_s;
}

// Adds one pixel of one channel, with ln E eliminated: subtracting the weighted mean equation.
static void add_pixel(struct normal *s, const struct response *r, const double *log_base,
                      const double *log_t, const uint8_t *code, int n, int c, bool scales,
                      const double *weight, double trust)
{
    int at[2 * BRACKET_MAX], k = 0;
    double x[2 * BRACKET_MAX], total = 0, y = 0;
    for (int j = 0; j < n; j++) {
        const double w = trust * weight[j];
        if (w == 0)
            continue;
        const int pair[2] = {c * N + code[j], r->nc * N + j};
        const double y_j = log_t[j] - log_base[code[j]];
        normal_add(s, scales ? 2 : 1, pair, (double[]){1, -1}, y_j, w);
        for (int m = 0; m < (scales ? 2 : 1); m++) {
            at[k] = pair[m];
            x[k++] = m ? -w : w;
        }
        total += w;
        y += w * y_j;
    }
    if (total > 0)
        normal_add(s, k, at, x, y, -1 / total);
}

// Each correction is near 0; together they neither shift nor stretch ln t: ln X and ln t stretched
// together would fit every bracket equally well, and a fit would shrink both to lose its residuals.
static void add_times(struct normal *s, const struct bracket *b, const double *log_t)
{
    int at[BRACKET_MAX];
    double w[BRACKET_MAX], stretch[BRACKET_MAX], total = 0, mean = 0;
    for (int j = 0; j < b->n; j++) {
        at[j] = b->nc * N + j;
        w[j] = 1 / (time_sigma(b->time_s[j]) * time_sigma(b->time_s[j]));
        normal_add(s, 1, &at[j], (double[]){1}, 0, w[j]);
        total += w[j];
        mean += w[j] * log_t[j];
    }
    for (int j = 0; j < b->n; j++)
        stretch[j] = w[j] * (log_t[j] - mean / total);
    normal_add(s, b->n, at, w, 0, 1e6);
    normal_add(s, b->n, at, stretch, 0, 1e6);
}

// Residuals of the fit, their weights for the next round (Cauchy, against what moved in the scene),
// and the noise in codes that explains them, smooth along the code axis.
static void reweigh(struct response *r, const struct bracket_pixels *px, const double *log_base,
                    const double *log_t, double *weight)
{
    enum { HALF = 8 };
    double all = 0;
    long count = 0;
    for (int c = 0; c < r->nc; c++) {
        double sum[N] = {0}, share[N] = {0};
        for (int i = 0; i < px->count; i++) {
            const uint8_t *code = bracket_codes(px, i, c);
            double *w = weight + ((size_t)i * (size_t)r->nc + (size_t)c) * (size_t)px->n;
            double total = 0, mean = 0;
            for (int j = 0; j < px->n; j++) {
                total += w[j];
                mean += w[j] * (r->log_x[c][code[j]] - log_t[j]);
            }
            if (total == 0)
                continue;
            mean /= total;
            for (int j = 0; j < px->n; j++) {
                if (w[j] == 0)
                    continue;
                const int z = code[j];
                const double res = r->log_x[c][z] - log_t[j] - mean, sigma = r->log_sigma[c][z];
                const double free = 1 - w[j] / total; // share of the residual not fitted by E
                const double robust = 1 / (1 + res * res / (6 * sigma * sigma));
                if (free > 0.05) {
                    const double noise = res / response_slope(log_base, z);
                    sum[z] += robust * noise * noise;
                    share[z] += robust * free;
                    all += robust * res * res;
                    count++;
                }
                w[j] = robust / (sigma * sigma);
            }
        }
        for (int z = 0; z < N; z++) {
            double s = 0.5, n = 0.5; // one code where there is nothing else
            for (int k = z - HALF; k <= z + HALF; k++)
                if (k >= 0 && k < N) {
                    s += sum[k];
                    n += share[k];
                }
            r->log_sigma[c][z] = sqrt(fmax(s / n, 1 / 12.)) * response_slope(log_base, z);
        }
    }
    r->residual = count ? sqrt(all / (double)count) : 0;
}

// One round: the curves, and the corrections of ln t into d[] unless that is NULL.
static bool fit(struct response *r, const struct bracket *b, const struct bracket_pixels *px,
                const double *log_base, const double *log_t, const double *weight, double *d,
                struct err *e)
{
    struct normal s;
    const int unknowns = r->nc * N + (d ? px->n : 0);
    const double trust = fmin(1, INDEPENDENT / px->count);
    double *out = xcalloc((size_t)unknowns, sizeof *out);
    normal_init(&s, unknowns);
    for (int i = 0; i < px->count; i++)
        for (int c = 0; c < r->nc; c++)
            add_pixel(&s, r, log_base, log_t, bracket_codes(px, i, c), px->n, c, d != NULL,
                      weight + ((size_t)i * (size_t)r->nc + (size_t)c) * (size_t)px->n, trust);
    response_prior(&s, r->nc);
    if (d)
        add_times(&s, b, log_t);
    const bool ok = normal_solve(&s, out, NULL, e);
    for (int c = 0; ok && c < r->nc; c++) {
        for (int z = 0; z < N; z++)
            r->log_x[c][z] = log_base[z] + out[c * N + z];
        response_make_monotone(r->log_x[c]);
        const double middle = r->log_x[c][RESPONSE_MIDDLE];
        for (int z = 0; z < N; z++)
            r->log_x[c][z] -= middle;
    }
    if (ok && d)
        memcpy(d, out + r->nc * N, (size_t)px->n * sizeof *d);
    normal_finish(&s);
    free(out);
    return ok;
}

bool response_debevec(struct response *out, const struct bracket *b, double *log_scale,
                      struct err *e)
{
    struct response r;
    struct bracket_pixels px;
    response_srgb(&r, b->nc);
    if (!bracket_pick(&px, b, &r, e))
        return false;
    double log_base[N], log_t[BRACKET_MAX], corrected[BRACKET_MAX], d[BRACKET_MAX] = {0};
    memcpy(log_base, r.log_x[0], sizeof log_base);
    for (int j = 0; j < b->n; j++)
        corrected[j] = log_t[j] = log(b->time_s[j]);

    const size_t per_pixel = (size_t)b->nc * (size_t)b->n;
    double *weight = xcalloc((size_t)px.count * per_pixel, sizeof *weight);
    for (int i = 0; i < px.count; i++)
        for (int c = 0; c < b->nc; c++)
            for (int j = 0; j < b->n; j++) {
                const int z = bracket_codes(&px, i, c)[j];
                const double sigma = r.log_sigma[c][z];
                weight[(size_t)i * per_pixel + (size_t)(c * b->n + j)] =
                    response_code_ok(&r, z) ? 1 / (sigma * sigma) : 0;
            }
    bool ok = true;
    for (int round = 0; ok && round < ROUNDS; round++) {
        ok = fit(&r, b, &px, log_base, log_t, weight, log_scale ? d : NULL, e);
        for (int j = 0; j < b->n; j++)
            corrected[j] = log_t[j] + d[j];
        if (ok)
            reweigh(&r, &px, log_base, corrected, weight);
    }
    r.pixels = px.count;
    ok = ok && response_check(&r, e);
    if (ok) {
        *out = r;
        if (log_scale)
            memcpy(log_scale, d, (size_t)b->n * sizeof *d);
    }
    free(weight);
    bracket_pixels_finish(&px);
    return ok;
}

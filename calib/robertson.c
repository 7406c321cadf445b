// robertson.c - the response by alternating estimates (Robertson, Borman & Stevenson 2003).
//
// Given the curve X, every pixel's radiance is the certainty-weighted mean of X / t; given the
// radiances, X of a code is the mean of E t over all samples with that code. Codes that no pixel
// shows are filled in along the neighbours, in ln X.
#include "calib/bracket.h"
#include "calib/response_prior.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = RESPONSE_CODES, ROUNDS_MAX = 60 };
static const double CONVERGED = 1e-4; // largest relative change of X in a round
static const double INDEPENDENT = 40; // as in debevec.c

static double certainty(const struct response *r, int z)
{
    const double centred = (z - 127.5) / 127.5;
    return response_code_ok(r, z) ? exp(-4 * centred * centred) : 0;
}

static double radiance(const struct response *r, const uint8_t *code, const double *time_s, int n,
                       const double x[N])
{
    double num = 0, den = 0;
    for (int j = 0; j < n; j++) {
        const double w = certainty(r, code[j]) * time_s[j];
        num += w * x[code[j]];
        den += w * time_s[j];
    }
    return den > 0 ? num / den : 0;
}

// X where the count is 0, by straight lines in ln X between the codes seen (kept flat beyond them
// by the old curve's shape).
static void fill_gaps(double x[N], const double before[N], const long seen[N])
{
    int last = -1;
    for (int z = 0; z < N; z++) {
        if (!seen[z])
            continue;
        for (int k = last + 1; k < z; k++)
            x[k] = last < 0 ? x[z] * before[k] / before[z]
                            : exp(log(x[last]) +
                                  (log(x[z]) - log(x[last])) * (k - last) / (double)(z - last));
        last = z;
    }
    for (int k = last + 1; last >= 0 && k < N; k++)
        x[k] = x[last] * before[k] / before[last];
}

static double round_once(const struct response *r, const struct bracket_pixels *px,
                         const double *time_s, int c, double x[N], long seen[N])
{
    double sum[N] = {0}, next[N], change = 0;
    memset(seen, 0, N * sizeof *seen);
    for (int i = 0; i < px->count; i++) {
        const uint8_t *code = bracket_codes(px, i, c);
        const double e = radiance(r, code, time_s, px->n, x);
        for (int j = 0; e > 0 && j < px->n; j++)
            if (response_code_ok(r, code[j])) {
                sum[code[j]] += e * time_s[j];
                seen[code[j]]++;
            }
    }
    for (int z = 0; z < N; z++)
        next[z] = seen[z] ? sum[z] / (double)seen[z] : 0;
    fill_gaps(next, x, seen);
    const double middle = next[RESPONSE_MIDDLE];
    for (int z = 0; z < N; z++) {
        next[z] /= middle;
        change = fmax(change, fabs(next[z] / x[z] - 1));
        x[z] = next[z];
    }
    return change;
}

// Every round ends smooth: the alternation alone leaves what the bracket is blind to as noise made
// it.
static bool fit_channel(struct response *r, const struct bracket_pixels *px, const double *time_s,
                        int c, struct err *e)
{
    const double trust = fmin(1, INDEPENDENT / px->count);
    double x[N], weight[N], change = 1;
    long seen[N];
    for (int k = 0; k < ROUNDS_MAX && change > CONVERGED; k++) {
        for (int z = 0; z < N; z++)
            x[z] = exp(r->log_x[c][z]);
        change = round_once(r, px, time_s, c, x, seen);
        for (int z = 0; z < N; z++) {
            r->log_x[c][z] = log(x[z]);
            weight[z] = trust * (double)seen[z] / (r->log_sigma[c][z] * r->log_sigma[c][z]);
        }
        if (!response_smooth(r->log_x[c], weight, e))
            return false;
    }
    response_make_monotone(r->log_x[c]);
    return true;
}

// Adds the squares of ln X - ln E - ln t of one channel.
static void add_residuals(const struct response *r, const struct bracket_pixels *px,
                          const double *time_s, int c, double *sum, long *count)
{
    double x[N];
    for (int z = 0; z < N; z++)
        x[z] = exp(r->log_x[c][z]);
    for (int i = 0; i < px->count; i++) {
        const uint8_t *code = bracket_codes(px, i, c);
        const double lit = radiance(r, code, time_s, px->n, x);
        for (int j = 0; lit > 0 && j < px->n; j++)
            if (response_code_ok(r, code[j])) {
                const double res = r->log_x[c][code[j]] - log(lit * time_s[j]);
                *sum += res * res;
                ++*count;
            }
    }
}

bool response_robertson(struct response *out, const struct bracket *b, struct err *e)
{
    struct response r;
    struct bracket_pixels px;
    response_srgb(&r, b->nc);
    if (!bracket_pick(&px, b, &r, e))
        return false;
    double sum = 0;
    long count = 0;
    bool ok = true;
    for (int c = 0; ok && c < b->nc; c++) {
        ok = fit_channel(&r, &px, b->time_s, c, e);
        add_residuals(&r, &px, b->time_s, c, &sum, &count);
    }
    r.residual = count ? sqrt(sum / (double)count) : 0;
    r.pixels = px.count;
    bracket_pixels_finish(&px);
    ok = ok && response_check(&r, e);
    if (ok)
        *out = r;
    return ok;
}

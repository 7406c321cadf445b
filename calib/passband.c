// passband.c - the product of curves, its moments, and the record.
#define _GNU_SOURCE
#include "calib/passband.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

static const double step_m = 0.05e-9; // of the sums

void passband_finish(struct passband *s)
{
    if (!s)
        return;
    spectrum_finish(&s->band);
    *s = (struct passband){0};
}

// Curves as they are looked at: each shifted, each perhaps without every other sample.
struct look {
    const struct spectrum *curve; // [n]
    int n, shifted, thinned;      // which one is; -1: none
    double shift_m;
};

static double thinned_at(const struct spectrum *s, double l)
{
    int k = 0;
    while (k + 2 < s->n - 1 && s->lambda_m[k + 2] < l)
        k += 2;
    const int next = k + 2 < s->n ? k + 2 : s->n - 1;
    if (!(l >= s->lambda_m[0] && l <= s->lambda_m[s->n - 1]))
        return 0;
    const double f = (l - s->lambda_m[k]) / (s->lambda_m[next] - s->lambda_m[k]);
    return (1 - f) * s->value[k] + f * s->value[next];
}

static double value_at(const struct look *a, double l)
{
    double x = 1;
    for (int k = 0; k < a->n; k++) {
        const double at = l - (k == a->shifted ? a->shift_m : 0);
        x *= k == a->thinned ? thinned_at(&a->curve[k], at) : spectrum_at(&a->curve[k], at);
    }
    return x;
}

struct moments {
    double centre_m, rms_m, width_m;
};

static bool moments_of(const struct look *a, double from_m, double to_m, struct moments *m)
{
    double sum = 0, first = 0, second = 0, peak = 0, rise = NAN, fall = NAN, before = 0;
    const int n = (int)ceil((to_m - from_m) / step_m);
    for (int k = 0; k <= n; k++) {
        const double l = from_m + k * step_m, x = value_at(a, l), t = l - from_m;
        sum += x;
        first += x * t;
        second += x * t * t;
        peak = fmax(peak, x);
    }
    if (!(sum > 0))
        return false;
    for (int k = 0; k <= n; k++) { // outermost crossings of half the peak
        const double x = value_at(a, from_m + k * step_m), half = 0.5 * peak;
        if (k && before < half && x >= half && isnan(rise))
            rise = k - (x - half) / (x - before);
        if (k && before >= half && x < half)
            fall = k - (x - half) / (x - before);
        before = x;
    }
    m->centre_m = from_m + first / sum;
    m->rms_m = sqrt(fmax(0, second / sum - first / sum * first / sum));
    m->width_m = ((isnan(fall) ? n : fall) - (isnan(rise) ? 0 : rise)) * step_m;
    return true;
}

static double square(double x)
{
    return x * x;
}

// What the record keeps: enough samples for a narrow band.
static void keep_band(struct passband *s, const struct look *a, double from_m, double to_m)
{
    const int n = 401;
    const double lo = fmax(from_m, s->lambda_m - 8 * s->rms_m - 2e-9);
    const double hi = fmin(to_m, s->lambda_m + 8 * s->rms_m + 2e-9);
    double peak = 0;
    s->band = (struct spectrum){n, xcalloc((size_t)n, sizeof(double)),
                                xcalloc((size_t)n, sizeof(double))};
    for (int k = 0; k < n; k++) {
        s->band.lambda_m[k] = lo + (hi - lo) * k / (n - 1);
        s->band.value[k] = value_at(a, s->band.lambda_m[k]);
        peak = fmax(peak, s->band.value[k]);
    }
    for (int k = 0; k < n; k++)
        s->band.value[k] /= peak;
}

bool passband_product(struct passband *out, const struct spectrum *curve, int n, double accuracy_m,
                      struct err *e)
{
    struct look look = {curve, n, -1, -1, 0};
    struct moments m, moved;
    double from = 0, to = INFINITY, centre2 = 0, width2 = 0;
    for (int k = 0; k < n; k++) {
        from = fmax(from, curve[k].lambda_m[0]);
        to = fmin(to, curve[k].lambda_m[curve[k].n - 1]);
    }
    if (!(to > from) || !moments_of(&look, from, to, &m))
        return err_set(e, ERR_DATA, "the curves have no wavelength in common");
    for (int k = 0; k < n; k++)
        for (int way = 0; way < 2; way++) {
            struct look other = look;
            other.shifted = way == 0 ? k : -1;
            other.shift_m = accuracy_m;
            other.thinned = way == 1 ? k : -1;
            if ((way == 1 && curve[k].n < 5) ||
                !moments_of(&other, from - accuracy_m, to + accuracy_m, &moved))
                continue;
            // linear interpolation's error falls to a quarter when samples are twice as dense
            const double share = way == 1 ? 1. / 3 : 1;
            centre2 += square(share * (moved.centre_m - m.centre_m));
            width2 += square(share * (moved.width_m - m.width_m));
        }
    struct passband s = {.lambda_m = m.centre_m,
                         .lambda_sigma_m = sqrt(centre2),
                         .rms_m = m.rms_m,
                         .width_m = m.width_m,
                         .width_sigma_m = sqrt(width2),
                         .grating_m = NAN,
                         .grating_sigma_m = NAN};
    keep_band(&s, &look, from, to);
    record_init(&s.head, "spectral", "this light, filter and camera channel", s.lambda_sigma_m,
                "standard uncertainty of lambda_m, m");
    *out = s;
    return true;
}

bool passband_gaussian(struct passband *s, double lambda_m, double width_m, double accuracy_m,
                       struct err *e)
{
    enum { N = 401 };
    double lambda[N], value[N];
    for (int k = 0; k < N; k++) {
        const double x = (k - N / 2) / 100.; // in widths
        lambda[k] = lambda_m + x * width_m;
        value[k] = exp(-4 * log(2) * x * x);
    }
    const struct spectrum curve = {N, lambda, value};
    return passband_product(s, &curve, 1, accuracy_m, e);
}

bool passband_agrees(const struct passband *s)
{
    return isnan(s->grating_m) ||
           fabs(s->grating_m - s->lambda_m) <= 2 * hypot(s->grating_sigma_m, s->lambda_sigma_m);
}

bool passband_write(const struct passband *s, const char *command, const char *path, struct err *e)
{
    struct record_file rf;
    record_begin(&rf, &s->head, command);
    fprintf(rf.f,
            "lambda_m: %.9g\nlambda_sigma_m: %.4g\nrms_m: %.6g\nwidth_m: %.6g\n"
            "width_sigma_m: %.4g\n",
            s->lambda_m, s->lambda_sigma_m, s->rms_m, s->width_m, s->width_sigma_m);
    if (!isnan(s->grating_m))
        fprintf(rf.f,
                "grating:\n  lines_per_m: %.9g\n  lambda_m: %.9g\n  lambda_sigma_m: %.4g\n"
                "  agrees: %s\n",
                s->lines_per_m, s->grating_m, s->grating_sigma_m,
                passband_agrees(s) ? "true" : "false");
    record_list(rf.f, "band_lambda_m", s->band.lambda_m, s->band.n);
    record_list(rf.f, "band", s->band.value, s->band.n);
    return record_end(&rf, path, e);
}

static bool read_grating(struct passband *s, struct ynode *root, struct err *e)
{
    struct ynode *y = NULL;
    bool agrees = true;
    s->grating_m = s->grating_sigma_m = s->lines_per_m = NAN;
    return ymap_map(root, "grating", Y_OPTIONAL, &y, e) &&
           (!y ||
            (ymap_num(y, "lines_per_m", Y_NEEDED, UNIT_NONE, 1, 1e8, &s->lines_per_m, e) &&
             ymap_num(y, "lambda_m", Y_NEEDED, UNIT_NONE, 1e-8, 1e-5, &s->grating_m, e) &&
             ymap_num(y, "lambda_sigma_m", Y_NEEDED, UNIT_NONE, 0, 1e-5, &s->grating_sigma_m, e) &&
             ymap_bool(y, "agrees", Y_OPTIONAL, &agrees, e)));
}

static bool read_band(struct spectrum *s, struct ynode *root, struct err *e)
{
    struct ynode *list;
    if (!ymap_list(root, "band_lambda_m", Y_NEEDED, &list, e))
        return false;
    const int n = ylist_count(list);
    if (n < 2)
        return yaml_bad(list, e, "has %d numbers, needs 2 or more", n);
    *s = (struct spectrum){n, xcalloc((size_t)n, sizeof(double)),
                           xcalloc((size_t)n, sizeof(double))};
    if (!record_read_list(root, "band_lambda_m", 1e-8, 1e-4, s->lambda_m, n, e) ||
        !record_read_list(root, "band", 0, 1e30, s->value, n, e))
        return false;
    for (int k = 1; k < n; k++)
        if (!(s->lambda_m[k] > s->lambda_m[k - 1]))
            return yaml_bad(list, e, "number %d does not rise", k + 1);
    return true;
}

bool passband_read(struct passband *out, const char *path, struct err *e)
{
    struct yaml *y;
    struct passband s = {0};
    if (!yaml_open(&y, path, e))
        return false;
    struct ynode *root = yaml_root(y);
    bool ok =
        record_read(&s.head, root, path, "spectral", e) &&
        ymap_num(root, "lambda_m", Y_NEEDED, UNIT_NONE, 1e-8, 1e-5, &s.lambda_m, e) &&
        ymap_num(root, "lambda_sigma_m", Y_NEEDED, UNIT_NONE, 0, 1e-5, &s.lambda_sigma_m, e) &&
        ymap_num(root, "rms_m", Y_OPTIONAL, UNIT_NONE, 0, 1e-5, &s.rms_m, e) &&
        ymap_num(root, "width_m", Y_OPTIONAL, UNIT_NONE, 0, 1e-5, &s.width_m, e) &&
        ymap_num(root, "width_sigma_m", Y_OPTIONAL, UNIT_NONE, 0, 1e-5, &s.width_sigma_m, e) &&
        read_grating(&s, root, e) && read_band(&s.band, root, e);
    ok = yaml_close(y, ok, e) && ok;
    if (ok)
        *out = s;
    else
        passband_finish(&s);
    return ok;
}

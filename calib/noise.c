// noise.c - gain, read noise and PRNU from pairs of frames.
#include "calib/noise.h"
#include "calib/normal.h"
#include <math.h>
#include <string.h>

static const double TRIM_SIGMAS = 7; // of a difference, against pixels that flicker
static const double FAINT = 20;      // read noises

static double neighbours(const float *p, int w)
{
    return 0.25 * ((double)p[-1] + (double)p[1] + (double)p[-w] + (double)p[w]);
}

// Pixel minus the mean of its four neighbours: keeps PRNU, drops smooth light.
static double high_pass(const float *p, int w)
{
    return (double)p[0] - neighbours(p, w);
}

// Half octaves of a half squared difference, from 2^-8 counts^2 on.
static int step_of(double v)
{
    const int at = v > 0 ? (int)floor(2 * (log2(v) + 8)) : 0;
    return at < 0 ? 0 : at < NOISE_STEPS ? at : NOISE_STEPS - 1;
}

// Variance from the median of the histogram: half a squared difference of normal noise is the
// variance times chi^2 of one degree, whose median is 0.4549.
static double median_variance(const struct noise_bin *b)
{
    double below = 0;
    for (int k = 0; k < NOISE_STEPS; k++) {
        const double here = (double)b->step[k];
        if (below + here >= 0.5 * b->n)
            return exp2(0.5 * (k + (0.5 * b->n - below) / here) - 8) / 0.4549;
        below += here;
    }
    return 0;
}

static bool touches(const float *p, int w, double white)
{
    return (double)p[0] >= white || (double)p[1] >= white || (double)p[-1] >= white ||
           (double)p[w] >= white || (double)p[-w] >= white;
}

void noise_add(struct noise_sums *s, const float *a, const float *b, const uint8_t *hot, int w,
               int h)
{
    const double span = s->white - s->black;
    for (int j = 1; j < h - 1; j++)
        for (int i = 1; i < w - 1; i++) {
            const size_t k = (size_t)j * (size_t)w + (size_t)i;
            const double level = 0.5 * ((double)a[k] + (double)b[k]) - s->black;
            const double d = (double)a[k] - (double)b[k];
            // Sorted by the neighbours, whose noise is not its own: sorted by their own counts the
            // faint pixels of a bin are brighter than they look, and the line would be too flat.
            const double around = 0.5 * (neighbours(a + k, w) + neighbours(b + k, w)) - s->black;
            if ((hot && hot[k]) || touches(a + k, w, s->white) || touches(b + k, w, s->white) ||
                around > 0.9 * span || around < -0.05 * span)
                continue;
            const double model = s->model[0] + s->model[1] * fmax(fmax(around, level), 0);
            if (model > 0 && d * d > 2 * TRIM_SIGMAS * TRIM_SIGMAS * model)
                continue;
            struct noise_bin *bin = &s->bin[(int)(sqrt(fmax(around, 0) / span) * NOISE_BINS)];
            bin->n++;
            bin->level += level;
            bin->square += 0.5 * d * d;
            bin->step[step_of(0.5 * d * d)]++;
            bin->common += high_pass(a + k, w) * high_pass(b + k, w);
        }
    s->pairs++;
}

// A line through (p, y) of the bins with weights w(model), refitted with its own weights.
struct line {
    double at0, slope, at0_sigma, slope_sigma;
};

static bool fit_line(const double *p, const double *y, const double *n, int count, struct line *l)
{
    l->at0 = 1;
    l->slope = 0;
    for (int round = 0; round < 8; round++) {
        struct normal s;
        struct err ignored;
        double out[2], inverse[2];
        normal_init(&s, 2);
        for (int k = 0; k < count; k++) {
            // half a squared difference of normal noise has the variance 2 v^2
            const double model = fmax(l->at0 + l->slope * p[k], 1e-12);
            normal_add(&s, 2, (int[]){0, 1}, (double[]){1, p[k]}, y[k], n[k] / (2 * model * model));
        }
        const bool ok = normal_solve(&s, out, inverse, &ignored);
        normal_finish(&s);
        if (!ok)
            return false;
        *l = (struct line){fmax(out[0], 0), out[1], sqrt(inverse[0]), sqrt(inverse[1])};
    }
    return true;
}

bool noise_end(const struct noise_sums *s, struct noise *out, struct err *e)
{
    struct noise r = {.black = s->black, .white = s->white, .pairs = s->pairs};
    double level[NOISE_BINS + 1], square[NOISE_BINS + 1], count[NOISE_BINS + 1];
    int bins = 0;
    const double faint = s->dark_samples > 0 ? FAINT * sqrt(s->dark_variance) : -INFINITY;
    if (s->dark_samples > 0) {
        level[bins] = s->dark_level;
        square[bins] = s->dark_variance;
        count[bins++] = s->dark_samples;
    }
    for (int k = 0; k < NOISE_BINS; k++) {
        const struct noise_bin *b = &s->bin[k];
        r.samples += (long)b->n;
        if (b->n < 50 || b->level / b->n < faint)
            continue;
        level[bins] = b->level / b->n;
        square[bins] = s->model[0] > 0 ? b->square / b->n : median_variance(b);
        count[bins++] = b->n;
    }
    if (!s->pairs)
        return err_set(e, ERR_DATA,
                       "no two frames have the same exposure: photon transfer needs pairs");
    if (!r.samples)
        return err_set(e, ERR_DATA, "every pixel is saturated in every pair");
    struct line l = {0};
    const double span = bins ? level[bins - 1] - level[0] : 0;
    if (bins < 3 || span < 0.02 * (s->white - s->black) ||
        !fit_line(level, square, count, bins, &l))
        return err_set(
            e, ERR_DATA,
            "the signal spans only %.3g counts of %.4g: photon transfer needs light from "
            "dark to half of full scale",
            span, s->white - s->black);
    if (!(l.slope > 3 * l.slope_sigma))
        return err_set(e, ERR_DATA, "noise does not grow with the signal: not photon counts");
    r.gain = l.slope;
    r.gain_sigma = l.slope_sigma;
    r.read = sqrt(l.at0);
    r.read_sigma = l.at0 > 0 ? l.at0_sigma / (2 * r.read) : sqrt(l.at0_sigma);

    // common = 1.25 (offset pattern^2 + prnu^2 level^2); its error is that of a product of noises
    struct normal n;
    struct err ignored;
    double fit[2], inverse[2];
    normal_init(&n, 2);
    for (int k = 0; k < NOISE_BINS; k++) {
        const struct noise_bin *b = &s->bin[k];
        if (b->n < 50)
            continue;
        const double at = b->level / b->n, v = l.at0 + l.slope * fmax(at, 0);
        normal_add(&n, 2, (int[]){0, 1}, (double[]){1, at * at}, b->common / b->n / 1.25,
                   b->n / (v * v));
    }
    const bool ok = normal_solve(&n, fit, inverse, &ignored);
    normal_finish(&n);
    r.prnu = ok && fit[1] > 0 ? sqrt(fit[1]) : 0;
    r.prnu_sigma = r.prnu > 0 ? sqrt(inverse[1]) / (2 * r.prnu) : ok ? sqrt(sqrt(inverse[1])) : NAN;
    if (r.prnu > 0.05) // no sensor is so uneven: it is the scene
        r.prnu = r.prnu_sigma = NAN;
    record_init(&r.head, "noise", "this sensor at this gain (ISO)", r.gain_sigma / r.gain,
                "relative sigma of the gain");
    *out = r;
    return true;
}

bool noise_write(const struct noise *n, const char *command, const char *path, struct err *e)
{
    struct record_file rf;
    record_begin(&rf, &n->head, command);
    fprintf(rf.f,
            "gain: %.9g\ngain_sigma: %.3g\nread: %.9g\nread_sigma: %.3g\nblack: %.9g\nwhite: %.9g\n"
            "pairs: %d\nsamples: %ld\n",
            n->gain, n->gain_sigma, n->read, n->read_sigma, n->black, n->white, n->pairs,
            n->samples);
    if (!isnan(n->prnu))
        fprintf(rf.f, "prnu: %.6g\nprnu_sigma: %.3g\n", n->prnu, n->prnu_sigma);
    return record_end(&rf, path, e);
}

bool noise_read(struct noise *out, const char *path, struct err *e)
{
    struct yaml *y;
    struct noise n = {.prnu = NAN, .prnu_sigma = NAN};
    double samples = 0;
    if (!yaml_open(&y, path, e))
        return false;
    struct ynode *root = yaml_root(y);
    bool ok = record_read(&n.head, root, path, "noise", e) &&
              ymap_num(root, "gain", Y_NEEDED, UNIT_NONE, 1e-9, 1e9, &n.gain, e) &&
              ymap_num(root, "gain_sigma", Y_OPTIONAL, UNIT_NONE, 0, 1e9, &n.gain_sigma, e) &&
              ymap_num(root, "read", Y_NEEDED, UNIT_NONE, 0, 1e9, &n.read, e) &&
              ymap_num(root, "read_sigma", Y_OPTIONAL, UNIT_NONE, 0, 1e9, &n.read_sigma, e) &&
              ymap_num(root, "black", Y_NEEDED, UNIT_NONE, -1e9, 1e9, &n.black, e) &&
              ymap_num(root, "white", Y_NEEDED, UNIT_NONE, n.black, 1e9, &n.white, e) &&
              ymap_int(root, "pairs", Y_OPTIONAL, 0, 1000000, &n.pairs, e) &&
              ymap_num(root, "samples", Y_OPTIONAL, UNIT_NONE, 0, 1e15, &samples, e) &&
              ymap_num(root, "prnu", Y_OPTIONAL, UNIT_NONE, 0, 1, &n.prnu, e) &&
              ymap_num(root, "prnu_sigma", Y_OPTIONAL, UNIT_NONE, 0, 1, &n.prnu_sigma, e);
    n.samples = (long)samples;
    ok = yaml_close(y, ok, e) && ok;
    if (ok)
        *out = n;
    return ok;
}

// linearity.c - residuals of a line, by level.
#include "calib/linearity.h"
#include "calib/normal.h"
#include <math.h>

// Each pair has a share of its own (the light drifts): the line is fitted pair by pair, what it
// leaves is gathered by level.
void linearity_add(struct linearity_sums *out, const float *a, const float *b, size_t n,
                   double time_a, double time_b, double white)
{
    const double share = time_b / (time_a + time_b);
    struct {
        double n, s, b, bb;
    } bin[LINEARITY_BINS] = {0};
    for (size_t k = 0; k < n; k++) {
        const double s = (double)a[k] + (double)b[k], level = share * s;
        if (!(level >= 0 && level < 0.95 * white) || !((double)b[k] < white))
            continue;
        const int at = (int)(level / white * LINEARITY_BINS);
        bin[at].n++;
        bin[at].s += s;
        bin[at].b += (double)b[k] - level;
        bin[at].bb += ((double)b[k] - level) * ((double)b[k] - level);
    }
    struct normal line;
    struct err ignored;
    double fit[2];
    normal_init(&line, 2);
    for (int k = 0; k < LINEARITY_BINS; k++)
        if (bin[k].n > 20) {
            const double variance = bin[k].bb / bin[k].n + 1e-9 * white * white;
            normal_add(&line, 2, (int[]){0, 1}, (double[]){1, bin[k].s / bin[k].n},
                       bin[k].b / bin[k].n, bin[k].n / variance);
        }
    const bool ok = normal_solve(&line, fit, NULL, &ignored);
    normal_finish(&line);
    for (int k = 0; ok && k < LINEARITY_BINS; k++)
        if (bin[k].n > 20) {
            const double s = bin[k].s / bin[k].n, mean = bin[k].b / bin[k].n,
                         off = mean - fit[0] - fit[1] * s;
            out->n[k] += bin[k].n;
            out->level[k] += bin[k].n * share * s;
            out->off[k] += bin[k].n * off;
            out->square[k] += bin[k].bb - bin[k].n * mean * mean;
        }
    out->pairs += ok;
}

bool linearity_end(const struct linearity_sums *s, double white, struct linearity *out,
                   struct err *e)
{
    struct linearity l = {.white = white, .pairs = s->pairs};
    for (int k = 0; k < LINEARITY_BINS; k++) {
        if (s->n[k] == 0)
            continue;
        l.level[l.bins] = s->level[k] / s->n[k];
        l.off[l.bins] = s->off[k] / s->n[k] / white;
        l.sigma[l.bins] = sqrt(s->square[k]) / s->n[k] / white;
        l.worst = fmax(l.worst, fabs(l.off[l.bins]) - 3 * l.sigma[l.bins]);
        l.bins++;
    }
    if (l.bins < 4)
        return err_set(
            e, ERR_DATA,
            "only %d levels are seen unsaturated in two frames: a linearity check needs 4", l.bins);
    record_init(&l.head, "linearity", "this sensor at this gain (ISO)", l.worst,
                "departure from a line, of white");
    *out = l;
    return true;
}

bool linearity_write(const struct linearity *l, const char *command, const char *path,
                     struct err *e)
{
    struct record_file rf;
    record_begin(&rf, &l->head, command);
    fprintf(rf.f, "white: %.9g\npairs: %d\nworst: %.3g\n", l->white, l->pairs, l->worst);
    record_list(rf.f, "level", l->level, l->bins);
    record_list(rf.f, "off", l->off, l->bins);
    record_list(rf.f, "sigma", l->sigma, l->bins);
    return record_end(&rf, path, e);
}

// flat.c - a smooth surface through a photograph of an even target.
#include "calib/flat.h"
#include "calib/normal.h"
#include <math.h>
#include <string.h>

enum { ROUNDS = 4 };

static double place(double i, int n) // -1 to 1
{
    return n > 1 ? 2 * i / (n - 1) - 1 : 0;
}

double flat_at(const struct flat *f, int c, double i, double j)
{
    return poly_at(f->term[c], place(i, f->w), place(j, f->h));
}

// One channel; rms of the pixels used about the surface, relative.
static bool fit_channel(struct flat *f, const struct image *im, int c, double *rms, struct err *e)
{
    int at[POLY_TERMS];
    double m[POLY_TERMS], scale = 0;
    const int step = (int)sqrt((double)im->w * im->h / 250000) + 1; // smooth: some pixels do
    for (int k = 0; k < POLY_TERMS; k++)
        at[k] = k;
    for (int round = 0; round < ROUNDS; round++) {
        struct normal s;
        double squares = 0;
        long n = 0;
        normal_init(&s, POLY_TERMS);
        for (int j = 0; j < im->h; j += step)
            for (int i = 0; i < im->w; i += step) {
                const double x = place(i, im->w), y = place(j, im->h);
                const double v =
                    (double)im
                        ->px[((size_t)j * (size_t)im->w + (size_t)i) * (size_t)im->nc + (size_t)c];
                const double model = round ? poly_at(f->term[c], x, y) : v;
                const double off = v / model - 1;
                if (!isfinite(v) || (round && (!(model > 0) || fabs(off) > fmax(0.05, 3 * scale))))
                    continue;
                poly_terms(x, y, m);
                normal_add(&s, POLY_TERMS, at, m, v, 1);
                squares += off * off;
                n++;
            }
        scale = n ? sqrt(squares / (double)n) : 1;
        const bool ok = normal_solve(&s, f->term[c], NULL, e);
        normal_finish(&s);
        if (!ok)
            return err_set(e, ERR_DATA, "the target has too few usable pixels for a flat");
        if (round == 0)
            scale = 1;
    }
    *rms = scale;
    return true;
}

bool flat_fit(struct flat *out, const struct image *im, int nc, struct err *e)
{
    struct flat f = {.w = im->w, .h = im->h, .nc = nc};
    double worst = 0;
    if (im->w < 8 || im->h < 8 || nc < 1 || nc > FLAT_CHANNELS)
        return err_set(e, ERR_DATA, "a flat needs 8 x 8 pixels or more");
    for (int c = 0; c < nc; c++) {
        double rms = 0, lo = INFINITY, hi = 0;
        enum { GRID = 33 };
        if (!fit_channel(&f, im, c, &rms, e))
            return false;
        for (int k = 0; k < GRID * GRID; k++) {
            const double v = flat_at(&f, c, k % GRID * (im->w - 1) / (GRID - 1.0),
                                     (double)(k / GRID) * (im->h - 1) / (GRID - 1.0));
            lo = fmin(lo, v);
            hi = fmax(hi, v);
        }
        if (!(lo > 0))
            return err_set(e, ERR_DATA,
                           "the target is dark somewhere: a flat needs light everywhere");
        if (rms > 0.1)
            return err_set(e, ERR_DATA,
                           "the target is %.0f %% rms off any smooth surface: not an even target",
                           100 * rms);
        const double middle = flat_at(&f, c, 0.5 * (im->w - 1), 0.5 * (im->h - 1));
        for (int k = 0; k < POLY_TERMS; k++)
            f.term[c][k] /= middle;
        worst = fmax(worst, rms);
        f.corner = c ? f.corner : lo / hi;
    }
    record_init(&f.head, "flat", "this lens, aperture, focus and light", worst, "relative rms");
    record_from_image(&f.head, im);
    *out = f;
    return true;
}

bool flat_write(const struct flat *f, const char *command, const char *path, struct err *e)
{
    struct record_file rf;
    record_begin(&rf, &f->head, command);
    fprintf(rf.f, "channels: %d\ncorner: %.6g\n", f->nc, f->corner);
    for (int c = 0; c < f->nc; c++) {
        char key[24];
        snprintf(key, sizeof key, "term_%d", c);
        record_list(rf.f, key, f->term[c], POLY_TERMS);
    }
    return record_end(&rf, path, e);
}

bool flat_read(struct flat *out, const char *path, struct err *e)
{
    static const char *const keys[] = {"term_0", "term_1", "term_2", "term_3"};
    struct yaml *y;
    struct flat f = {0};
    if (!yaml_open(&y, path, e))
        return false;
    struct ynode *root = yaml_root(y);
    bool ok = record_read(&f.head, root, path, "flat", e) &&
              ymap_int(root, "channels", Y_NEEDED, 1, FLAT_CHANNELS, &f.nc, e) &&
              ymap_num(root, "corner", Y_OPTIONAL, UNIT_NONE, 0, 1, &f.corner, e);
    for (int c = 0; ok && c < f.nc; c++)
        ok = record_read_list(root, keys[c], -1e6, 1e6, f.term[c], POLY_TERMS, e);
    ok = ok && (f.head.w > 0 || err_set(e, ERR_DATA, "%s: a flat without its size", path));
    f.w = f.head.w;
    f.h = f.head.h;
    ok = yaml_close(y, ok, e) && ok;
    if (ok)
        *out = f;
    return ok;
}

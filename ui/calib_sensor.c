// calib_sensor.c - nacre calib dark, noise, response, flat: what a camera does to light.
#define _GNU_SOURCE
#include "calib/bracket.h"
#include "calib/dark.h"
#include "calib/flat.h"
#include "calib/linearity.h"
#include "calib/noise.h"
#include "calib/response_file.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/sort.h"
#include "process/exposure.h"
#include "ui/calib.h"
#include "ui/frames.h"
#include "ui/session_frames.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MANY = 1000 };

// --times into t[0..n), or -1: take the files' own.
static int given_times(const struct calib_args *a, int n, double *t, struct err *e)
{
    if (!strcmp(a->times, "exif"))
        return 0;
    const int count = cli_numbers(a->times, UNIT_S, t, MANY, e);
    if (count < 0) {
        err_in(e, "--times");
        return -1;
    }
    if (count != n) {
        err_set(e, ERR_DATA, "--times: %d times for %d frames", count, n);
        return -1;
    }
    return count;
}

static bool is_dark(const struct image *im, const char *path, struct err *e)
{
    enum { MOST = 10000 };
    float probe[MOST];
    double encoded = 0;
    if (im->nc != 1)
        return err_set(e, ERR_DATA, "%s: has %d channels, a sensor's counts have one", path,
                       im->nc);
    if (meta_num(&im->meta, "nacre.encoded", &encoded) && encoded > 0)
        return err_set(e, ERR_DATA, "%s: 8-bit pictures carry a curve: a dark record is of counts",
                       path);
    const size_t n = sorted_probe(im->px, (size_t)im->w * (size_t)im->h, probe, MOST);
    return (double)probe[n / 2] < 0.5 * file_white(im) ||
           err_set(e, ERR_DATA, "%s: half of its pixels are above %g, half of white: no dark frame",
                   path, 0.5 * file_white(im));
}

static bool dark_from_files(const struct calib_args *a, const struct cli *cli, struct dark *dark,
                            struct err *e)
{
    static double time_s[MANY];
    struct dark_sums sums = {0};
    struct image first = {0};
    const int given = given_times(a, cli->n, time_s, e);
    bool ok = given >= 0;
    for (int k = 0; ok && k < cli->n; k++) {
        const char *path = cli->operand[k];
        struct image im = {0};
        ok = image_read(&im, path, e) && image_check_finite(&im, path, e) &&
             is_dark(&im, path, e) &&
             (given || meta_num(&im.meta, "expTime", &time_s[k]) ||
              err_set(e, ERR_DATA, "%s: no exposure time inside: give --times T,..", path)) &&
             (time_s[k] > 0 ||
              err_set(e, ERR_DATA, "%s: exposure time %g s must be above 0", path, time_s[k])) &&
             (sums.frames || dark_begin(&sums, im.w, im.h, e)) &&
             ((im.w == sums.w && im.h == sums.h) ||
              err_set(e, ERR_DATA, "%s: is %d x %d pixels, but %s is %d x %d", path, im.w, im.h,
                      cli->operand[0], sums.w, sums.h));
        if (ok)
            dark_add(&sums, im.px, time_s[k]);
        if (ok && !first.px)
            first = im;
        else
            image_finish(&im);
    }
    if (ok && (ok = dark_end(&sums, dark, e)))
        record_from_image(&dark->head, &first);
    dark_drop(&sums);
    image_finish(&first);
    return ok;
}

bool calib_dark(const struct calib_args *a, struct cli *cli, struct err *e)
{
    struct dark d = {0};
    const bool session = cli->n == 1 && is_session(cli->operand[0]);
    bool ok = session ? session_dark_read(&d, cli->operand[0], e) : dark_from_files(a, cli, &d, e);
    if (ok && d.n_hot > (long)d.w * d.h / 20)
        ok = err_set(e, ERR_DATA,
                     "%s: %ld of %d pixels stand out: not dark frames of a working sensor",
                     cli->operand[0], d.n_hot, d.w * d.h);
    if (ok && dark_write(&d, cli->line, a->out, e)) {
        doc_int(cli->doc, "frames", d.frames);
        doc_num(cli->doc, "black", d.black_mean);
        doc_num(cli->doc, "read_noise", d.read_noise);
        doc_num(cli->doc, "dark_rate_per_s", d.exposures > 1 ? d.rate_median : NAN);
        doc_int(cli->doc, "hot_pixels", d.n_hot);
    } else {
        ok = false;
    }
    dark_finish(&d);
    return ok;
}

// The frames of a file list or of one bracket of a session, with times; black still inside.
static bool read_frames(const struct calib_args *a, const struct cli *cli, struct frames *f,
                        struct dark *session_dark, struct err *e)
{
    static double time_s[MANY];
    const struct session_choice choice = {a->light, a->filter, -1};
    *session_dark = (struct dark){0};
    if (cli->n == 1 && is_session(cli->operand[0]))
        return session_frames_read(f, session_dark, cli->operand[0], &choice, e);
    const int given = given_times(a, cli->n, time_s, e);
    if (given < 0 || !frames_read(f, cli->n, cli->operand, e))
        return false;
    for (int k = 0; k < f->n; k++) {
        if (given)
            f->time_s[k] = time_s[k];
        else if (f->printed_times)
            f->time_s[k] = exposure_snap(f->time_s[k]);
        if (!(f->time_s[k] > 0)) { // NAN too
            err_set(e, ERR_DATA, "%s: no exposure time inside: give --times T,..", f->path[k]);
            frames_finish(f);
            return false;
        }
    }
    return true;
}

// The dark to use: --dark, else the session's.
static bool get_dark(const struct calib_args *a, const struct frames *f, struct dark *d,
                     struct err *e)
{
    if (!a->dark)
        return true;
    dark_finish(d);
    return dark_read(d, a->dark, e) && frames_dark_fits(f, d, a->dark, e);
}

static double median_black(const struct frames *f, const struct calib_args *a, const struct dark *d)
{
    const struct meta_item *black = meta_find(&f->meta, "nacre.black");
    if (!isnan(a->black))
        return a->black;
    if (d->frames)
        return d->black_mean;
    return black && black->n ? black->num[0] : NAN;
}

// Frames of the same exposure in pairs: (0, 1), (2, 3), ... of each time.
static void add_pairs(struct noise_sums *s, const struct frames *f, const struct dark *d)
{
    bool used[BRACKET_MAX] = {false};
    for (int k = 0; k < f->n; k++)
        for (int m = k + 1; m < f->n && !used[k]; m++)
            if (!used[m] && fabs(log(f->time_s[k] / f->time_s[m])) < 1e-3) {
                used[k] = used[m] = true;
                noise_add(s, f->px[k], f->px[m], d->frames ? d->hot : NULL, f->w, f->h);
            }
}

static bool measure_noise(const struct frames *f, const struct dark *d, double black, double white,
                          struct noise *out, struct err *e)
{
    double model[2] = {0};
    for (int round = 0; round < 3; round++) { // by medians, then trimmed, then trimmed well
        struct noise_sums s = {.black = black, .white = white, .model = {model[0], model[1]}};
        if (d->frames) {
            s.dark_level = d->level;
            s.dark_variance = d->read_noise * d->read_noise;
            s.dark_samples = (double)d->frames * d->w * d->h;
        }
        add_pairs(&s, f, d);
        if (!noise_end(&s, out, e))
            return false;
        model[0] = out->read * out->read + 1e-12;
        model[1] = out->gain;
    }
    return true;
}

bool calib_noise(const struct calib_args *a, struct cli *cli, struct err *e)
{
    struct frames f = {0};
    struct dark d = {0};
    struct noise n;
    if (!read_frames(a, cli, &f, &d, e))
        return false;
    bool ok = get_dark(a, &f, &d, e);
    const double black = median_black(&f, a, &d), white = isnan(a->white) ? f.white : a->white;
    if (ok && f.code[0])
        ok = err_set(e, ERR_DATA, "%s: 8-bit pictures carry a curve: photon transfer is for counts",
                     f.path[0]);
    if (ok && f.nc != 1)
        ok = err_set(e, ERR_DATA, "%s: has %d channels, a sensor's counts have one", f.path[0],
                     f.nc);
    if (ok && isnan(black))
        ok = err_set(e, ERR_DATA, "%s: no black level inside: give --dark or --black", f.path[0]);
    if (ok && !(white > black && isfinite(white)))
        ok = err_set(e, ERR_DATA, "%s: no white level inside: give --white", f.path[0]);
    if (ok && !measure_noise(&f, &d, black, white, &n, e))
        ok = err_in(e, "%s", cli->operand[0]);
    if (ok) {
        record_settings(&n.head, &f.now);
        ok = noise_write(&n, cli->line, a->out, e);
    }
    if (ok) {
        doc_int(cli->doc, "pairs", n.pairs);
        doc_num(cli->doc, "gain", n.gain);
        doc_num(cli->doc, "gain_sigma", n.gain_sigma);
        doc_num(cli->doc, "electrons_per_count", 1 / n.gain);
        doc_num(cli->doc, "read", n.read);
        doc_num(cli->doc, "read_sigma", n.read_sigma);
        doc_num(cli->doc, "prnu", n.prnu);
        doc_num(cli->doc, "prnu_sigma", n.prnu_sigma);
        doc_num(cli->doc, "black", n.black);
        doc_num(cli->doc, "white", n.white);
    }
    dark_finish(&d);
    frames_finish(&f);
    return ok;
}

static bool check_linearity(const struct calib_args *a, struct frames *f, const struct dark *d,
                            struct cli *cli, struct err *e)
{
    struct linearity_sums sums = {0};
    struct linearity l;
    if (!frames_remove_black(f, d->frames ? d : NULL, a->dark ? a->dark : "dark", e))
        return false;
    const double white = isnan(a->white) ? f->saturation : a->white;
    if (!isfinite(white))
        return err_set(e, ERR_DATA, "%s: no white level inside: give --white", f->path[0]);
    for (int k = 0; k < f->n; k++) { // each frame against the next shorter one
        int below = -1;
        for (int m = 0; m < f->n; m++)
            if (f->time_s[m] < 0.99 * f->time_s[k] &&
                (below < 0 || f->time_s[m] > f->time_s[below]))
                below = m;
        if (below >= 0)
            linearity_add(&sums, f->px[below], f->px[k],
                          (size_t)f->w * (size_t)f->h * (size_t)f->nc, f->time_s[below],
                          f->time_s[k], white);
    }
    if (!linearity_end(&sums, white, &l, e))
        return err_in(e, "%s", f->path[0]);
    record_settings(&l.head, &f->now);
    if (!linearity_write(&l, cli->line, a->out, e))
        return false;
    doc_text(cli->doc, "kind", "linearity");
    doc_int(cli->doc, "levels", l.bins);
    doc_num(cli->doc, "worst", l.worst);
    return true;
}

static bool fit_response(const struct calib_args *a, struct frames *f, struct cli *cli,
                         struct err *e)
{
    struct response r;
    struct record rec;
    double log_scale[BRACKET_MAX] = {0}, scale[BRACKET_MAX];
    struct bracket b = {.n = f->n,
                        .w = f->w,
                        .h = f->h,
                        .nc = f->nc,
                        .code = (const uint8_t *const *)f->code,
                        .time_s = f->time_s};
    const bool robertson = !strcmp(a->method, "robertson");
    int p, q;
    if (exposure_same(f->time_s, f->n, &p, &q))
        return err_set(e, ERR_DATA, "%s and %s have the same exposure time, %.4g s", f->path[p],
                       f->path[q], f->time_s[p]);
    if (!(robertson ? response_robertson(&r, &b, e) : response_debevec(&r, &b, log_scale, e)))
        return err_in(e, "%s and %d more", f->path[0], f->n - 1);
    record_init(&rec, "response", "this camera's JPEGs with these picture settings", r.residual,
                "rms of ln X - ln E - ln t");
    record_settings(&rec, &f->now);
    rec.w = rec.h = 0; // a curve holds at any size and aperture
    rec.aperture = NAN;
    if (!response_write(&r, &rec, cli->line, a->out, e))
        return false;
    for (int k = 0; k < f->n; k++)
        scale[k] = exp(log_scale[k]);
    doc_text(cli->doc, "method", robertson ? "robertson" : "debevec");
    doc_int(cli->doc, "frames", f->n);
    doc_nums(cli->doc, "time_s", f->time_s, f->n);
    doc_nums(cli->doc, "scale", scale, f->n);
    doc_int(cli->doc, "pixels", r.pixels);
    doc_num(cli->doc, "residual", r.residual);
    return true;
}

bool calib_response(const struct calib_args *a, struct cli *cli, struct err *e)
{
    struct frames f = {0};
    struct dark d = {0};
    if (!read_frames(a, cli, &f, &d, e))
        return false;
    const bool ok = get_dark(a, &f, &d, e) &&
                    (f.code[0] ? fit_response(a, &f, cli, e) : check_linearity(a, &f, &d, cli, e));
    dark_finish(&d);
    frames_finish(&f);
    return ok;
}

bool calib_flat(const struct calib_args *a, struct cli *cli, struct err *e)
{
    struct image im = {0};
    struct flat flat;
    const char *path = cli->operand[0];
    if (cli->n != 1)
        return err_set(e, ERR_USAGE, "calib flat: takes one picture of an even target");
    double encoded = 0;
    bool ok = image_read(&im, path, e) && image_check_finite(&im, path, e);
    if (ok && meta_num(&im.meta, "nacre.encoded", &encoded) && encoded > 0)
        ok = err_set(e, ERR_DATA,
                     "%s: 8-bit pictures carry a curve: merge a bracket with nacre hdr", path);
    const int nc = image_channel_index(&im, "G") >= 0 ? 3 : 1;
    if (ok && !flat_fit(&flat, &im, nc, e))
        ok = err_in(e, "%s", path);
    ok = ok && flat_write(&flat, cli->line, a->out, e);
    if (ok) {
        doc_num(cli->doc, "residual", flat.head.residual);
        doc_num(cli->doc, "corner", flat.corner);
    }
    image_finish(&im);
    return ok;
}

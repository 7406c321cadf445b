// judge.c - the rules, in the order of what a person would look at first.
#define _GNU_SOURCE
#include "acquire/judge.h"
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double REPORTED_OFF =
    0.12; // a sixth of a stop: rounding; the report is then the truth
static const double MEASURED_OFF = 0.08; // lamps drift by less between shots
static const double BAND_OFF = 0.10;
static const double MUCH_SPILL = 0.05; // charge then runs to where no light was: no word on rows
static const double SIGMAS = 5;
static const double DARK_LIMIT = 0.01; // of full scale, the mean of a dark frame

__attribute__((format(printf, 3, 4))) static void say(struct session_frame *f, const char *verdict,
                                                      const char *fmt, ...)
{
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(f->reason, sizeof f->reason, fmt, ap);
    va_end(ap);
    snprintf(f->verdict, sizeof f->verdict, "%s", verdict);
}

static const char *time_text(int64_t ns, char *buf, size_t size)
{
    return quantity_text(1e-9 * (double)ns, UNIT_S, buf, size);
}

static bool lit_throughout(const struct session_frame *f, const struct cam_caps *c)
{
    if (!*f->step.light || !f->start_ns || !f->light_on_ns)
        return true;
    const int64_t end_ns = f->start_ns + c->row_ns * (c->h - 1) +
                           (f->reported_ns ? f->reported_ns : f->step.exposure_ns);
    return f->light_on_ns <= f->start_ns && f->light_off_ns >= end_ns;
}

static bool pixels_agree(struct session_frame *f, const struct judge_facts *in)
{
    const struct measure_ratio *m = in->ratio;
    char said[40], seen[40];
    const int64_t claimed = llround(1e9 * session_exposure_s(f));
    f->measured_ns = llround(m->ratio * (double)in->ratio_ns);
    f->measured_sigma = m->sigma;
    const double off = m->ratio * (double)in->ratio_ns / (double)claimed - 1;
    // A long frame that got too little light must fail as surely as a short one that got too much.
    const double apart = fmax(fabs(off), fabs(1 / fmax(1 + off, 1e-9) - 1));
    if (apart > MEASURED_OFF + SIGMAS * m->sigma) {
        say(f, "wrong-light", "pixels say %s of this light, the camera says %s",
            time_text(f->measured_ns, seen, sizeof seen), time_text(claimed, said, sizeof said));
        return false;
    }
    if (m->worst_last && m->spill < MUCH_SPILL &&
        fabs(m->worst - 1) > BAND_OFF + SIGMAS * m->worst_sigma) {
        say(f, "uneven", "rows %d to %d have %.2f of the light of the others", m->worst_first,
            m->worst_last, m->worst);
        return false;
    }
    return true;
}

static bool same_filter(const struct session_frame *f, const struct judge_facts *in)
{
    if (!in->other || !(in->own_residual > 0))
        return false;
    const double expect = session_exposure_s(f) * 1e9 / (double)in->other_ns;
    return in->other->sigma < 0.02 && // else nothing can be told
           fabs(in->other->ratio / expect - 1) < 0.02 + 2 * in->other->sigma &&
           in->other->residual < 1.2 * in->own_residual;
}

void judge(struct session_frame *f, const struct judge_facts *in)
{
    const struct cam_caps *c = in->caps;
    const struct session_step *s = &f->step;
    char said[40], asked[40];
    f->saturated = in->level->saturated;
    f->measured_ns = 0;
    f->measured_sigma = NAN;
    if (in->damaged)
        say(f, "damaged", "the camera marked it as damaged");
    else if (f->w != c->w || f->h != c->h)
        say(f, "damaged", "%d x %d pixels, not %d x %d", f->w, f->h, c->w, c->h);
    else if (in->duplicate)
        say(f, "duplicate", "the same counts as the frame before");
    else if (in->stale_first >= 0)
        say(f, "damaged", "rows %d to %d are those of the frame before", in->stale_first,
            in->stale_last);
    else if (f->reported_ns &&
             fabs((double)f->reported_ns / (double)s->exposure_ns - 1) > REPORTED_OFF)
        say(f, "wrong-exposure", "the camera exposed for %s, not %s",
            time_text(f->reported_ns, said, sizeof said),
            time_text(s->exposure_ns, asked, sizeof asked));
    else if (fabs(f->gain / s->gain - 1) > REPORTED_OFF)
        say(f, "wrong-exposure", "the camera used gain %g, not %g", f->gain, s->gain);
    else if (fabs(f->focus_per_m - s->focus_per_m) > 0.05 + 0.02 * fabs(s->focus_per_m)) // not NAN
        say(f, "wrong-focus", "the camera is focused at %g dioptres, not %g", f->focus_per_m,
            s->focus_per_m);
    else if (!lit_throughout(f, c))
        say(f, "light-missed",
            "light on %+.1f us and off %+.1f us from the exposure's start, first row",
            1e-3 * (double)(f->light_on_ns - f->start_ns),
            1e-3 * (double)(f->light_off_ns - f->start_ns));
    else if (s->kind == SESSION_DARK && in->level->mean > DARK_LIMIT * (f->white - f->black))
        say(f, "not-dark", "mean of %.1f counts above black", in->level->mean);
    else if (in->ratio && s->kind == SESSION_LIGHT && !pixels_agree(f, in))
        return;
    else if (same_filter(f, in))
        say(f, "same-filter", "the same picture as through the filter before");
    else
        say(f, "good", "%s", "");
}

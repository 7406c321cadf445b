// view_print.c - what the panels tell, as pairs of words: for them, and for a script's `print`.
#define _GNU_SOURCE
#include "core/units.h"
#include "ui/view.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>

typedef void fact_call(const char *name, const char *value);

static void say(fact_call *fact, const char *name, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static void say(fact_call *fact, const char *name, const char *format, ...)
{
    char text[200];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    fact(name, text);
}

static double degrees(double rad)
{
    return rad * 180 / M_PI;
}

static void say_orders(const struct spot *s, fact_call *fact)
{
    for (int k = 0; k < s->n_orders; k++)
        say(fact, k ? "" : "orders", "(%d, %d) at %.0f nm", s->order[k].m, s->order[k].n,
            1e9 * s->order[k].lambda_m);
    if (!s->n_orders)
        say(fact, "orders", "none up to %d of the pitch set", SPOT_HIGHEST);
}

static void say_direction(const struct spot *s, fact_call *fact)
{
    if (isnan(s->w))
        say(fact, "u, v", "%+.4f, %+.4f", s->u, s->v);
    else
        say(fact, "u, v, w", "%+.4f, %+.4f, %.4f", s->u, s->v, s->w);
    if (!isnan(s->angle_rad))
        say(fact, "angle", "%.2f° towards %.0f°", degrees(s->angle_rad), degrees(s->azimuth_rad));
    if (!isnan(s->in_rad))
        say(fact, "light, viewer", "%.1f°, %.1f° off the normal", degrees(s->in_rad),
            degrees(s->out_rad));
    if (isnan(s->purity))
        say(fact, "wavelength", "%.0f nm, as set", 1e9 * s->lambda_m);
    else
        say(fact, "wavelength", "%.0f nm, purity %.2f", 1e9 * s->lambda_m, s->purity);
    if (!isnan(s->pitch_m))
        say(fact, "implied pitch", "%.3g µm in first order", 1e6 * s->pitch_m);
    say_orders(s, fact);
}

void spot_text(const struct view *v, fact_call *fact)
{
    const struct spot *s = &v->spot;
    if (s->object)
        fact("on", s->object);
    if (isnan(s->u) || s->object)
        say(fact, "pixel", "%.0f, %.0f", floor(v->pixel[0]), floor(v->pixel[1]));
    if (!isnan(s->u))
        say_direction(s, fact);
    say(fact, "value", "%.4g  %.4g  %.4g", s->rgb[0], s->rgb[1], s->rgb[2]);
    if (isnan(s->sigma[0]))
        fact("sigma", "not known");
    else
        say(fact, "sigma", "%.2g  %.2g  %.2g", s->sigma[0], s->sigma[1], s->sigma[2]);
}

static double skipped(long done, long most)
{
    return most ? 100 * (1 - (double)done / (double)most) : 0;
}

static void say_live(const struct source *s, fact_call *fact)
{
    const struct live_status *l = live_status(s->live);
    if (!l->connected)
        fact("nacred", *l->why ? l->why : "not looked for yet");
    else
        say(fact, "nacred", "process %lld", (long long)l->pid);
    if (l->capture)
        say(fact, "capture", "%s, %d of %d frames", *l->state ? l->state : "running", l->done,
            l->planned);
    else if (l->connected)
        fact("capture", "none is running");
    if (*l->last)
        fact("last", l->last);
}

void source_text(const struct view *v, fact_call *fact)
{
    const struct source *s = &v->source;
    char text[40];
    if (s->is_live)
        say_live(s, fact);
    if (s->has_stats) {
        say(fact, "exposure", "%s", quantity_text(s->exposure_s, UNIT_S, text, sizeof text));
        say(fact, "clipped", "%.3f %%, brightest %.3f", 100 * s->stats.clipped, s->stats.brightest);
        say(fact, "focus", "%.3f", s->stats.focus);
    }
    if (s->reel.n)
        say(fact, "session", "%s, %d of %d frames", session_state_name[s->reel.report.state],
            s->reel.report.good, s->reel.planned);
    if (!isnan(s->cx))
        say(fact, "centre", "%.2f, %.2f px", s->cx, s->cy);
    if (s->level)
        say(fact, "table", "%d frames, level %d/%d, %.0f ms", s->frames, s->level,
            LUT_PREVIEW_LEVELS, 1e3 * s->seconds);
    else if (*s->trouble)
        fact("no table", s->trouble);
}

void work_text(const struct view *v, fact_call *fact)
{
    const struct stage *st = &v->stage;
    const struct stage_times *t = &st->times;
    say(fact, "picture", "%.1f ms", t->draw_ms);
    say(fact, "not shaded", "%.0f %%", skipped(st->work.shaded, st->work.shaded_most));
    say(fact, "not looked up", "%.0f %%", skipped(st->work.looked_up, st->work.looked_up_most));
    if (st->work.tables)
        say(fact, "tables", "%d of %d", st->work.tables_used, st->work.tables);
    if (!isnan(t->whole_ms))
        say(fact, "saved", "%.0f %% of %.1f ms", 100 * (1 - t->draw_ms / t->whole_ms), t->whole_ms);
    if (st->scene.surround && t->rooms)
        say(fact, "room", "%.0f ms; the camera costs 1/%.0f", t->room_ms, t->room_ms / t->draw_ms);
}

static void line(const char *name, const char *value)
{
    printf("%-16s %s\n", name, value);
}

void view_print(const struct view *v)
{
    printf("%-16s %s\n", "item", v->at >= 0 ? v->items.item[v->at]->name : "none");
    if (v->trouble[0])
        printf("%-16s %s\n", "trouble", v->trouble);
    if (v->note[0])
        printf("%-16s %s\n", "note", v->note);
    printf("%-16s %ld\n", "frames", v->frames);
    printf("%-16s %.2f ms\n", "window", v->drawn_ms);
    if (v->has_stage) {
        work_text(v, line);
        printf("%-16s %ld pictures, %ld rooms\n", "drawn", v->stage.times.draws,
               v->stage.times.rooms);
    }
    if (v->source.on)
        source_text(v, line);
    if (v->has_spot)
        spot_text(v, line);
    for (int k = 0; v->params && k < PARAMS; k++)
        if (v->params->v[k] < param_info[k].start || v->params->v[k] > param_info[k].start)
            printf("set.%-12s %g\n", param_info[k].name, v->params->v[k] / param_info[k].unit);
    fflush(stdout);
}

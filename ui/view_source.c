// view_source.c - new frames to the picture, their brackets to the growing table.
#define _GNU_SOURCE
#include "ui/view_source.h"
#include "core/log.h"
#include "render/display.h"
#include "ui/view.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { TABLE_SIZE = 256 };
static const double frame_s = 0.4; // of a replay

bool source_open(struct source *s, const char *socket, struct err *e)
{
    *s = (struct source){.lambda_m = NAN, .cx = NAN, .cy = NAN, .thinned = 1, .reel = {.at = -1}};
    if (socket && !live_open(&s->live, socket, e))
        return false;
    s->worker = worker_new(window_wake);
    return true;
}

void source_close(struct source *s)
{
    worker_free(s->worker);
    growth_finish(&s->growth);
    reel_finish(&s->reel);
    live_close(s->live);
    *s = (struct source){0};
}

// --- the picture ---

static void show_picture(struct view *v, struct image *im, int step)
{
    struct source *s = &v->source;
    const bool first = !v->picture.px;
    image_finish(&v->picture);
    v->picture = *im;
    v->picture_shown.white = 1;
    shown_upload(&v->picture_shown, im);
    stats_of(&s->stats, im, step);
    s->has_stats = true;
    const bool camera = s->reel.n > 0 && s->reel.at >= 0;
    s->thinned = camera ? fmax(1, round((double)s->reel.frame[s->reel.at].w / im->w)) : 1;
    if (first)
        view_choose_panes(v);
    v->stale = true;
}

static void want_table(struct view *v)
{
    struct source *s = &v->source;
    int group = 0;
    const int good = reel_bracket(&s->reel, s->reel.at, &group);
    s->order.frames = good < 2 ? 0 : good;
    s->order.group = group;
    snprintf(s->order.folder, sizeof s->order.folder, "%s", s->reel.folder);
    s->order.h_per_px = v->params->v[PARAM_H_PER_PX];
    s->order.size = TABLE_SIZE;
}

void source_go(struct view *v, int frame)
{
    struct source *s = &v->source;
    struct image im;
    struct err e;
    int step;
    if (frame < 0 || frame >= s->reel.n)
        return;
    s->reel.at = frame;
    s->exposure_s = session_exposure_s(&s->reel.frame[frame]);
    s->seq = s->reel.frame[frame].seq;
    if (reel_picture(&s->reel, frame, &im, &step, &e))
        show_picture(v, &im, step);
    else
        view_say(v, "%s", e.msg);
    want_table(v);
}

void source_step(struct view *v, int by)
{
    v->source.playing = false;
    source_go(v, v->source.reel.at + by);
}

void source_play(struct view *v)
{
    struct source *s = &v->source;
    s->playing = !s->playing && s->reel.n > 1;
    if (s->playing && s->reel.at == s->reel.n - 1)
        source_go(v, 0);
    s->next_s = now_s() + frame_s;
}

bool source_show(struct view *v, const char *folder, struct err *e)
{
    struct source *s = &v->source;
    s->on = true;
    s->is_live = !*folder;
    if (s->is_live)
        return s->live || err_set(e, ERR_USAGE, "no daemon was asked for: --connect");
    if (!reel_read(&s->reel, folder, e))
        return false;
    if (!s->reel.n)
        return err_set(e, ERR_DATA, "%s: the session has no frame yet", folder);
    source_go(v, s->reel.n - 1);
    return true;
}

void source_hide(struct view *v)
{
    struct source *s = &v->source;
    s->on = s->playing = s->has_stats = false;
    s->order.frames = 0;
    s->level = s->pitch_frames = 0;
    s->lambda_m = s->cx = s->cy = NAN;
    s->trouble[0] = 0;
    reel_finish(&s->reel);
}

// --- what has come ---

static void follow_session(struct view *v)
{
    struct source *s = &v->source;
    const struct live_status *l = live_status(s->live);
    struct err e;
    if (s->event == l->event)
        return;
    s->event = l->event;
    v->stale = true;
    if (l->session[0] && reel_read(&s->reel, l->session, &e)) {
        s->reel.at = s->reel.n - 1;
        want_table(v);
    }
}

static void look_at_live(struct view *v)
{
    struct source *s = &v->source;
    struct live_frame f;
    if (!live_turn(s->live) || !s->is_live)
        return;
    follow_session(v);
    if (live_take(s->live, &f)) {
        s->exposure_s = 1e-9 * (double)f.exposure_ns;
        s->seq = f.seq;
        show_picture(v, &f.im, f.pattern ? 2 : 1);
    }
}

static void take_table(struct view *v)
{
    struct source *s = &v->source;
    struct growth *g = worker_done(s->worker);
    struct err e;
    if (!g)
        return;
    v->stale = true;
    snprintf(s->trouble, sizeof s->trouble, "%.200s", g->ok ? "" : g->e.msg);
    if (!g->ok || !s->on || strcmp(g->order.folder, s->order.folder)) // of another item
        return;
    if (isnan(s->lambda_m))
        param_set(v->params, PARAM_LAMBDA, g->lambda_m);
    s->lambda_m = g->lambda_m;
    s->cx = g->cx;
    s->cy = g->cy;
    s->noise = g->noise;
    s->level = g->level;
    s->frames = g->order.frames;
    s->seconds = g->seconds;
    const bool first = !view_table(v);
    if (!v->has_stage || !stage_take_table(&v->stage, &g->table, &e)) {
        if (v->has_stage)
            snprintf(s->trouble, sizeof s->trouble, "%.200s", e.msg);
        return;
    }
    view_show_table(v);
    // Few frames are mostly noise; and somebody may have set another pitch meanwhile.
    if (first || (s->frames >= s->pitch_frames && v->params->v[PARAM_PITCH] == s->pitch_m)) {
        param_set(v->params, PARAM_PITCH, g->pitch_m);
        s->pitch_m = v->params->v[PARAM_PITCH];
        s->pitch_frames = s->frames;
    }
    if (first) {
        param_set(v->params, PARAM_KIND, DIFFRACTION_TABLE);
        view_choose_panes(v);
    }
}

static bool same_order(const struct growth_order *a, const struct growth_order *b)
{
    return !strcmp(a->folder, b->folder) && a->group == b->group && a->frames == b->frames &&
           fabs(a->h_per_px - b->h_per_px) < 1e-12 && a->size == b->size;
}

static void give_table(struct source *s)
{
    if (!s->on || !s->order.frames || worker_busy(s->worker))
        return;
    if (!same_order(&s->growth.order, &s->order)) {
        s->growth.order = s->order;
        s->growth.fresh = true;
    }
    if (!growth_is_done(&s->growth))
        worker_give(s->worker, growth_run, &s->growth);
}

void source_tick(struct view *v)
{
    struct source *s = &v->source;
    if (s->live)
        look_at_live(v);
    take_table(v);
    if (s->on && s->reel.n && fabs(s->order.h_per_px - v->params->v[PARAM_H_PER_PX]) > 1e-12)
        s->order.h_per_px = v->params->v[PARAM_H_PER_PX];
    if (s->playing && now_s() >= s->next_s) {
        source_go(v, s->reel.at + 1);
        s->next_s = now_s() + frame_s;
        s->playing = s->reel.at < s->reel.n - 1;
    }
    give_table(s);
}

double source_patience(const struct source *s)
{
    double due = s->live && s->is_live && s->on ? live_patience(s->live) : INFINITY;
    return s->playing ? fmin(due, fmax(0, s->next_s - now_s())) : due;
}

bool source_is_busy(struct source *s)
{
    return s->playing || worker_busy(s->worker) ||
           (s->on && s->order.frames &&
            (!same_order(&s->growth.order, &s->order) || !growth_is_done(&s->growth)));
}

double source_sigma(const struct source *s, double value)
{
    if (isnan(s->cx) || s->reel.at < 0)
        return NAN;
    const struct session_frame *f = &s->reel.frame[s->reel.at];
    const double counts = f->white - f->black;
    return sqrt(s->noise.read + s->noise.gain * fmax(0, value) * counts) / counts;
}

void source_center(const struct view *v, double *i, double *j, double *h_per_px)
{
    const struct source *s = &v->source;
    *i = isnan(s->cx) ? (v->picture.w - 1) / 2.0 : s->cx / s->thinned;
    *j = isnan(s->cy) ? (v->picture.h - 1) / 2.0 : s->cy / s->thinned;
    *h_per_px = v->params->v[PARAM_H_PER_PX] * s->thinned;
}

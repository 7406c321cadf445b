// view_run.c - steps of a script as events and verbs.
#define _GNU_SOURCE
#include "ui/view_run.h"
#include "core/log.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

bool run_is_over(const struct run *r)
{
    return r->next >= r->script.n;
}

double run_patience(const struct run *r, struct view *v)
{
    if (run_is_over(r))
        return INFINITY;
    if (r->until_s > 0)
        return fmax(0, r->until_s - now_s());
    return r->script.step[r->next].verb == SCRIPT_SETTLE && view_is_busy(v) ? INFINITY : 0;
}

static bool move(struct view *v, const struct script_step *s, struct err *e)
{
    struct event ev = {.kind = EVENT_MOUSE, .x = s->num[0] * v->scale, .y = s->num[1] * v->scale};
    if (s->pane[0]) {
        const int k = view_pane(v, s->pane);
        if (k < 0)
            return err_set(e, ERR_DATA, "line %d: no pane '%s' is shown", s->line, s->pane);
        const struct gui_rect r = v->layout.pane[k];
        ev.x = r.x + s->num[0] * r.w;
        ev.y = r.y + s->num[1] * r.h;
    }
    window_feed(v->window, &ev);
    return true;
}

static void press_key(struct view *v, const struct script_step *s)
{
    const struct event down = {.kind = EVENT_KEY, .key = s->key, .mods = s->mods, .down = true},
                       up = {.kind = EVENT_KEY, .key = s->key, .mods = s->mods};
    window_feed(v->window, &down);
    window_feed(v->window, &up);
}

static bool set(struct view *v, const struct script_step *s, struct err *e)
{
    const int k = param_find(s->text);
    if (k < 0)
        return err_set(e, ERR_DATA, "line %d: '%.40s' is not a parameter", s->line, s->text);
    if (v->params)
        param_set(v->params, (enum param)k, s->num[0] * param_info[k].unit);
    v->stale = true;
    return true;
}

static bool open_one(struct view *v, const struct script_step *s)
{
    struct err why;
    if (!view_add(v, s->text, &why)) // a person would read it and go on
        view_say(v, "%s", why.msg);
    return true;
}

static bool do_step(struct run *r, struct view *v, const struct script_step *s, struct err *e)
{
    const struct event button = {.kind = EVENT_BUTTON,
                                 .button = s->button,
                                 .down = s->verb == SCRIPT_PRESS},
                       wheel = {.kind = EVENT_WHEEL, .y = s->num[0]};
    switch (s->verb) {
    case SCRIPT_SIZE: window_resize(v->window, (int)s->num[0], (int)s->num[1]); return true;
    case SCRIPT_MOVE: return move(v, s, e);
    case SCRIPT_PRESS:
    case SCRIPT_RELEASE: window_feed(v->window, &button); return true;
    case SCRIPT_WHEEL: window_feed(v->window, &wheel); return true;
    case SCRIPT_KEY: press_key(v, s); return true;
    case SCRIPT_TYPE:
        for (const char *c = s->text; *c; c++)
            window_feed(v->window, &(struct event){.kind = EVENT_TEXT, .codepoint = (unsigned)*c});
        return true;
    case SCRIPT_SET: return set(v, s, e);
    case SCRIPT_SELECT: view_select(v, (int)s->num[0] - 1); return true;
    case SCRIPT_OPEN: return open_one(v, s);
    case SCRIPT_WAIT: r->until_s = now_s() + s->num[0]; return true;
    case SCRIPT_SETTLE: return true;
    case SCRIPT_SCREENSHOT: return view_screenshot(v, s->text, e);
    case SCRIPT_SAVE: return view_save(v, s->text, e);
    case SCRIPT_TURNTABLE: view_turntable(v, (int)s->num[0], s->text); return true;
    case SCRIPT_MEASURE: v->stale = true; return !v->has_stage || stage_measure(&v->stage, e);
    case SCRIPT_LOSE: v->stale = gl_lost = true; return true;
    case SCRIPT_PRINT: view_print(v); return true;
    case SCRIPT_QUIT: v->quit = true; return true;
    }
    return true;
}

bool run_step(struct run *r, struct view *v, struct err *e)
{
    if (run_is_over(r) || run_patience(r, v) > 0)
        return true;
    r->until_s = 0;
    return do_step(r, v, &r->script.step[r->next++], e);
}

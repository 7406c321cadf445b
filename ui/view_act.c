// view_act.c - what keys and mouse do.
#define _GNU_SOURCE
#include "ui/view.h"
#include "ui/view_orbit.h"
#include <math.h>

static void step_kind(struct view *v, enum param which)
{
    if (!v->has_stage)
        return;
    int k = (int)v->params->v[which];
    do
        k = (k + 1) % DIFFRACTION_KINDS;
    while (!stage_has(&v->stage, (enum diffraction)k));
    param_set(v->params, which, k);
}

static void step_tables(struct view *v, int by)
{
    const struct table *t = view_table(v);
    if (!t)
        return;
    const int now = (int)v->params->v[PARAM_TABLES] ? (int)v->params->v[PARAM_TABLES] : t->count;
    const int next = now + by < 1 ? 1 : now + by > t->count ? t->count : now + by;
    param_set(v->params, PARAM_TABLES, next);
    view_say(v, "%d of %d tables", next, t->count);
}

static void fit(struct view *v)
{
    static const enum param of_camera[] = {PARAM_YAW, PARAM_RISE, PARAM_DISTANCE, PARAM_PAN_X,
                                           PARAM_PAN_Y};
    for (size_t k = 0; k < sizeof of_camera / sizeof *of_camera; k++)
        v->params->v[of_camera[k]] = param_info[of_camera[k]].start;
    for (int k = 0; k < PANES; k++)
        v->fitted[k] = true;
}

static void undo(struct view *v, bool back)
{
    struct item *it = v->items.item[v->at];
    enum param what;
    if ((back ? undo_back : undo_forth)(&it->undo, v->params, &what))
        view_say(v, "%s: %s", back ? "undone" : "redone", param_info[what].name);
    else
        view_say(v, "nothing to %s", back ? "undo" : "redo");
}

static void shoot(struct view *v, bool whole)
{
    char path[300];
    struct err e;
    view_name_shot(path, sizeof path, whole ? "png" : "exr");
    if (whole ? view_screenshot(v, path, &e) : view_save(v, path, &e))
        view_say(v, "saved %s", path);
    else
        view_say(v, "%s", e.msg);
}

// The frames of a session, else the list.
static void step_list(struct view *v, int by)
{
    if (v->source.on && !v->source.is_live && v->wanted < 0)
        source_step(v, by);
    else
        view_select(v, (v->wanted >= 0 ? v->wanted : v->at) + by);
}

static void act_anywhere(struct view *v, enum action a, int which)
{
    switch (a) {
    case ACTION_SELECT: view_select(v, which - 1); break;
    case ACTION_NEXT: step_list(v, 1); break;
    case ACTION_PREVIOUS: step_list(v, -1); break;
    case ACTION_LIST_NEXT: view_select(v, (v->wanted >= 0 ? v->wanted : v->at) + 1); break;
    case ACTION_LIST_PREVIOUS: view_select(v, (v->wanted >= 0 ? v->wanted : v->at) - 1); break;
    case ACTION_PLAY:
        if (v->source.on && v->source.is_live && live_status(v->source.live)->capture)
            capture_hold(v->source.live);
        else if (v->source.on)
            source_play(v);
        break;
    case ACTION_CAPTURE: view_capture(v); break;
    case ACTION_ABORT:
        if (v->source.live)
            live_order(v->source.live, "capture.abort");
        break;
    case ACTION_PANELS: v->panels = !v->panels; break;
    case ACTION_HELP: v->help = !v->help; break;
    case ACTION_ESCAPE:
        v->help = false;
        v->turn_left = 0;
        v->source.playing = false;
        break;
    case ACTION_QUIT: v->quit = true; break;
    case ACTION_SCREENSHOT: shoot(v, true); break;
    default: break;
    }
}

static void act_on_item(struct view *v, enum action a)
{
    struct params *p = v->params;
    switch (a) {
    case ACTION_BRIGHTER: param_set(p, PARAM_EXPOSURE, p->v[PARAM_EXPOSURE] + 0.5); break;
    case ACTION_DARKER: param_set(p, PARAM_EXPOSURE, p->v[PARAM_EXPOSURE] - 0.5); break;
    case ACTION_OFFSET_UP: param_set(p, PARAM_OFFSET, p->v[PARAM_OFFSET] + 0.1); break;
    case ACTION_OFFSET_DOWN: param_set(p, PARAM_OFFSET, p->v[PARAM_OFFSET] - 0.1); break;
    case ACTION_FIT: fit(v); break;
    case ACTION_NORMALIZE: param_set(p, PARAM_EXPOSURE, view_exposure(v)); break;
    case ACTION_RESET:
        *p = params_start();
        if (v->has_stage)
            stage_params(&v->stage, p);
        if (!v->has_stage || isnan(v->stage.scene.exposure_ev))
            param_set(p, PARAM_EXPOSURE, view_exposure(v));
        fit(v);
        break;
    case ACTION_FALSE_COLOR: param_set(p, PARAM_LOOK, !(int)p->v[PARAM_LOOK]); break;
    case ACTION_COMPARE: param_set(p, PARAM_COMPARE, ((int)p->v[PARAM_COMPARE] + 1) % 3); break;
    case ACTION_KIND: step_kind(v, PARAM_KIND); break;
    case ACTION_AGAINST: step_kind(v, PARAM_AGAINST); break;
    case ACTION_FEWER_TABLES: step_tables(v, -1); break;
    case ACTION_MORE_TABLES: step_tables(v, 1); break;
    case ACTION_TABLE_PANE:
        v->table_pane = !v->table_pane;
        view_choose_panes(v);
        break;
    case ACTION_ORDERS: param_set(p, PARAM_ORDERS, !(int)p->v[PARAM_ORDERS]); break;
    case ACTION_PITCH_HERE:
        if (v->has_spot && param_set(p, PARAM_PITCH, v->spot.pitch_m))
            view_say(v, "pitch %.2f µm", 1e6 * p->v[PARAM_PITCH]);
        break;
    case ACTION_ZEBRA: param_set(p, PARAM_ZEBRA, !(int)p->v[PARAM_ZEBRA]); break;
    case ACTION_UNDO: undo(v, true); break;
    case ACTION_REDO: undo(v, false); break;
    case ACTION_SAVE_PICTURE: shoot(v, false); break;
    case ACTION_TURNTABLE: view_turntable(v, 72, "turntable"); break;
    default: break;
    }
}

void view_capture(struct view *v)
{
    struct live *l = v->source.live;
    if (!l || !live_status(l)->connected)
        view_say(v, "a capture needs nacred: nacre-view --connect auto, and nacred");
    else if (live_status(l)->capture)
        view_say(v, "a capture is running already");
    else
        capture_begin(&v->capture, l);
}

void view_act(struct view *v, enum action a, int which)
{
    act_anywhere(v, a, which);
    if (v->params && !v->trouble[0])
        act_on_item(v, a);
    v->stale = true;
}

static double split_x(const struct view *v, int pane)
{
    return v->layout.pane[pane].x + v->params->v[PARAM_SPLIT] * v->layout.pane[pane].w;
}

static void press(struct view *v, int button)
{
    const int pane = layout_pane_at(&v->layout, v->mouse.x, v->mouse.y);
    if (gui_wants_mouse() || pane < 0 || !v->params || v->mouse.button >= 0)
        return;
    v->mouse.button = button;
    v->mouse.pane = pane;
    v->mouse.on_split = v->pane[pane] == PANE_MATERIAL &&
                        (int)v->params->v[PARAM_COMPARE] == COMPARE_SPLIT &&
                        fabs(v->mouse.x - split_x(v, pane)) < 6 * v->scale;
}

static void drag(struct view *v, double dx, double dy)
{
    const struct mouse *m = &v->mouse;
    const struct gui_rect r = v->layout.pane[m->pane];
    if (m->on_split) {
        param_set(v->params, PARAM_SPLIT, (m->x - r.x) / r.w);
    } else if (v->pane[m->pane] != PANE_MATERIAL) {
        v->fitted[m->pane] = false;
        v->placing[m->pane].x -= dx / v->placing[m->pane].zoom;
        v->placing[m->pane].y -= dy / v->placing[m->pane].zoom;
    } else if (m->button == BUTTON_LEFT) {
        orbit_drag(v->params, dx / r.h, dy / r.h);
    } else if (m->button == BUTTON_RIGHT) {
        orbit_drag_light(v->params, dx / r.h, dy / r.h);
    } else {
        orbit_pan(v->params, dx / r.h, dy / r.h);
    }
}

static void wheel(struct view *v, double steps)
{
    const int pane = layout_pane_at(&v->layout, v->mouse.x, v->mouse.y);
    if (gui_wants_mouse() || pane < 0 || !v->params)
        return;
    if (v->pane[pane] == PANE_MATERIAL) {
        orbit_zoom(v->params, steps);
    } else {
        v->fitted[pane] = false;
        placing_zoom(&v->placing[pane], v->layout.pane[pane], v->mouse.x, v->mouse.y, steps);
    }
}

void view_event(struct view *v, const struct event *e)
{
    struct err why;
    int which = 0;
    v->stale = true;
    switch (e->kind) {
    case EVENT_MOUSE:
        gui_mouse(e->x, e->y);
        if (v->mouse.button >= 0) {
            const double dx = e->x - v->mouse.x, dy = e->y - v->mouse.y;
            v->mouse.x = e->x;
            v->mouse.y = e->y;
            drag(v, dx, dy);
        }
        v->mouse.x = e->x;
        v->mouse.y = e->y;
        break;
    case EVENT_BUTTON:
        gui_button(e->button, e->down);
        if (e->down)
            press(v, e->button);
        else if (e->button == v->mouse.button)
            v->mouse.button = -1;
        break;
    case EVENT_WHEEL:
        gui_wheel(e->y);
        wheel(v, e->y);
        break;
    case EVENT_KEY:
        gui_key(e->key, e->mods, e->down);
        if (e->down && !gui_wants_keys())
            view_act(v, key_action(e->key, e->mods, &which), which);
        break;
    case EVENT_TEXT: gui_text_in(e->codepoint); break;
    case EVENT_DROP:
        if (!view_add(v, e->path, &why))
            view_say(v, "%s", why.msg);
        break;
    }
}

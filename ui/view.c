// view.c - the window's state: what is shown, and how events change it.
#define _GNU_SOURCE
#include "ui/view.h"
#include "core/log.h"
#include "core/mem.h"
#include "render/display.h"
#include "ui/pitch.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const pane_kind_name[] = {"picture", "table", "material"};

bool view_open(struct view *v, struct window *w, const struct view_options *o, struct err *e)
{
    *v = (struct view){.window = w,
                       .scale = window_scale(w),
                       .options = *o,
                       .at = -1,
                       .wanted = -1,
                       .panels = true,
                       .mouse = {.x = -1, .y = -1, .button = -1, .pane = -1},
                       .stale = true};
    if (!gl_check(e) || !show_gl_open(&v->show, e))
        return false;
    v->loader = worker_new(window_wake);
    capture_order_init(&v->capture, o->rig, o->plan, o->sessions);
    return source_open(&v->source, o->connect, e);
}

static void drop_contents(struct view *v)
{
    if (v->has_stage)
        stage_close(&v->stage);
    v->has_stage = v->has_spot = false;
    source_hide(v);
    image_finish(&v->picture);
    v->picture = (struct image){0};
    shown_finish(&v->picture_shown);
    shown_finish(&v->table_shown);
}

void view_close(struct view *v)
{
    worker_free(v->loader);
    source_close(&v->source);
    capture_order_finish(&v->capture);
    drop_contents(v);
    show_gl_close(v->show);
    items_finish(&v->items);
}

void view_say(struct view *v, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(v->note, sizeof v->note, format, args);
    va_end(args);
    v->stale = true;
}

bool view_is_busy(struct view *v)
{
    return v->wanted >= 0 || worker_busy(v->loader) || v->turn_left > 0 ||
           source_is_busy(&v->source) || (v->has_stage && stage_is_busy(&v->stage, v->params));
}

double view_patience(const struct view *v)
{
    if (v->turn_left || gui_wants_frames())
        return 0;
    return fmin(source_patience(&v->source), v->has_stage ? stage_patience(&v->stage) : INFINITY);
}

static void load_next(struct view *v)
{
    struct err e;
    if (v->wanted < 0 || worker_busy(v->loader))
        return;
    v->at = v->wanted;
    v->wanted = -1;
    v->params = &v->items.item[v->at]->params;
    struct load *l = load_new(v->items.item[v->at], &v->options.scene, &e);
    if (l)
        worker_give(v->loader, load_run, l);
    else
        snprintf(v->trouble, sizeof v->trouble, "%s", e.msg);
    v->stale = true;
}

void view_lose(struct view *v)
{
    drop_contents(v);
    show_gl_close(v->show);
    v->show = NULL;
    v->layout.n_panes = 0;
}

bool view_return(struct view *v, struct err *e)
{
    if (!gl_check(e) || !show_gl_open(&v->show, e))
        return false;
    if (v->wanted < 0)
        v->wanted = v->at;
    load_next(v);
    view_say(v, "OpenGL lost its context; all was drawn anew");
    return true;
}

void view_select(struct view *v, int item)
{
    if (item < 0 || item >= v->items.n || (item == v->at && v->wanted < 0))
        return;
    v->wanted = item;
    v->note[0] = 0;
    load_next(v);
}

bool view_add(struct view *v, const char *path, struct err *e)
{
    const int before = v->items.n;
    if (!items_add(&v->items, path, e))
        return false;
    view_select(v, before);
    v->stale = true;
    return true;
}

const struct table *view_table(const struct view *v)
{
    if (!v->has_stage)
        return NULL;
    const struct table *t = &v->stage.scene.object[0].material.table;
    return t->n ? t : NULL;
}

void view_choose_panes(struct view *v)
{
    const enum item_kind kind = v->items.item[v->at]->kind;
    int n = 0;
    if (v->picture.px)
        v->pane[n++] = PANE_PICTURE;
    if (view_table(v) && (kind != ITEM_SCENE || v->table_pane))
        v->pane[n++] = PANE_TABLE;
    if (v->has_stage)
        v->pane[n++] = PANE_MATERIAL;
    v->layout.n_panes = n;
    for (int k = 0; k < PANES; k++)
        v->fitted[k] = true;
}

void view_show_table(struct view *v)
{
    const struct table *t = view_table(v);
    if (!t)
        return;
    const struct image first = {.w = t->n, .h = t->n, .nc = 3, .px = t->tab};
    v->table_shown.upwards = true;
    v->table_shown.power = t->power;
    shown_upload(&v->table_shown, &first);
    v->table_ev = display_exposure(&first);
}

// The exposure that suits the picture on top.
double view_exposure(struct view *v)
{
    const enum item_kind kind = v->items.item[v->at]->kind;
    if (kind != ITEM_SCENE && kind != ITEM_PICTURE)
        return 0; // every pane by its own
    if (v->has_stage)
        return v->stage.auto_exposure_ev;
    struct image rgb = v->picture;
    if (!rgb.px || rgb.nc != 3)
        return v->picture_shown.peak > 0 ? -log2(v->picture_shown.peak) : 0;
    return display_exposure(&rgb);
}

static bool take(struct view *v, struct load *l, struct err *e)
{
    if (!l->ok) {
        *e = l->e;
        return false;
    }
    struct item *it = v->items.item[v->at];
    v->picture = l->picture;
    l->picture = (struct image){0};
    if (v->picture.px)
        shown_upload(&v->picture_shown, &v->picture);
    v->has_stage = l->scene.n_objects > 0;
    if (v->has_stage && !stage_open(&v->stage, &l->scene, e))
        return v->has_stage = false;
    view_show_table(v);
    if ((it->kind == ITEM_SESSION || it->kind == ITEM_LIVE) && !source_show(v, it->path, e))
        return false;
    if (it->visited)
        return true;
    it->visited = true;
    if (v->has_stage) {
        stage_params(&v->stage, v->params);
        if (view_table(v) && !isnan(pitch_of_table(view_table(v))))
            param_set(v->params, PARAM_PITCH, pitch_of_table(view_table(v)));
    }
    if (it->kind != ITEM_SCENE || isnan(v->stage.scene.exposure_ev))
        v->params->v[PARAM_EXPOSURE] = NAN; // chosen when it has been drawn
    it->first_ev = v->params->v[PARAM_EXPOSURE];
    return true;
}

static void finish_load(struct view *v)
{
    struct load *l = worker_done(v->loader);
    struct err e;
    if (!l)
        return;
    drop_contents(v);
    v->trouble[0] = 0;
    if (!take(v, l, &e))
        snprintf(v->trouble, sizeof v->trouble, "%s", e.msg);
    load_free(l);
    view_choose_panes(v);
    v->stale = true;
    load_next(v);
}

void view_tick(struct view *v)
{
    finish_load(v);
    load_next(v);
    source_tick(v);
    if (v->has_stage && stage_tick(&v->stage, v->params))
        v->stale = true;
    if (gui_wants_frames())
        v->stale = true;
}

// Stops on top of the exposure that is set: a scene's picture and a file are shown with just that;
// where quantities of different kinds stand side by side, each with what suits it.
static double pane_ev(const struct view *v, enum pane_kind pane)
{
    const struct item *it = v->items.item[v->at];
    const bool scene = it->kind == ITEM_SCENE;
    switch (pane) {
    case PANE_TABLE: return v->table_ev - (scene ? it->first_ev : 0);
    case PANE_MATERIAL: return scene ? 0 : v->stage.auto_exposure_ev;
    case PANE_PICTURE: break;
    }
    return 0;
}

static void draw_pane(struct view *v, int k, int high)
{
    const struct gui_rect r = v->layout.pane[k];
    struct shown material, *s = v->pane[k] == PANE_TABLE ? &v->table_shown : &v->picture_shown;
    if (v->pane[k] == PANE_MATERIAL) {
        stage_show(&v->stage, &material, v->params);
        s = &material;
    }
    s->ev = pane_ev(v, v->pane[k]);
    show_gl_draw(v->show, s, &v->placing[k], r, high, v->params);
}

// While a slow scene is being dragged a ninth of its pixels must do.
static bool draws_coarsely(const struct view *v)
{
    const double slow_ms = 80;
    return (v->mouse.button >= 0 || gui_is_held()) && v->fine_ms > slow_ms;
}

static bool draw_material(struct view *v, struct gui_rect r, struct err *e)
{
    const bool coarse = draws_coarsely(v);
    const int part = coarse ? 3 : 1;
    if (!stage_draw(&v->stage, v->params, (int)r.w / part, (int)r.h / part, e))
        return false;
    v->fine_ms = coarse ? v->fine_ms : v->stage.times.draw_ms;
    return true;
}

static void place(struct view *v, int k)
{
    const struct gui_rect r = v->layout.pane[k];
    const struct shown *s = v->pane[k] == PANE_TABLE ? &v->table_shown : &v->picture_shown;
    if (v->pane[k] == PANE_MATERIAL)
        v->placing[k] = placing_fit(r, v->stage.target.w, v->stage.target.h);
    else if (v->fitted[k])
        v->placing[k] = placing_fit(r, s->w, s->h);
}

static void draw_panes(struct view *v, int high)
{
    struct err e;
    for (int k = 0; k < v->layout.n_panes; k++) {
        if (v->pane[k] == PANE_MATERIAL && !draw_material(v, v->layout.pane[k], &e)) {
            snprintf(v->trouble, sizeof v->trouble, "%s", e.msg);
            return;
        }
        place(v, k);
    }
    if (isnan(v->params->v[PARAM_EXPOSURE])) {
        v->params->v[PARAM_EXPOSURE] = 0;
        param_set(v->params, PARAM_EXPOSURE, view_exposure(v));
        v->items.item[v->at]->first_ev = v->params->v[PARAM_EXPOSURE];
        undo_start(&v->items.item[v->at]->undo, v->params);
    }
    view_look(v);
    for (int k = 0; k < v->layout.n_panes; k++)
        draw_pane(v, k, high);
}

void view_draw(struct view *v)
{
    static double last_s;
    int w, h;
    const double start_s = now_s();
    window_size(v->window, &w, &h);
    layout_make(&v->layout, w, h, v->scale, v->panels, v->layout.n_panes);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, w, h);
    glClearColor(0.045f, 0.047f, 0.05f, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    if (v->params && !v->trouble[0] && v->layout.n_panes)
        draw_panes(v, h);
    gui_begin(w, h, start_s - last_s);
    last_s = start_s;
    view_over(v);
    view_panels(v);
    gui_end();
    glFinish();
    v->drawn_ms = 1e3 * (now_s() - start_s);
    v->frames++;
    v->stale = false;
    if (v->params && v->mouse.button < 0 && !gui_is_held() && !isnan(v->params->v[PARAM_EXPOSURE]))
        undo_note(&v->items.item[v->at]->undo, v->params);
}

int view_pane(const struct view *v, const char *name)
{
    for (int k = 0; k < v->layout.n_panes; k++)
        if (!strcmp(pane_kind_name[v->pane[k]], name))
            return k;
    return -1;
}

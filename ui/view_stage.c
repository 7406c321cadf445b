// view_stage.c - from parameters to a scene, from a scene to a picture.
#define _GNU_SOURCE
#include "ui/view_stage.h"
#include "core/log.h"
#include "core/mem.h"
#include "render/display.h"
#include "render/relight.h"
#include "render/view.h"
#include "ui/room.h"
#include "ui/view_orbit.h"
#include "ui/window.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool copy_image(struct image *to, const struct image *from, struct err *e)
{
    if (!image_init(to, from->w, from->h, from->nc, e))
        return false;
    memcpy(to->px, from->px,
           (size_t)from->w * (size_t)from->h * (size_t)from->nc * sizeof *from->px);
    return true;
}

bool stage_has(const struct stage *st, enum diffraction kind)
{
    const struct material *m = &st->scene.object[0].material;
    const bool has[] = {true, m->table.n > 0 || m->photo, m->slits.n > 0, m->rainbow.spacing_m > 0};
    return has[kind];
}

void stage_params(const struct stage *st, struct params *p)
{
    const struct material *m = &st->scene.object[0].material;
    p->v[PARAM_KIND] = (double)m->diffraction;
    p->v[PARAM_AGAINST] = DIFFRACTION_NONE;
    for (int k = DIFFRACTION_KINDS - 1; k > 0; k--)
        if (k != (int)m->diffraction && stage_has(st, (enum diffraction)k))
            p->v[PARAM_AGAINST] = k;
    p->v[PARAM_TABLES] = m->tables_used;
    p->v[PARAM_GAIN] = m->gain;
    p->v[PARAM_ROUGHNESS] = m->roughness;
    if (m->slits.n)
        p->v[PARAM_PITCH] = m->slits.row[0].pitch_m;
    else if (m->rainbow.spacing_m > 0)
        p->v[PARAM_PITCH] = m->rainbow.spacing_m;
    if (!isnan(st->scene.exposure_ev))
        p->v[PARAM_EXPOSURE] = st->scene.exposure_ev;
}

bool stage_open(struct stage *out, struct scene *s, struct err *e)
{
    struct stage st = {
        .scene = *s, .camera = s->camera, .times = {.whole_ms = NAN}, .auto_exposure_ev = NAN};
    *s = (struct scene){0};
    st.light = xcalloc((size_t)st.scene.n_lights + 1, sizeof *st.light);
    for (int k = 0; k < st.scene.n_lights; k++)
        st.light[k] = st.scene.light[k];
    if ((st.scene.surround && !copy_image(&st.room, &st.scene.surround->env.map, e)) ||
        !gl_renderer_open(&st.renderer, &st.scene, e)) {
        stage_close(&st);
        return false;
    }
    if (st.scene.surround)
        st.worker = worker_new(window_wake);
    const char *light = meta_text(&st.scene.object[0].material.table.meta, "nacre.illuminant");
    snprintf(st.own_spectrum, sizeof st.own_spectrum, "%s", light ? light : "E");
    *out = st;
    return true;
}

void stage_close(struct stage *st)
{
    relight_close(st->relight);
    if (st->worker) { // it reads the scene
        while (worker_busy(st->worker))
            room_free(worker_wait(st->worker));
        worker_free(st->worker);
    }
    gl_renderer_close(st->renderer);
    gl_target_finish(&st->target);
    gl_target_finish(&st->other);
    image_finish(&st->room);
    free(st->light);
    scene_finish(&st->scene);
    *st = (struct stage){0};
}

bool stage_take_table(struct stage *st, struct table *t, struct err *e)
{
    struct material *m = &st->scene.object[0].material;
    material_take_table(m, t, NAN);
    image_finish(&st->scene.object[0].seen);
    st->scene.object[0].seen = (struct image){0};
    lobes_finish(&st->scene.object[0].lobes[DIFFRACTION_TABLE]);
    st->is_drawn = false;
    st->auto_exposure_ev = NAN;
    return scene_prefilter(&st->scene, e) && gl_renderer_surround(st->renderer, &st->scene, e) &&
           gl_renderer_materials(st->renderer, &st->scene, e);
}

static void take_room(struct stage *st, struct room *r)
{
    struct err e;
    if (r->ok) {
        room_move(r, &st->scene);
        st->times.room_ms = r->ms;
        st->times.rooms++;
        st->is_drawn = false;
        r->ok = gl_renderer_surround(st->renderer, &st->scene, &e);
    }
    room_free(r);
}

static bool wants_room(const struct stage *st, const struct params *p)
{
    return st->worker &&
           fabs(p->v[PARAM_ROOM_TURN] - st->room_turn) + fabs(p->v[PARAM_ROOM_EV] - st->room_ev) >
               1e-9;
}

static bool wants_spectrum(const struct stage *st, const struct params *p)
{
    return fabs(p->v[PARAM_SPECTRUM] - st->spectrum) > 0.5;
}

static bool tick_room(struct stage *st, const struct params *p)
{
    struct room *done = worker_done(st->worker);
    if (done)
        take_room(st, done);
    if (wants_room(st, p) && !worker_busy(st->worker)) {
        st->room_turn = p->v[PARAM_ROOM_TURN];
        st->room_ev = p->v[PARAM_ROOM_EV];
        worker_give(st->worker, room_run,
                    room_new(&st->scene, &st->room, st->room_turn, st->room_ev));
    }
    return done != NULL;
}

static bool tick_spectrum(struct stage *st, const struct params *p)
{
    struct err e;
    if (wants_spectrum(st, p)) {
        const char *name =
            (int)p->v[PARAM_SPECTRUM] ? param_choice(p, PARAM_SPECTRUM) : st->own_spectrum;
        relight_close(st->relight);
        st->relight = NULL;
        st->spectrum = p->v[PARAM_SPECTRUM];
        relight_open(&st->relight, &st->scene, name, &e);
    }
    if (!st->relight)
        return false;
    const bool news = relight_take(st->relight, &st->scene);
    if (news) {
        gl_renderer_materials(st->renderer, &st->scene, &e);
        gl_renderer_surround(st->renderer, &st->scene, &e);
        st->is_drawn = false;
    }
    if (relight_done(st->relight, &e)) {
        relight_close(st->relight);
        st->relight = NULL;
    }
    return news;
}

// One at a time: each reads what the other replaces.
bool stage_tick(struct stage *st, const struct params *p)
{
    bool news = false;
    if (st->worker && !st->relight)
        news = tick_room(st, p);
    if (!st->worker || !worker_busy(st->worker))
        news = tick_spectrum(st, p) || news;
    return news;
}

double stage_patience(const struct stage *st)
{
    return st->relight ? 0.03 : INFINITY;
}

bool stage_is_busy(struct stage *st, const struct params *p)
{
    return (st->worker && worker_busy(st->worker)) || st->relight || wants_room(st, p) ||
           wants_spectrum(st, p);
}

static void place(struct stage *st, const struct params *p)
{
    struct scene *s = &st->scene;
    struct material *m = &s->object[0].material;
    s->camera = orbit_camera(&st->camera, p);
    for (int k = 0; k < s->n_lights; k++)
        s->light[k] = orbit_light(&st->light[k], &st->camera, p);
    m->gain = p->v[PARAM_GAIN];
    m->roughness = p->v[PARAM_ROUGHNESS];
    m->tables_used = (int)p->v[PARAM_TABLES];
}

static enum diffraction allowed(const struct stage *st, double kind)
{
    return stage_has(st, (enum diffraction)kind) ? (enum diffraction)kind : DIFFRACTION_NONE;
}

static bool fit_target(struct gl_target *t, int w, int h, struct err *e)
{
    if (t->frame && t->w == w && t->h == h)
        return true;
    gl_target_finish(t);
    return gl_target_init(t, w, h, e);
}

static bool draw_kind(struct stage *st, enum diffraction kind, const struct gl_target *t,
                      struct err *e)
{
    st->scene.object[0].material.diffraction = kind;
    return gl_renderer_draw(st->renderer, &st->scene, t, e);
}

static bool draw(struct stage *st, const struct params *p, struct err *e)
{
    const double start_s = now_s();
    const enum diffraction kind = allowed(st, p->v[PARAM_KIND]);
    if ((int)p->v[PARAM_COMPARE] != COMPARE_NONE &&
        !(fit_target(&st->other, st->target.w, st->target.h, e) &&
          draw_kind(st, allowed(st, p->v[PARAM_AGAINST]), &st->other, e)))
        return false;
    if (!draw_kind(st, kind, &st->target, e))
        return false;
    glFinish();
    st->times.draw_ms = 1e3 * (now_s() - start_s);
    st->times.draws++;
    st->work = gl_renderer_work(st->renderer, &st->scene, &st->target);
    return true;
}

bool stage_draw(struct stage *st, const struct params *p, int w, int h, struct err *e)
{
    const int cost = st->is_drawn ? params_differ(&st->drawn, p, NULL) : COST_DRAW;
    if (cost < COST_DRAW && st->target.w == w && st->target.h == h)
        return true;
    place(st, p);
    if (!fit_target(&st->target, w, h, e) || !draw(st, p, e))
        return false;
    st->drawn = *p;
    st->is_drawn = true;
    if (!isnan(st->auto_exposure_ev))
        return true;
    struct image im;
    if (!stage_read(st, &im, e))
        return false;
    st->auto_exposure_ev = display_exposure(&im);
    image_finish(&im);
    return true;
}

bool stage_measure(struct stage *st, struct err *e)
{
    gl_renderer_skip(st->renderer, false);
    const bool ok = draw(st, &st->drawn, e) && draw(st, &st->drawn, e);
    gl_renderer_skip(st->renderer, true);
    st->times.whole_ms = st->times.draw_ms;
    return ok && draw(st, &st->drawn, e);
}

void stage_show(struct stage *st, struct shown *s, const struct params *p)
{
    const bool scaled =
        (int)p->v[PARAM_LOOK] == LOOK_FALSE || (int)p->v[PARAM_COMPARE] == COMPARE_DIFFERENCE;
    struct err ignored;
    struct image im;
    *s = (struct shown){.texture = st->target.color,
                        .other = (int)p->v[PARAM_COMPARE] ? st->other.color : 0,
                        .w = st->target.w,
                        .h = st->target.h,
                        .power = 1};
    if (scaled && stage_read(st, &im, &ignored)) {
        s->peak = view_peak(&im);
        image_finish(&im);
    }
}

void stage_pixel(const struct stage *st, int i, int j, double rgb[3])
{
    float px[3] = {0};
    glBindFramebuffer(GL_FRAMEBUFFER, st->target.frame);
    glReadPixels(i, j, 1, 1, GL_RGB, GL_FLOAT, px);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    for (int c = 0; c < 3; c++)
        rgb[c] = (double)px[c];
}

bool stage_read(const struct stage *st, struct image *out, struct err *e)
{
    const bool ok = gl_target_read(&st->target, out, e);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return ok;
}

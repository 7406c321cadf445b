// view_panels.c - the list, the settings, the readout, the help: all from tables.
#define _GNU_SOURCE
#include "core/units.h"
#include "ui/view.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static void fact(const char *name, const char *value)
{
    gui_fact(name, value);
}

static void list_panel(struct view *v)
{
    if (!gui_panel("list", v->layout.list, false)) {
        gui_panel_end();
        return;
    }
    const int chosen = v->wanted >= 0 ? v->wanted : v->at;
    enum item_kind last = (enum item_kind) - 1;
    for (int k = 0; k < v->items.n; k++) {
        const struct item *it = v->items.item[k];
        char line[300];
        if (it->kind != last) {
            gui_space();
            gui_note(item_kind_name[it->kind]);
        }
        last = it->kind;
        char digit[16] = "\u2007"; // as wide as a digit
        if (k < 9)
            snprintf(digit, sizeof digit, "%d", k + 1);
        snprintf(line, sizeof line, "%s  %s##%d", digit, it->name, k);
        if (gui_pick(line, k == chosen))
            view_select(v, k);
        gui_hint(*it->path ? it->path : it->name);
    }
    if (!v->items.n)
        gui_note("Drop files here: scenes, tables, pictures, sessions.");
    gui_panel_end();
}

static void slider(struct view *v, enum param k)
{
    const struct param_info *i = &param_info[k];
    double shown = v->params->v[k] / i->unit;
    int choice = (int)v->params->v[k];
    if (i->choices
            ? gui_choice(i->label, i->choices, &choice)
            : gui_number(i->label, &shown, i->lo / i->unit, i->hi / i->unit, i->format, i->log))
        param_set(v->params, k, i->choices ? choice : shown * i->unit);
}

static void flag(struct view *v, enum param k, const char *label)
{
    bool on = v->params->v[k] > 0;
    if (gui_check(label, &on))
        param_set(v->params, k, on);
}

static void mouse_section(struct view *v)
{
    if (!gui_section("Under the mouse", true))
        return;
    if (v->has_spot)
        spot_text(v, fact);
    else
        gui_note("Point at a table or a picture.");
}

static void picture_section(struct view *v)
{
    if (!gui_section("Picture", true))
        return;
    slider(v, PARAM_EXPOSURE);
    slider(v, PARAM_OFFSET);
    slider(v, PARAM_LOOK);
    if (v->has_stage) {
        slider(v, PARAM_COMPARE);
        if (v->params->v[PARAM_COMPARE] > 0)
            slider(v, PARAM_AGAINST);
    }
    if (v->params->v[PARAM_LOOK] > 0 || (int)v->params->v[PARAM_COMPARE] == COMPARE_DIFFERENCE)
        slider(v, PARAM_DECADES);
    flag(v, PARAM_ORDERS, "predicted orders");
    if (v->params->v[PARAM_ORDERS] > 0 || v->layout.n_panes > 1)
        slider(v, PARAM_PITCH);
    if (v->params->v[PARAM_ORDERS] > 0)
        slider(v, PARAM_LAMBDA);
}

static void sample_section(struct view *v)
{
    const struct material *m = &v->stage.scene.object[0].material;
    if (!gui_section("Sample", !v->source.on))
        return;
    slider(v, PARAM_KIND);
    if (!stage_has(&v->stage, (enum diffraction)v->params->v[PARAM_KIND]))
        gui_warn("The sample has nothing of this kind.");
    if (m->table.count > 1) {
        int n = (int)v->params->v[PARAM_TABLES];
        n = n ? n : m->table.count;
        if (gui_whole("tables", &n, 1, m->table.count))
            param_set(v->params, PARAM_TABLES, n);
    }
    slider(v, PARAM_GAIN);
    if (material_has_specular(m))
        slider(v, PARAM_ROUGHNESS);
}

static void place_section(struct view *v)
{
    if (!gui_section("Camera and light", !v->source.on))
        return;
    slider(v, PARAM_YAW);
    slider(v, PARAM_RISE);
    slider(v, PARAM_DISTANCE);
    if (v->stage.scene.n_lights) {
        slider(v, PARAM_LIGHT_YAW);
        slider(v, PARAM_LIGHT_PITCH);
        slider(v, PARAM_LIGHT_EV);
    }
    slider(v, PARAM_SPECTRUM);
    if (v->stage.scene.surround) {
        slider(v, PARAM_ROOM_TURN);
        slider(v, PARAM_ROOM_EV);
    }
}

static void work_section(struct view *v)
{
    struct err e;
    if (!gui_section("Work", !v->source.on))
        return;
    work_text(v, fact);
    if (gui_press("measure what skipping saves") && !stage_measure(&v->stage, &e))
        view_say(v, "%s", e.msg);
}

// Frames of a session: the newest are what a person looks for.
static void frame_list(struct view *v)
{
    static const char *const kinds[] = {"", ", dark", ", meter"};
    struct source *s = &v->source;
    for (int k = 0; k < s->reel.n; k++) {
        const struct session_frame *f = &s->reel.frame[k];
        char line[200], time[32];
        quantity_text(session_exposure_s(f), UNIT_S, time, sizeof time);
        snprintf(line, sizeof line, "%d  %s%s%s  %s%s##f%d", f->id, time,
                 *f->step.filter ? ", " : "", f->step.filter, f->verdict, kinds[f->step.kind], k);
        if (gui_pick(line, k == s->reel.at)) {
            s->playing = false;
            source_go(v, k);
        }
        if (*f->reason)
            gui_hint(f->reason);
    }
}

static void live_buttons(struct view *v)
{
    struct live *l = v->source.live;
    const struct live_status *s = live_status(l);
    if (!s->connected)
        return;
    if (!s->capture) {
        gui_choice("plan", v->capture.names, &v->capture.at);
        if (gui_press("capture"))
            view_capture(v);
        return;
    }
    if (gui_press(strcmp(s->state, "paused") ? "pause" : "continue"))
        capture_hold(l);
    gui_beside();
    if (gui_press("stop"))
        live_order(l, "capture.abort");
}

static void camera_section(struct view *v)
{
    struct source *s = &v->source;
    if (!gui_section(s->is_live ? "Camera" : "Frame", true))
        return;
    source_text(v, fact);
    if (s->is_live)
        live_buttons(v);
    if (s->has_stats)
        gui_curve(s->stats.bin, STATS_BINS, 1, 60 * v->scale);
    flag(v, PARAM_ZEBRA, "stripes where it clips");
    slider(v, PARAM_H_PER_PX);
}

static void session_section(struct view *v)
{
    struct source *s = &v->source;
    int at = s->reel.at + 1;
    if (!s->reel.n || !gui_section("Session", true))
        return;
    if (gui_whole("frame", &at, 1, s->reel.n)) {
        s->playing = false;
        source_go(v, at - 1);
    }
    if (gui_press(s->playing ? "stop" : "replay"))
        source_play(v);
    if (!s->is_live)
        frame_list(v);
}

static void side_panel(struct view *v)
{
    if (gui_panel("side", v->layout.side, false) && v->params && !v->trouble[0] &&
        (v->layout.n_panes || v->source.on)) {
        mouse_section(v);
        if (v->source.on) {
            camera_section(v);
            session_section(v);
        }
        picture_section(v);
        if (v->has_stage) {
            sample_section(v);
            place_section(v);
            work_section(v);
        }
    }
    gui_panel_end();
}

static void status_panel(struct view *v)
{
    char text[600], state[160] = "";
    if (gui_panel("status", v->layout.status, false)) {
        const char *name = v->at >= 0 ? v->items.item[v->at]->name : "nothing open";
        if (v->has_stage)
            snprintf(state, sizeof state, "   %d x %d   drawn in %.1f ms", v->stage.target.w,
                     v->stage.target.h, v->stage.times.draw_ms);
        else if (v->picture.px)
            snprintf(state, sizeof state, "   %d x %d, %d channel%s", v->picture.w, v->picture.h,
                     v->picture.nc, v->picture.nc == 1 ? "" : "s");
        snprintf(text, sizeof text, "%s%s   %s", name, state,
                 v->note[0] ? v->note : "?  lists the keys");
        gui_text(text);
    }
    gui_panel_end();
}

static void help_panel(struct view *v)
{
    int n = 0;
    for (const struct key *k = keys; k->action; k++)
        n += k->help != NULL;
    gui_popup("Keys and mouse", 560 * v->scale, (n + 9) * gui_line_height());
    for (const struct key *k = keys; k->action; k++)
        if (k->help)
            gui_fact(k->shown, k->help);
    gui_space();
    gui_fact("drag", "turn the camera; move a picture or the split line");
    gui_fact("right drag", "move the lights");
    gui_fact("middle drag", "move the camera sideways");
    gui_fact("wheel", "nearer and farther; zoom a picture");
    gui_panel_end();
}

void view_panels(struct view *v)
{
    if (v->panels) {
        list_panel(v);
        side_panel(v);
        status_panel(v);
    }
    if (v->help)
        help_panel(v);
}

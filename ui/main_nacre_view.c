// main_nacre_view.c - the window: options, and the loop that waits, listens and draws.
#define _GNU_SOURCE
#include "core/datapath.h"
#include "core/log.h"
#include "core/mem.h"
#include "ui/cli.h"
#include "ui/view_run.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct args {
    const char *size, *script, *tables, *environment, *connect, *font, *rig, *plan, *sessions;
    double scale;
};

static const struct opt opts[] = {
    {"connect", OPT_TEXT, offsetof(struct args, connect), "SOCKET|auto",
     .help = "show nacred's camera; auto: the socket that clients use"},
    {"rig", OPT_FILE, offsetof(struct args, rig), "RIG", "rigs/sim.yaml",
     "camera, lights and filters of captures begun here"},
    {"plan", OPT_FILE, offsetof(struct args, plan), "PLAN", "rigs/plans/bracket.yaml",
     "what they shoot; the shipped plans can be chosen too"},
    {"sessions", OPT_FILE, offsetof(struct args, sessions), "DIR", ".",
     "where they make their sessions"},
    {"scale", OPT_NUM, offsetof(struct args, scale), "S",
     .help = "pixels per point, 1 to 4 (default: as the screen says)"},
    {"size", OPT_TEXT, offsetof(struct args, size), "WxH", "1280x800", "of the window, in points"},
    {"tables", OPT_FILE, offsetof(struct args, tables), "DIR", "gallery-out/tables",
     "where to look for files that are not beside a scene"},
    {"environment", OPT_FILE, offsetof(struct args, environment), "MAP",
     .help = "lat-long map in the place of the scenes'"},
    {"font", OPT_FILE, offsetof(struct args, font), "FILE.ttf",
     "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", "of the panels"},
    {"script", OPT_FILE, offsetof(struct args, script), "FILE",
     .help = "play these steps, then end (docs/view.md)"},
    {0},
};

// A context that is lost takes all that was made in it, and a card that is reset again and again
// is not worth waiting for.
static bool renew(struct view *v, const char *font, int losses, struct err *e)
{
    enum { LOSSES_MOST = 5 };
    view_lose(v);
    gui_close();
    if (losses > LOSSES_MOST)
        return err_set(e, ERR_DEVICE,
                       "OpenGL lost its context %d times; nacre render --backend cpu "
                       "draws without it",
                       losses);
    return (window_renew(v->window, e) &&
            (gui_open(window_scale(v->window), font) ||
             err_set(e, ERR_DEVICE, "Dear ImGui cannot use this OpenGL")) &&
            view_return(v, e)) ||
           err_in(e, "OpenGL lost its context");
}

static bool loop(struct view *v, struct run *r, const struct args *a, bool *gui, struct err *e)
{
    int losses = 0;
    while (!v->quit && !window_wants_close(v->window) && !(a->script && run_is_over(r))) {
        const double patience = v->stale ? 0 : fmin(view_patience(v), run_patience(r, v));
        struct event ev;
        window_wait(v->window, patience);
        if (!run_step(r, v, e))
            return false;
        while (window_next(v->window, &ev)) {
            view_event(v, &ev);
            free(ev.path);
        }
        view_tick(v);
        if (!window_is_dirty(v->window) && !v->stale)
            continue;
        view_draw(v);
        window_show(v->window);
        struct err lost;
        if (!gl_alive(&lost) && !(*gui = renew(v, a->font, ++losses, e)))
            return false;
        if (v->turn_left && v->has_stage)
            view_turn_next(v);
    }
    return true;
}

static bool fill(struct view *v, const struct cli *cli, struct err *e)
{
    if (v->options.connect)
        items_add_live(&v->items);
    for (int k = 0; k < cli->n; k++)
        if (!items_add(&v->items, cli->operand[k], e))
            return false;
    if (!v->items.n) {
        char *scenes = data_path("rigs/scenes", e);
        const bool ok = scenes && items_add(&v->items, scenes, e);
        free(scenes);
        if (!ok)
            return false;
    }
    view_select(v, 0);
    return true;
}

static bool run(const void *args_, struct cli *cli, struct err *e)
{
    const struct args *a = args_;
    log_quiet = true; // what matters is told in the window
    int w, h, end = 0;
    struct run script = {0};
    struct window *window = NULL;
    struct view v = {0};
    if (sscanf(a->size, "%dx%d%n", &w, &h, &end) != 2 || a->size[end])
        return err_set(e, ERR_USAGE, "--size: '%.40s' is not a size such as 1280x800", a->size);
    if (w < 320 || h < 240 || w > 8192 || h > 8192)
        return err_set(e, ERR_DATA, "--size: %dx%d is out of range: must be 320x240 to 8192x8192",
                       w, h);
    if (!isnan(a->scale) && !(a->scale >= 1 && a->scale <= 4))
        return err_set(e, ERR_DATA, "--scale %g: must be 1 to 4", a->scale);
    const struct view_options o = {
        .scene = {.tables = a->tables, .environment = a->environment, .exposure_ev = NAN},
        .connect = a->connect,
        .rig = a->rig,
        .plan = a->plan,
        .sessions = a->sessions};
    if ((a->script && !script_read(&script.script, a->script, e)) ||
        !window_open(&window, "nacre", w, h, isnan(a->scale) ? 0 : a->scale, e)) {
        script_finish(&script.script);
        return false;
    }
    bool ok = gui_open(window_scale(window), a->font) ||
              err_set(e, ERR_DEVICE, "Dear ImGui cannot use this OpenGL");
    bool gui = ok;
    ok = ok && view_open(&v, window, &o, e);
    if (ok)
        ok = fill(&v, cli, e) && loop(&v, &script, a, &gui, e);
    view_close(&v);
    if (gui)
        gui_close();
    window_close(window);
    script_finish(&script.script);
    return ok;
}

static const struct command view_program = {
    .name = "nacre-view",
    .summary = "see materials, tables, pictures and sessions, live",
    .operands = "[FILE|SCENE|SESSION...]",
    .min_operands = 0,
    .max_operands = 1000,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes = "  nacre-view                            the shipped scenes\n"
             "  nacre-view table.exr radiance.exr     files, 1-9 selects\n"
             "  nacre-view session --connect auto     a session, and nacred's camera\n"
             "\n? in the window lists the keys; docs/view.md tells the rest.\n",
    .run = run,
};

int main(int argc, char **argv)
{
    return cli_program(argc, argv, &view_program);
}

// view.h - the window's state, and the verbs on it. One thread: the one with the window.
//
// An event changes parameters or where the mouse is, and marks the view stale; a stale view is
// drawn once. Nothing is drawn otherwise.
#pragma once
#include "ui/view_capture.h"
#include "ui/view_inspect.h"
#include "ui/view_item.h"
#include "ui/view_keys.h"
#include "ui/view_layout.h"
#include "ui/view_source.h"
#include "ui/view_stage.h"
#include "ui/window.h"
#include "ui/worker.h"

enum pane_kind { PANE_PICTURE, PANE_TABLE, PANE_MATERIAL };
extern const char *const pane_kind_name[];

struct view_options {
    struct scene_options scene;
    const char *connect;               // socket of nacred; NULL: none, "auto": the usual one
    const char *rig, *plan, *sessions; // of captures
};

struct mouse {
    double x, y;
    int button, pane; // held there; -1: none
    bool on_split;
    double fine_x, fine_y; // where the last move was
};

struct view {
    struct window *window;
    double scale;
    struct view_options options;
    struct items items;
    int at;                // item shown or being loaded; -1: none
    int wanted;            // item to load when the loader is free; -1: none
    struct params *params; // of the item

    struct worker *loader;
    struct show_gl *show;
    bool has_stage;
    struct stage stage;
    struct image picture;
    struct shown picture_shown, table_shown;

    struct source source;
    struct capture_order capture;
    double table_ev; // exposure that suits the table

    struct layout layout;
    enum pane_kind pane[PANES];
    struct placing placing[PANES];
    bool fitted[PANES]; // the placing follows the pane's size
    bool table_pane, panels, help;

    struct mouse mouse;
    bool has_spot;
    struct spot spot;
    double pixel[2]; // of the picture under the mouse

    char trouble[400]; // why there is no picture; "": there is one
    char note[200];    // what was done last
    double drawn_ms;   // of the whole window
    double fine_ms;    // of the scene with all its pixels
    long frames;       // drawn since the start
    bool stale, quit;
    int turn_left, turn_count; // frames of a turntable still to be written
    char turn_folder[300];
};

bool view_open(struct view *v, struct window *w, const struct view_options *o, struct err *e);
void view_close(struct view *v);

// When the context was lost: forgets all that was made in it; then, in another one, shows the same
// item anew, with its parameters.
void view_lose(struct view *v);
bool view_return(struct view *v, struct err *e);

void view_select(struct view *v, int item); // 0, 1, ...; others are ignored
bool view_add(struct view *v, const char *path, struct err *e);
void view_event(struct view *v, const struct event *e);
void view_act(struct view *v, enum action action, int which);
void view_capture(struct view *v);          // begins one, or says why not
void view_tick(struct view *v);             // what workers have finished
double view_patience(const struct view *v); // seconds until view_tick() is due; INFINITY: never
bool view_is_busy(struct view *v);          // something is being loaded or computed
void view_draw(struct view *v);
void view_say(struct view *v, const char *format, ...) __attribute__((format(printf, 2, 3)));

void view_choose_panes(struct view *v);
void view_show_table(struct view *v);                 // it has changed
const struct table *view_table(const struct view *v); // of the sample; NULL: it has none
double view_exposure(struct view *v);                 // stops that suit what is shown
void view_look(struct view *v);                       // view_look.c: finds v->spot

// A name of a pane in scripts; -1: not shown.
int view_pane(const struct view *v, const char *name);

// view_panels.c, view_over.c: called within a frame.
void view_panels(struct view *v);
void view_over(struct view *v);

// view_shots.c
bool view_screenshot(struct view *v, const char *path, struct err *e); // as last drawn
bool view_save(struct view *v, const char *path, struct err *e);
void view_turntable(struct view *v, int count, const char *folder);
void view_turn_next(struct view *v);                           // after a frame of it was drawn
void view_name_shot(char *path, size_t size, const char *ext); // a name not taken yet

// view_print.c: what the panels say, a line each.
void view_print(const struct view *v);
void spot_text(const struct view *v, void (*fact)(const char *name, const char *value));
void work_text(const struct view *v, void (*fact)(const char *name, const char *value));

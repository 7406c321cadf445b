// view_stage.h - one scene on the GPU, drawn as the parameters say, and what that cost.
//
// OpenGL's thread. Only what changed is done: a moved camera draws, a changed room is prefiltered.
#pragma once
#include "render/gl_object.h"
#include "render/gl_render.h"
#include "ui/show_gl.h"
#include "ui/worker.h"

struct stage_times {
    double draw_ms, room_ms; // of the last picture, of the last change of the room
    double whole_ms;         // of a picture with nothing skipped; NAN: not measured
    long draws, rooms;       // done since the scene was opened
};

struct stage {
    struct scene scene; // with the parameters' camera and lights in it
    struct camera camera;
    struct light *light;       // [scene.n_lights] as the file has them, owned
    struct image room;         // the map as the file has it
    struct worker *worker;     // for the room; NULL: the scene has none
    double room_turn, room_ev; // what it was last given
    struct relight *relight;   // NULL: the lights' spectrum is as it was last asked for
    double spectrum;           // that
    char own_spectrum[64];     // name of the scene's
    struct gl_renderer *renderer;
    struct gl_target target, other;
    struct params drawn; // what target shows, when it shows anything
    bool is_drawn;
    struct gl_work work;
    struct stage_times times;
    double auto_exposure_ev;
};

// Takes the scene, also on failure.
bool stage_open(struct stage *st, struct scene *s, struct err *e);
// The parameters that the scene itself gives.
void stage_params(const struct stage *st, struct params *p);
void stage_close(struct stage *st); // accepts a zeroed struct

// The first object's table is another one from here on; takes it.
bool stage_take_table(struct stage *st, struct table *t, struct err *e);

// Takes a room that is ready and begins the one that is wanted. true: it looks different.
bool stage_tick(struct stage *st, const struct params *p);
double stage_patience(const struct stage *st); // seconds until stage_tick() is due
bool stage_is_busy(struct stage *st, const struct params *p);

bool stage_has(const struct stage *st, enum diffraction kind);

// Draws when anything asks for it, w x h pixels, into st->target; st->other when it compares.
bool stage_draw(struct stage *st, const struct params *p, int w, int h, struct err *e);
// Draws once with and once without skipping, for st->times.
bool stage_measure(struct stage *st, struct err *e);

void stage_show(struct stage *st, struct shown *s, const struct params *p);
void stage_pixel(const struct stage *st, int i, int j, double rgb[3]); // of the target
bool stage_read(const struct stage *st, struct image *out, struct err *e);

// room.h - a scene's environment turned and brightened, and what the objects show of it: seconds
// of work, so beside the window's thread.
#pragma once
#include "render/scene.h"

struct room {
    const struct scene *scene; // shapes, tables and the map's place are read; it outlives the job
    const struct image *map;   // as the file has it
    double turn_rad, ev;

    bool ok;
    struct err e;
    struct surround *surround;            // owned until room_move()
    struct image seen[SCENE_MAX_OBJECTS]; // of the scene's objects, likewise
    double ms;
};

// Materials as they are now are read, of which a drawing thread may change numbers meanwhile.
struct room *room_new(const struct scene *s, const struct image *map, double turn_rad, double ev);
void room_run(void *room);
void room_move(struct room *r, struct scene *to); // what was found becomes the scene's
void room_free(struct room *r);                   // accepts NULL

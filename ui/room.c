// room.c - a new surround on a copy of the scene's objects.
#define _GNU_SOURCE
#include "ui/room.h"
#include "core/log.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct job {
    struct room room; // first
    struct object object[SCENE_MAX_OBJECTS];
};

struct room *room_new(const struct scene *s, const struct image *map, double turn_rad, double ev)
{
    struct job *j = xcalloc(1, sizeof *j);
    j->room = (struct room){.scene = s, .map = map, .turn_rad = turn_rad, .ev = ev};
    for (int k = 0; k < s->n_objects; k++) {
        j->object[k] = s->object[k];
        j->object[k].seen = (struct image){0};
    }
    return &j->room;
}

static bool copy_map(struct environment *env, const struct image *map, struct err *e)
{
    if (!image_init(&env->map, map->w, map->h, map->nc, e))
        return false;
    memcpy(env->map.px, map->px,
           (size_t)map->w * (size_t)map->h * (size_t)map->nc * sizeof *map->px);
    return true;
}

void room_run(void *room)
{
    struct job *j = room;
    struct room *r = &j->room;
    const double start_s = now_s();
    struct environment env = {0};
    if (!copy_map(&env, r->map, &r->e))
        return;
    r->surround = xcalloc(1, sizeof *r->surround);
    if (!surround_init(r->surround, &env, exp2(r->ev), r->turn_rad, &r->e))
        return;
    r->surround->shown = r->scene->surround->shown;
    struct scene copy = {.object = j->object,
                         .n_objects = r->scene->n_objects,
                         .surround = r->surround,
                         .seen_size = r->scene->seen_size};
    r->ok = scene_prefilter(&copy, &r->e);
    for (int k = 0; k < copy.n_objects; k++)
        r->seen[k] = j->object[k].seen;
    r->ms = 1e3 * (now_s() - start_s);
}

void room_move(struct room *r, struct scene *to)
{
    surround_finish(to->surround);
    *to->surround = *r->surround;
    free(r->surround);
    r->surround = NULL;
    for (int k = 0; k < to->n_objects; k++) {
        image_finish(&to->object[k].seen);
        to->object[k].seen = r->seen[k];
        r->seen[k] = (struct image){0};
    }
}

void room_free(struct room *r)
{
    if (!r)
        return;
    if (r->surround)
        surround_finish(r->surround);
    free(r->surround);
    for (int k = 0; k < SCENE_MAX_OBJECTS; k++)
        image_finish(&r->seen[k]);
    free(r);
}

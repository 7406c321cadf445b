// relight.c - one thread, one mutex around what it has ready.
#define _GNU_SOURCE
#include "render/relight.h"
#include "core/mem.h"
#include <pthread.h>
#include <stdlib.h>

// What an object gets; zeroed where there is nothing new.
struct renewed {
    struct table table;
    struct slits slits;
    struct image seen;
    struct lobes lobes[DIFFRACTION_KINDS];
};

// What the thread works from: copies, since the scene changes as its owner takes what is ready.
struct job {
    struct material material; // its photograph is the scene's; no table
    struct frame frame;
    struct env_keep *keep; // the scene's
    bool seen;             // shows a prefiltered map; else, under an environment, its lobes
};

struct relight {
    pthread_t thread;
    struct job *job; // [n]
    int n, seen_size;
    const struct surround *surround; // the scene's
    struct spectrum light;
    double color[3];

    pthread_mutex_t mutex; // guards what follows
    struct renewed *ready; // [n]
    bool any, stop, done, failed;
    struct err why;
};

static bool stopped(struct relight *r)
{
    pthread_mutex_lock(&r->mutex);
    const bool stop = r->stop;
    pthread_mutex_unlock(&r->mutex);
    return stop;
}

// Hands over what is new; what was there and not yet taken is dropped.
static void hand_over(struct relight *r, int k, const struct renewed *from)
{
    pthread_mutex_lock(&r->mutex);
    struct renewed *to = &r->ready[k];
    if (from->table.n) {
        table_finish(&to->table);
        to->table = from->table;
    }
    if (from->slits.n)
        to->slits = from->slits;
    if (from->seen.px)
        to->seen = from->seen;
    for (int kind = 0; kind < DIFFRACTION_KINDS; kind++)
        if (from->lobes[kind].n) {
            lobes_finish(&to->lobes[kind]);
            to->lobes[kind] = from->lobes[kind];
        }
    r->any = true;
    pthread_mutex_unlock(&r->mutex);
}

static bool weigh_slits(struct relight *r, int k, struct err *e)
{
    struct renewed new = {.slits = r->job[k].material.slits};
    new.slits.weight = NULL;
    if (!new.slits.n)
        return true;
    if (!slits_light(&new.slits, &r->light, new.slits.n, e))
        return false;
    const struct material m = {.slits = new.slits};
    if (r->surround &&
        !lobes_init(&new.lobes[DIFFRACTION_SLITS], &m, DIFFRACTION_SLITS, LOBES_CELLS, 1, e)) {
        slits_finish(&new.slits);
        return false;
    }
    hand_over(r, k, &new);
    return true;
}

static bool sum_table(struct relight *r, int k, struct err *e)
{
    const struct job *job = &r->job[k];
    if (!job->material.photo)
        return true;
    struct lut_preview preview = photo_preview(job->material.photo, &r->light);
    while (!lut_preview_done(&preview) && !stopped(r)) {
        struct renewed new = {0};
        struct material m = job->material;
        if (!lut_preview_next(&preview, &new.table, e))
            return false;
        if (r->surround && (!job->seen || lut_preview_done(&preview))) {
            material_take_table(&m, &new.table, m.r0);
            const struct seen_how how = {.n = r->seen_size, .keep = job->keep};
            const bool ok =
                job->seen ? surround_prefilter(r->surround, &m, &job->frame, &how, &new.seen, e)
                          : lobes_init(&new.lobes[DIFFRACTION_TABLE], &m, DIFFRACTION_TABLE,
                                       LOBES_CELLS, 1, e);
            new.table = m.table;
            if (!ok) {
                table_finish(&new.table);
                return false;
            }
        }
        hand_over(r, k, &new);
    }
    return true;
}

static void *work(void *arg)
{
    struct relight *r = arg;
    struct err e;
    bool ok = true;
    for (int k = 0; k < r->n && ok; k++)
        ok = weigh_slits(r, k, &e);
    for (int k = 0; k < r->n && ok; k++)
        ok = sum_table(r, k, &e);
    pthread_mutex_lock(&r->mutex);
    r->done = true;
    r->failed = !ok;
    if (!ok)
        r->why = e;
    pthread_mutex_unlock(&r->mutex);
    return NULL;
}

bool relight_open(struct relight **out, const struct scene *s, const char *illuminant,
                  struct err *e)
{
    struct relight *r = xcalloc(1, sizeof *r);
    if (!illuminant_get(&r->light, illuminant, e) || !light_color(&r->light, r->color, e)) {
        spectrum_finish(&r->light);
        free(r);
        return false;
    }
    r->n = s->n_objects;
    r->surround = s->surround;
    r->seen_size = s->seen_size;
    r->job = xcalloc((size_t)r->n, sizeof *r->job);
    r->ready = xcalloc((size_t)r->n, sizeof *r->ready);
    for (int k = 0; k < r->n; k++) {
        r->job[k] = (struct job){s->object[k].material, s->object[k].shape.frame, s->object[k].keep,
                                 s->object[k].seen.px != NULL};
        r->job[k].material.table = (struct table){0};
    }
    r->any = true; // the lights' colour is new at once
    pthread_mutex_init(&r->mutex, NULL);
    const int failed = pthread_create(&r->thread, NULL, work, r);
    if (failed) {
        r->done = true;
        r->thread = 0;
        relight_close(r);
        return err_set(e, ERR_FILE, "no thread to sum tables in");
    }
    *out = r;
    return true;
}

static void take(struct object *o, struct renewed *new)
{
    const enum diffraction chosen = o->material.diffraction;
    if (new->table.n)
        material_take_table(&o->material, &new->table, o->material.r0);
    o->material.diffraction = chosen;
    if (new->slits.n) {
        slits_finish(&o->material.slits);
        o->material.slits = new->slits;
    }
    if (new->seen.px) {
        image_finish(&o->seen);
        o->seen = new->seen;
    }
    for (int kind = 0; kind < DIFFRACTION_KINDS; kind++)
        if (new->lobes[kind].n) {
            lobes_finish(&o->lobes[kind]);
            o->lobes[kind] = new->lobes[kind];
        }
    *new = (struct renewed){0};
}

bool relight_take(struct relight *r, struct scene *s)
{
    pthread_mutex_lock(&r->mutex);
    const bool any = r->any;
    for (int k = 0; k < r->n && any; k++)
        take(&s->object[k], &r->ready[k]);
    for (int c = 0; c < 3; c++)
        s->light_color[c] = r->color[c];
    r->any = false;
    pthread_mutex_unlock(&r->mutex);
    return any;
}

bool relight_done(struct relight *r, struct err *e)
{
    pthread_mutex_lock(&r->mutex);
    const bool done = r->done && !r->any;
    *e = r->failed ? r->why : (struct err){0};
    pthread_mutex_unlock(&r->mutex);
    return done;
}

void relight_close(struct relight *r)
{
    if (!r)
        return;
    pthread_mutex_lock(&r->mutex);
    r->stop = true;
    pthread_mutex_unlock(&r->mutex);
    if (r->thread)
        pthread_join(r->thread, NULL);
    pthread_mutex_destroy(&r->mutex);
    for (int k = 0; k < r->n; k++) {
        table_finish(&r->ready[k].table);
        slits_finish(&r->ready[k].slits);
        image_finish(&r->ready[k].seen);
        for (int kind = 0; kind < DIFFRACTION_KINDS; kind++)
            lobes_finish(&r->ready[k].lobes[kind]);
    }
    free(r->job);
    free(r->ready);
    spectrum_finish(&r->light);
    free(r);
}

// env_keep.c - one kernel, and the hash of what it was made of.
#define _GNU_SOURCE
#include "process/env_keep.h"
#include "core/mem.h"
#include "core/sha256.h"
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

static const double most_bytes = 5e8;

struct env_keep {
    pthread_mutex_t mutex; // guards the rest
    struct env_kernel kernel;
    bool has;
    char of[SHA256_TEXT];
    int made;
};

struct env_keep *env_keep_new(void)
{
    struct env_keep *k = xcalloc(1, sizeof *k);
    pthread_mutex_init(&k->mutex, NULL);
    return k;
}

void env_keep_free(struct env_keep *k)
{
    if (!k)
        return;
    env_kernel_finish(&k->kernel);
    pthread_mutex_destroy(&k->mutex);
    free(k);
}

int env_keep_made(const struct env_keep *k)
{
    return k->made;
}

static void hash(const struct table *t, const struct fresnel *f, const struct env_how *how,
                 char hex[SHA256_TEXT])
{
    const double numbers[] = {t->n,       t->range,  t->power,        t->count,
                              t->basis,   t->w_min,  t->w_max,        t->nw,
                              f->schlick, f->r0,     how->tolerance,  how->products,
                              how->step,  how->span, how->detail_rad, how->turn_rad};
    const size_t count = (size_t)t->count, n = (size_t)t->n;
    struct sha256 *s = sha256_new();
    sha256_add(s, numbers, sizeof numbers);
    sha256_add(s, t->tab, count * n * n * 3 * sizeof *t->tab);
    if (t->curve)
        sha256_add(s, t->curve, count * (size_t)t->nw * sizeof *t->curve);
    sha256_end(s, hex);
}

static double bytes(const struct env_kernel *k)
{
    const double side = k->grid.period;
    int spectra = 0;
    for (int p = 0; p < TERMS_MOST; p++)
        spectra += k->spec[0][p] != NULL;
    return 3 * spectra * side * side * sizeof(double);
}

static bool map_of(const struct env_kernel *k, const struct environment *env,
                   const struct frame *frame, const double middle[2], int n, struct image *out,
                   struct err *e)
{
    struct env_light l;
    const bool ok = env_light_init(&l, k, env, frame, middle[0], middle[1], e) &&
                    env_exact_map(k, &l, n, out, e);
    env_light_finish(&l);
    return ok;
}

// Has the kernel that is asked for, or none.
static bool renew(struct env_keep *k, const struct table *t, const struct fresnel *f,
                  const struct env_how *how, struct err *e)
{
    char of[SHA256_TEXT];
    hash(t, f, how, of);
    if (k->has && !strcmp(of, k->of))
        return true;
    env_kernel_finish(&k->kernel);
    k->has = env_kernel_init(&k->kernel, t, f, how, e);
    memcpy(k->of, of, sizeof of);
    k->made += k->has;
    return k->has;
}

bool env_keep_map(struct env_keep *keep, const struct table *t, const struct fresnel *f,
                  const struct env_how *how, const struct environment *env,
                  const struct frame *frame, const double middle[2], int n, struct image *out,
                  struct err *e)
{
    struct env_keep none = {.has = false};
    struct env_keep *k = keep ? keep : &none;
    if (keep)
        pthread_mutex_lock(&keep->mutex);
    const bool ok = renew(k, t, f, how, e) && map_of(&k->kernel, env, frame, middle, n, out, e);
    if (!keep || (k->has && bytes(&k->kernel) > most_bytes)) {
        env_kernel_finish(&k->kernel);
        k->has = false;
    }
    if (keep)
        pthread_mutex_unlock(&keep->mutex);
    return ok;
}

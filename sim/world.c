// world.c - the shared file: a mapped struct behind a mutex and a file lock.
#define _GNU_SOURCE
#include "sim/world.h"
#include "acquire/clock.h"
#include "core/mem.h"
#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

struct world {
    struct world_state *shared; // mapped; now_ns is not used there
    char *path;                 // NULL: not shared
    int fd;
    pthread_mutex_t mutex; // between threads; the file lock is between processes
};

static char *path_of(const char *name)
{
    const char *folder = getenv("XDG_RUNTIME_DIR");
    char *path = xasprintf("%s/nacre-sim-", folder && *folder ? folder : "/tmp");
    const size_t plain = strlen(path);
    path = xrealloc(path, plain + strlen(name) + 1, 1);
    strcpy(path + plain, name);
    for (char *s = path + plain; *s; s++)
        if (!isalnum((unsigned char)*s) && *s != '-')
            *s = '_';
    return path;
}

// Opens the file that the path names now: the last user may unlink it between open and lock.
static int open_locked(const char *path, struct err *e)
{
    for (int turn = 0; turn < 100; turn++) {
        const int fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0660);
        if (fd < 0 || flock(fd, LOCK_SH)) {
            err_errno(e, "%s", path);
            if (fd >= 0)
                close(fd);
            return -1;
        }
        struct stat ours, named;
        if (!fstat(fd, &ours) && !stat(path, &named) && ours.st_ino == named.st_ino)
            return fd;
        close(fd);
    }
    err_set(e, ERR_FILE, "%s: keeps disappearing", path);
    return -1;
}

struct world *world_open(const char *name, struct err *e)
{
    struct world *w = xcalloc(1, sizeof *w);
    const size_t size = sizeof *w->shared;
    *w = (struct world){.fd = -1, .mutex = PTHREAD_MUTEX_INITIALIZER};
    bool ok = true;
    if (name && *name) {
        w->path = path_of(name);
        w->fd = open_locked(w->path, e);
        ok = w->fd >= 0 && (!ftruncate(w->fd, (off_t)size) || err_errno(e, "%s", w->path));
    }
    void *at = MAP_FAILED;
    if (ok)
        at = mmap(NULL, size, PROT_READ | PROT_WRITE,
                  w->path ? MAP_SHARED : MAP_PRIVATE | MAP_ANONYMOUS, w->fd, 0);
    if (ok && at == MAP_FAILED)
        ok = err_errno(e, "%s", w->path ? w->path : "simulated world");
    if (ok) {
        w->shared = at;
        return w;
    }
    world_close(w);
    return NULL;
}

void world_close(struct world *w)
{
    if (!w)
        return;
    if (w->shared)
        munmap(w->shared, sizeof *w->shared);
    if (w->fd >= 0 && !flock(w->fd, LOCK_EX | LOCK_NB)) // nobody else has it open
        unlink(w->path);
    if (w->fd >= 0)
        close(w->fd);
    free(w->path);
    free(w);
}

static void file_lock(struct world *w, short type)
{
    struct flock l = {.l_type = type, .l_whence = SEEK_SET, .l_len = 1};
    while (w->fd >= 0 && fcntl(w->fd, F_OFD_SETLKW, &l) && errno == EINTR)
        ;
}

static void lock(struct world *w)
{
    pthread_mutex_lock(&w->mutex);
    file_lock(w, F_WRLCK);
}

static void unlock(struct world *w)
{
    file_lock(w, F_UNLCK);
    pthread_mutex_unlock(&w->mutex);
}

int64_t world_now_ns(struct world *w)
{
    lock(w);
    const int64_t now = clock_boot_ns() + w->shared->skip_ns;
    unlock(w);
    return now;
}

void world_skip(struct world *w, int64_t ns)
{
    lock(w);
    w->shared->skip_ns += ns > 0 ? ns : 0;
    unlock(w);
}

static void add_light(struct world_state *s, const struct world_light *l)
{
    if (s->n_lights == WORLD_EVENTS) {
        memmove(s->light, s->light + 1, (WORLD_EVENTS - 1) * sizeof *s->light);
        s->n_lights--;
    }
    s->light[s->n_lights++] = *l;
}

void world_set_lines(struct world *w, const struct world_light *l)
{
    lock(w);
    struct world_state *s = w->shared;
    s->has_lights = 1;
    for (int k = 0; k < s->n_lights; k++)
        if (s->light[k].to_ns > l->from_ns)
            s->light[k].to_ns = l->from_ns;
    if (l->mask)
        add_light(s, l);
    unlock(w);
}

void world_pulse(struct world *w, const struct world_light *l)
{
    lock(w);
    w->shared->has_lights = 1;
    add_light(w->shared, l);
    unlock(w);
}

void world_set_filter(struct world *w, int position, int64_t from_ns)
{
    lock(w);
    struct world_state *s = w->shared;
    s->has_filters = 1;
    if (s->n_filters == WORLD_EVENTS) {
        memmove(s->filter, s->filter + 1, (WORLD_EVENTS - 1) * sizeof *s->filter);
        s->n_filters--;
    }
    s->filter[s->n_filters].position = position;
    s->filter[s->n_filters++].from_ns = from_ns;
    unlock(w);
}

void world_read(struct world *w, struct world_state *s)
{
    lock(w);
    *s = *w->shared;
    s->now_ns = clock_boot_ns() + s->skip_ns;
    unlock(w);
}

// On-time of a chopped light from its beginning until `t` ns later.
static double chopped(const struct world_light *l, double t)
{
    const double period = 1e9 / l->pwm_hz, on = l->pwm_duty * period, whole = floor(t / period);
    return whole * on + fmin(t - whole * period, on);
}

// Light of [from, to), whatever the filter: pulses may overlap, so count the union.
static double lit(const struct world_state *s, int line, int64_t from_ns, int64_t to_ns)
{
    int64_t counted_to = from_ns;
    double sum = 0;
    if (!s->has_lights) // nobody switches it: line 0 is always on
        return line == 0 ? 1e-9 * (double)(to_ns - from_ns) : 0;
    for (int k = 0; k < s->n_lights; k++) { // in the order of their beginning
        const struct world_light *l = &s->light[k];
        if (!(l->mask >> line & 1))
            continue;
        const int64_t a = l->from_ns > counted_to ? l->from_ns : counted_to;
        const int64_t b = l->to_ns < to_ns ? l->to_ns : to_ns;
        if (b <= a)
            continue;
        const double x = (double)(a - l->from_ns), y = (double)(b - l->from_ns);
        sum += l->level * (l->pwm_hz > 0 ? (chopped(l, y) - chopped(l, x)) / l->pwm_duty : y - x);
        counted_to = b;
    }
    return 1e-9 * sum;
}

double world_lit_s(const struct world_state *s, int line, int position, int64_t from_ns,
                   int64_t to_ns)
{
    if (position < 0)
        return lit(s, line, from_ns, to_ns);
    double sum = 0;
    for (int k = 0; k < s->n_filters; k++) {
        if (s->filter[k].position != position)
            continue;
        const int64_t until = k + 1 < s->n_filters ? s->filter[k + 1].from_ns : INT64_MAX;
        const int64_t a = s->filter[k].from_ns > from_ns ? s->filter[k].from_ns : from_ns;
        const int64_t b = until < to_ns ? until : to_ns;
        if (b > a)
            sum += lit(s, line, a, b);
    }
    return sum;
}

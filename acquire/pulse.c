// pulse.c - one thread that waits for one moment.
#define _GNU_SOURCE
#include "acquire/pulse.h"
#include "acquire/clock.h"
#include <string.h>
#include <time.h>

static void *wait_for_ends(void *arg)
{
    struct pulse *p = arg;
    pthread_mutex_lock(&p->mutex);
    while (!p->quit) {
        const int64_t left = p->ends_ns - clock_boot_ns();
        if (!p->ends_ns) {
            pthread_cond_wait(&p->wake, &p->mutex);
        } else if (left <= 0) {
            p->ends_ns = 0;
            p->end(p->ctx);
        } else {
            struct timespec t;
            clock_gettime(CLOCK_MONOTONIC, &t);
            const int64_t at = t.tv_nsec + left;
            t.tv_sec += at / 1000000000;
            t.tv_nsec = at % 1000000000;
            pthread_cond_timedwait(&p->wake, &p->mutex, &t);
        }
    }
    pthread_mutex_unlock(&p->mutex);
    return NULL;
}

bool pulse_init(struct pulse *p, void (*end)(void *ctx), void *ctx, struct err *e)
{
    pthread_condattr_t monotonic;
    *p = (struct pulse){.end = end, .ctx = ctx};
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&p->wake, &monotonic);
    pthread_condattr_destroy(&monotonic);
    pthread_mutex_init(&p->mutex, NULL);
    const int rc = pthread_create(&p->thread, NULL, wait_for_ends, p);
    p->running = rc == 0;
    return p->running || err_set(e, ERR_DEVICE, "no thread: %s", strerror(rc));
}

void pulse_finish(struct pulse *p)
{
    if (!p->running)
        return;
    pthread_mutex_lock(&p->mutex);
    p->quit = true;
    pthread_cond_signal(&p->wake);
    pthread_mutex_unlock(&p->mutex);
    pthread_join(p->thread, NULL);
    pthread_cond_destroy(&p->wake);
    pthread_mutex_destroy(&p->mutex);
    p->running = false;
}

void pulse_lock(struct pulse *p)
{
    pthread_mutex_lock(&p->mutex);
}

void pulse_unlock(struct pulse *p)
{
    pthread_mutex_unlock(&p->mutex);
}

void pulse_arm(struct pulse *p, int64_t ends_ns)
{
    p->ends_ns = ends_ns;
    pthread_cond_signal(&p->wake);
}

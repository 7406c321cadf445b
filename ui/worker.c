// worker.c - a thread that waits for a job.
#define _GNU_SOURCE
#include "ui/worker.h"
#include "core/mem.h"
#include <pthread.h>
#include <stdlib.h>

struct worker {
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t news;
    void (*wake)(void);
    void (*run)(void *job);
    void *job;
    bool given, finished, end;
};

static void *work(void *self)
{
    struct worker *w = self;
    pthread_mutex_lock(&w->lock);
    while (!w->end) {
        if (!w->given || w->finished) {
            pthread_cond_wait(&w->news, &w->lock);
            continue;
        }
        pthread_mutex_unlock(&w->lock);
        w->run(w->job);
        pthread_mutex_lock(&w->lock);
        w->finished = true;
        pthread_cond_broadcast(&w->news);
        w->wake();
    }
    pthread_mutex_unlock(&w->lock);
    return NULL;
}

struct worker *worker_new(void (*wake)(void))
{
    struct worker *w = xcalloc(1, sizeof *w);
    w->wake = wake;
    pthread_mutex_init(&w->lock, NULL);
    pthread_cond_init(&w->news, NULL);
    if (pthread_create(&w->thread, NULL, work, w))
        abort(); // no memory for a thread
    return w;
}

void worker_free(struct worker *w)
{
    if (!w)
        return;
    pthread_mutex_lock(&w->lock);
    w->end = true;
    pthread_cond_signal(&w->news);
    pthread_mutex_unlock(&w->lock);
    pthread_join(w->thread, NULL);
    pthread_cond_destroy(&w->news);
    pthread_mutex_destroy(&w->lock);
    free(w);
}

bool worker_give(struct worker *w, void (*run)(void *job), void *job)
{
    pthread_mutex_lock(&w->lock);
    const bool free_now = !w->given;
    if (free_now) {
        w->run = run;
        w->job = job;
        w->given = true;
        pthread_cond_broadcast(&w->news);
    }
    pthread_mutex_unlock(&w->lock);
    return free_now;
}

void *worker_done(struct worker *w)
{
    void *job = NULL;
    pthread_mutex_lock(&w->lock);
    if (w->finished) {
        job = w->job;
        w->given = w->finished = false;
    }
    pthread_mutex_unlock(&w->lock);
    return job;
}

void *worker_wait(struct worker *w)
{
    pthread_mutex_lock(&w->lock);
    while (w->given && !w->finished)
        pthread_cond_wait(&w->news, &w->lock);
    pthread_mutex_unlock(&w->lock);
    return worker_done(w);
}

bool worker_busy(struct worker *w)
{
    pthread_mutex_lock(&w->lock);
    const bool busy = w->given;
    pthread_mutex_unlock(&w->lock);
    return busy;
}

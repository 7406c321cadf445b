// mover.h - does what takes time, a wheel's turn or a person's hand, in a thread of the driver's
// own, and makes the trigger's fd readable when it is done.
#pragma once
#include "acquire/trigger.h"
#include <pthread.h>

struct mover {
    struct trig *trig;
    // Moves to `position`, however long it takes; returns early when mover_told() is true.
    bool (*move)(struct trig *t, int position, struct err *e);
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t wake;
    int wanted; // position; -1: none
    bool running, quit;
};

// Sets trig->fd.
bool mover_init(struct mover *m, struct trig *trig,
                bool (*move)(struct trig *t, int position, struct err *e), struct err *e);
void mover_finish(struct mover *m); // accepts a zeroed struct; waits for move() to return

void mover_go(struct mover *m, int position); // another move may be under way: the last one counts
bool mover_told(struct mover *m);             // there is another wish, or the end

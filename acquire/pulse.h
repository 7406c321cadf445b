// pulse.h - switches lines off again after a pulse, for drivers whose device cannot.
//
// A thread of the driver's own waits for the end. Everything that talks to the device is done with
// the lock held: the thread holds it while it calls end().
#pragma once
#include "core/err.h"
#include <pthread.h>
#include <stdint.h>

struct pulse {
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t wake;
    void (*end)(void *ctx);
    void *ctx;
    int64_t ends_ns; // CLOCK_BOOTTIME; 0: none under way
    bool running, quit;
};

bool pulse_init(struct pulse *p, void (*end)(void *ctx), void *ctx, struct err *e);
void pulse_finish(struct pulse *p); // accepts a zeroed struct; a pulse under way is not ended

void pulse_lock(struct pulse *p);
void pulse_unlock(struct pulse *p);
void pulse_arm(struct pulse *p, int64_t ends_ns); // with the lock held; 0: forget it

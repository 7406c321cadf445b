// worker.h - one thread beside the window's, for what takes longer than a frame.
//
// One job at a time. The job belongs to the worker from worker_give() to worker_done().
#pragma once
#include <stdbool.h>

struct worker;

struct worker *worker_new(void (*wake)(void)); // called on the worker's thread after each job
void worker_free(struct worker *w);            // waits for its job; accepts NULL
bool worker_give(struct worker *w, void (*run)(void *job), void *job); // false: it has one
void *worker_done(struct worker *w); // the job that is finished, once; else NULL
void *worker_wait(struct worker *w); // as worker_done(), when it is finished
bool worker_busy(struct worker *w);  // given and not yet taken back

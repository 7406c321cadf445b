// loop.h - the one thread that owns all state: descriptors and timers, one callback each.
//
// Timers are absolute CLOCK_BOOTTIME ns. Callbacks may add, change and remove anything, also
// themselves. Nothing called from here may take longer than 10 ms.
#pragma once
#include "core/err.h"
#include <stdint.h>

struct loop;
struct loop_source; // a watched descriptor or a timer

typedef void loop_call(void *ctx);

struct loop *loop_new(void);
void loop_free(struct loop *l); // accepts NULL; sources that are left are freed too

// Calls when the descriptor can be read (or has failed, or was hung up).
struct loop_source *loop_watch(struct loop *l, int fd, loop_call *call, void *ctx);
void loop_want_write(struct loop_source *s, bool want); // call also when it can be written
struct loop_source *loop_timer(struct loop *l, loop_call *call, void *ctx); // not armed
void loop_arm(struct loop_source *s, int64_t at_ns);                        // 0: disarm
void loop_drop(struct loop_source *s); // accepts NULL; never called again

bool loop_run(struct loop *l, struct err *e);                  // until loop_stop()
bool loop_turn(struct loop *l, int timeout_ms, struct err *e); // what is due now, once
void loop_stop(struct loop *l);

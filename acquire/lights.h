// lights.h - the light keeper: the process nacre-lights alone holds the light lines.
//
// A kernel does not switch a line off when its holder is killed, so the holder is a program too
// small to fail, with one rule: lines are on only while somebody says so. They go off when the
// other end of its socket is closed, when that end has been silent for 500 ms, when a line has been
// on for its `max_on`, on SIGTERM, and at its own start.
//
// Messages (SOCK_SEQPACKET, text): "set MASK", "pulse MASK NS" and "beat" in; "ready LINES MODEL",
// "ok CHANGED_NS ENDS_NS", "fail CODE TEXT" and, unasked, "off MASK REASON" out.
#pragma once
#include "acquire/trigger.h"
#include "core/rig.h"

enum { LIGHTS_LINES = 32, LIGHTS_MESSAGE = 512 };
extern const int64_t lights_silence_ns;

// Serves `socket` until it is closed or SIGTERM comes. max_on_ns by line; 0: that line is not in
// the rig and may not be switched on. All lines are off when it returns.
bool lights_serve(struct trig *t, const int64_t max_on_ns[LIGHTS_LINES], int socket, struct err *e);

// The other end: a trigger whose lines nacre-lights holds, started for it. NULL on failure. Its fd
// is readable when there is news: call lights_pump().
struct trig *lights_open(const struct rig *rig, const char *run, struct err *e);
bool lights_is_kept(const struct trig *t); // false: some other trigger; then the rest does nothing
void lights_beat(struct trig *t);          // at least every 200 ms, from the loop

// Reads what nacre-lights says unasked. When it has died, a new one is started, which switches the
// lines off; *text then says so, as it does for lines that were switched off ("" otherwise).
// false: it died and cannot be started again.
bool lights_pump(struct trig *t, char *text, size_t size, struct err *e);

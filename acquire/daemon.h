// daemon.h - nacred from the inside: captures on request, told about to who asked.
//
// The protocol is docs/protocol.md. A capture belongs to the client that began it; when that client
// goes without having said "detach", the capture is stopped: light off, what is kept stays.
#pragma once
#include "acquire/devices.h"
#include "acquire/loop.h"

struct daemon;

// Takes the listening descriptor. The drivers outlive it.
struct daemon *daemon_new(struct loop *l, int listening, const struct drivers *drivers);
void daemon_free(struct daemon *d); // stops what runs; accepts NULL

// Ends the loop once no client and no capture is left for this long; 0: never.
void daemon_end_when_idle(struct daemon *d, int64_t idle_ns);
// Stops all captures, then ends the loop.
void daemon_stop(struct daemon *d);

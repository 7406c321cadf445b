// remote.h - a capture by nacred, from the client's side.
#pragma once
#include "core/err.h"
#include <stdbool.h>

struct remote_order {
    const char *rig, *plan, *session; // as the user typed them
    bool resume;
    int silence_ms; // how long nacred may say nothing to a question; 0: 30 s
    // Every frame that was judged; verdict "good" counts.
    void (*kept)(void *ctx, int step, int attempt, const char *verdict, const char *reason,
                 int done, int planned);
    void *ctx;
};

// Starts nacred when none runs, and waits for the end. SIGINT and SIGTERM stop the capture: light
// off, what is kept stays, ERR_PARTIAL. ERR_DEVICE when nacred dies or hangs.
bool remote_capture(const struct remote_order *order, struct err *e);

// child.h - this program run once more with other words, as a user would type them.
#pragma once
#include "core/err.h"

struct child {
    int status;    // its exit code
    char *out;     // what it printed on stdout, owned
    double wall_s; // how long it took
};

// Runs "nacre <words>" and waits; stderr is passed through. words are quoted as in words.h.
// False only when it cannot be started or was killed; a failed command is a status.
bool child_run(const char *words, struct child *c, struct err *e);
bool child_run_in(const char *folder, const char *words, struct child *c, struct err *e);
// The same with --json --quiet, for programs of several steps: a failed command is an error with
// its code.
bool child_do(const char *words, struct child *c, struct err *e);
void child_finish(struct child *c); // accepts a zeroed struct

// stop.h - SIGINT and SIGTERM as a descriptor for the loop.
//
// A handler and an eventfd, not signalfd: libraries start threads before main() that do not block
// signals, and the kernel delivers to any thread that does not.
#pragma once
#include <stdbool.h>

// Readable after a signal; the same descriptor for the whole program, never closed. SIGINT is
// ignored instead when `terminal` is false: Ctrl-C is then somebody else's business.
int stop_fd(bool terminal);
bool stop_asked(void); // takes what is there off the descriptor

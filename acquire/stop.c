// stop.c - the one piece of state that a signal handler needs.
#define _GNU_SOURCE
#include "acquire/stop.h"
#include <signal.h>
#include <stdint.h>
#include <sys/eventfd.h>
#include <unistd.h>

static int event = -1;

static void handle(int signal)
{
    static const uint64_t one = 1;
    (void)signal;
    (void)!write(event, &one, sizeof one);
}

int stop_fd(bool terminal)
{
    if (event < 0)
        event = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    struct sigaction act = {.sa_handler = handle, .sa_flags = SA_RESTART};
    sigaction(SIGTERM, &act, NULL);
    if (!terminal)
        act.sa_handler = SIG_IGN;
    sigaction(SIGINT, &act, NULL);
    return event;
}

bool stop_asked(void)
{
    eventfd_t count;
    return !eventfd_read(event, &count);
}

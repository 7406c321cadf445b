// prompt_trig.c - "prompt:positions=3": a person changes the filter and says so at a terminal.
//
// nacred has no terminal of its own: it is told that of the person by NACRE_TTY, which nacre sets
// when it starts nacred.
#define _GNU_SOURCE
#include "acquire/clock.h"
#include "acquire/hardware.h"
#include "acquire/mover.h"
#include "core/mem.h"
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

struct prompt {
    struct trig base;
    int positions;
    char *names, *tty;
    int64_t patience_ns;

    int terminal;
    struct mover mover;
};

// Name number `position` of "red+green+blue"; the number itself where names end.
static char *name_of(const struct prompt *p, int position)
{
    const char *at = p->names;
    for (int k = 0; k < position && at; k++) {
        at = strchr(at, '+');
        at = at ? at + 1 : NULL;
    }
    if (!at || !*at || *at == '+')
        return xasprintf("number %d", position);
    return xasprintf("'%.*s'", (int)strcspn(at, "+"), at);
}

static bool ask(struct trig *t, int position, struct err *e)
{
    enum { EACH_MS = 50 };
    struct prompt *p = (struct prompt *)t;
    char *name = name_of(p, position), answer[64];
    (void)tcflush(p->terminal, TCIFLUSH); // what was typed before is no answer
    dprintf(p->terminal, "\nPut filter %s in place, then press Enter: ", name);
    free(name);
    const int64_t until = clock_boot_ns() + p->patience_ns;
    while (clock_boot_ns() < until) {
        struct pollfd in = {p->terminal, POLLIN, 0};
        if (mover_told(&p->mover))
            return false;
        if (poll(&in, 1, EACH_MS) != 1)
            continue;
        const ssize_t n = read(p->terminal, answer, sizeof answer);
        if (n > 0 && memchr(answer, '\n', (size_t)n))
            return true;
        if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR))
            return err_set(e, ERR_DEVICE, "the terminal %s is gone", p->tty);
    }
    return err_set(e, ERR_DEVICE, "nobody answered at %s", p->tty);
}

static bool prompt_open(struct trig *t, struct err *e)
{
    struct prompt *p = (struct prompt *)t;
    p->terminal = -1;
    if (!*p->tty) {
        const char *told = getenv("NACRE_TTY");
        free(p->tty);
        p->tty = xstrdup(told && *told ? told : "/dev/tty");
    }
    p->terminal = open(p->tty, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (p->terminal < 0 || !isatty(p->terminal))
        return err_set(e, ERR_DEVICE, "tty=%s: no terminal to ask a person at", p->tty);
    snprintf(t->caps.model, sizeof t->caps.model, "a person at %.40s", p->tty);
    t->caps.positions = p->positions;
    t->caps.settle_ns = p->patience_ns;
    return mover_init(&p->mover, t, ask, e);
}

static bool prompt_set(struct trig *t, uint32_t position, struct err *e)
{
    (void)e;
    mover_go(&((struct prompt *)t)->mover, (int)position);
    return true;
}

static void prompt_close(struct trig *t)
{
    struct prompt *p = (struct prompt *)t;
    mover_finish(&p->mover);
    if (p->terminal >= 0)
        close(p->terminal);
}

#define AT(field) offsetof(struct prompt, field)
static const struct devopt options[] = {
    {"positions", DEVOPT_INT, AT(positions), UNIT_NONE, 1, 100, "10", "filters that there are"},
    {"names", DEVOPT_TEXT, AT(names), .def = "",
     .help = "what to call them, from position 0: red+green+blue"},
    {"tty", DEVOPT_TEXT, AT(tty), .def = "",
     .help = "terminal; if none, the one that nacre was started at"},
    {"patience", DEVOPT_NS, AT(patience_ns), UNIT_S, 1, 86400, "10min",
     "how long to wait for a person"},
    {0},
};

const struct trig_driver prompt_trig = {
    .name = "prompt",
    .summary = "a person at a terminal changes the filters",
    .size = sizeof(struct prompt),
    .options = options,
    .open = prompt_open,
    .set = prompt_set,
    .close = prompt_close,
};

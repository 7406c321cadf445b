// loop.c - poll() over a list of sources.
#define _GNU_SOURCE
#include "acquire/loop.h"
#include "acquire/clock.h"
#include "core/mem.h"
#include <errno.h>
#include <poll.h>
#include <stdlib.h>

struct loop_source {
    struct loop *loop;
    struct loop_source *next;
    int fd; // -1: a timer
    bool write, dropped;
    int64_t at_ns;
    loop_call *call;
    void *ctx;
};

struct loop {
    struct loop_source *first;
    bool stopped;
};

struct loop *loop_new(void)
{
    return xcalloc(1, sizeof(struct loop));
}

static void sweep(struct loop *l, bool all)
{
    struct loop_source **at = &l->first;
    while (*at) {
        struct loop_source *s = *at;
        if (!all && !s->dropped) {
            at = &s->next;
            continue;
        }
        *at = s->next;
        free(s);
    }
}

void loop_free(struct loop *l)
{
    if (!l)
        return;
    sweep(l, true);
    free(l);
}

static struct loop_source *add(struct loop *l, int fd, loop_call *call, void *ctx)
{
    struct loop_source *s = xcalloc(1, sizeof *s);
    *s = (struct loop_source){.loop = l, .next = l->first, .fd = fd, .call = call, .ctx = ctx};
    l->first = s;
    return s;
}

struct loop_source *loop_watch(struct loop *l, int fd, loop_call *call, void *ctx)
{
    return add(l, fd, call, ctx);
}
struct loop_source *loop_timer(struct loop *l, loop_call *call, void *ctx)
{
    return add(l, -1, call, ctx);
}
void loop_want_write(struct loop_source *s, bool want)
{
    s->write = want;
}
void loop_arm(struct loop_source *s, int64_t at_ns)
{
    s->at_ns = at_ns;
}
void loop_stop(struct loop *l)
{
    l->stopped = true;
}

void loop_drop(struct loop_source *s)
{
    if (s)
        s->dropped = true; // freed when no callback can be running on it
}

bool loop_turn(struct loop *l, int timeout_ms, struct err *e)
{
    enum { MOST = 256 };
    struct pollfd fds[MOST];
    struct loop_source *of[MOST];
    nfds_t n = 0;
    int64_t first_ns = INT64_MAX;
    sweep(l, false);
    for (struct loop_source *s = l->first; s; s = s->next) {
        if (s->fd < 0) {
            if (s->at_ns && s->at_ns < first_ns)
                first_ns = s->at_ns;
        } else if (n < MOST) {
            fds[n] = (struct pollfd){s->fd, (short)(POLLIN | (s->write ? POLLOUT : 0)), 0};
            of[n++] = s;
        } else {
            return err_set(e, ERR_FILE, "more than %d descriptors to wait for", MOST);
        }
    }
    struct timespec wait = {timeout_ms / 1000, timeout_ms % 1000 * 1000000L};
    if (first_ns != INT64_MAX) {
        const int64_t left = first_ns - clock_boot_ns(), at_most = (int64_t)timeout_ms * 1000000;
        const int64_t ns = left < 0 ? 0 : timeout_ms >= 0 && at_most < left ? at_most : left;
        wait = (struct timespec){ns / 1000000000, ns % 1000000000};
    }
    const bool for_ever = timeout_ms < 0 && first_ns == INT64_MAX;
    if (ppoll(fds, n, for_ever ? NULL : &wait, NULL) < 0)
        return errno == EINTR || err_errno(e, "poll");
    for (nfds_t k = 0; k < n; k++)
        if (fds[k].revents && !of[k]->dropped)
            of[k]->call(of[k]->ctx);
    const int64_t now = clock_boot_ns();
    for (struct loop_source *s = l->first; s; s = s->next)
        if (s->fd < 0 && !s->dropped && s->at_ns && s->at_ns <= now) {
            s->at_ns = 0;
            s->call(s->ctx);
        }
    return true;
}

bool loop_run(struct loop *l, struct err *e)
{
    l->stopped = false;
    while (!l->stopped)
        if (!loop_turn(l, -1, e))
            return false;
    return true;
}

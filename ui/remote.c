// remote.c - asks nacred for a capture and listens until it has ended.
#define _GNU_SOURCE
#include "ui/remote.h"
#include "acquire/endpoint.h"
#include "acquire/rpc.h"
#include "acquire/stop.h"
#include "core/mem.h"
#include <errno.h>

#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { LINE = 1 << 16, SILENCE_MS = 30000 };

struct remote {
    const struct remote_order *order;
    int fd;
    int64_t capture;          // 0: not yet answered
    bool asked;               // whether it is still there, and nothing was heard since
    bool over, stopped, gone; // gone: nacred has closed the connection
    struct err how;
    char in[LINE + 1];
    size_t n;
};

static bool say(struct remote *r, char *line, struct err *e) // takes line
{
    const size_t n = strlen(line);
    const bool ok = send(r->fd, line, n, MSG_NOSIGNAL) == (ssize_t)n;
    r->gone |= !ok;
    free(line);
    return ok || err_set(e, ERR_DEVICE, "nacred does not listen any more");
}

static bool ask_to_start(struct remote *r, struct err *e)
{
    struct rpc_object *o = rpc_object();
    char *rig = endpoint_file(r->order->rig), *plan = endpoint_file(r->order->plan);
    char *session = endpoint_file(r->order->session);
    rpc_put_text(o, "rig", rig);
    rpc_put_text(o, "plan", plan);
    rpc_put_text(o, "session", session);
    rpc_put_flag(o, "resume", r->order->resume);
    free(rig);
    free(plan);
    free(session);
    return say(r, rpc_request(1, "capture.start", o), e);
}

static bool ask_to_stop(struct remote *r, struct err *e)
{
    struct rpc_object *o = rpc_object();
    rpc_put_int(o, "capture", r->capture);
    r->stopped = true;
    return say(r, rpc_request(2, "capture.abort", o), e);
}

static bool ask_whether_it_lives(struct remote *r, struct err *e)
{
    r->asked = true;
    return say(r, rpc_request(3, "hello", NULL), e);
}

static const char *param_text(const struct rpc_message *m, const char *name)
{
    const char *text = rpc_text(m, name);
    return text ? text : "";
}

static void note_progress(struct remote *r, const struct rpc_message *m)
{
    if (r->order->kept)
        r->order->kept(r->order->ctx, (int)rpc_int(m, "step", -1), (int)rpc_int(m, "attempt", 0),
                       param_text(m, "verdict"), param_text(m, "reason"),
                       (int)rpc_int(m, "done", 0), (int)rpc_int(m, "planned", 0));
}

static bool line_came(struct remote *r, const char *line, struct err *e)
{
    enum rpc_code code;
    struct rpc_message *m = rpc_read(line, &code, e);
    if (!m)
        return err_in(e, "nacred");
    const char *event = rpc_method(m);
    bool ok = true;
    if (!event && rpc_id(m) == 1) {
        ok = !rpc_is_error(m, e);
        r->capture = rpc_int(m, "capture", 0);
    } else if (event && !strcmp(event, "capture.frame")) {
        note_progress(r, m);
    } else if (event && !strcmp(event, "capture.end")) {
        r->over = true;
        r->how.code = (enum err_code)rpc_int(m, "code", ERR_DEVICE);
        snprintf(r->how.msg, sizeof r->how.msg, "%s", param_text(m, "message"));
    }
    rpc_free(m);
    return ok;
}

static bool receive(struct remote *r, struct err *e)
{
    const ssize_t n = read(r->fd, r->in + r->n, LINE - r->n);
    if (n < 0 && errno == EINTR)
        return true;
    r->gone = n <= 0;
    if (r->gone)
        return err_set(e, ERR_DEVICE, "nacred has died; the light is off, and --resume goes on");
    r->asked = false;
    r->n += (size_t)n;
    r->in[r->n] = 0;
    char *start = r->in, *end;
    while ((end = strchr(start, '\n'))) {
        *end = 0;
        if (!line_came(r, start, e))
            return false;
        start = end + 1;
    }
    r->n -= (size_t)(start - r->in);
    memmove(r->in, start, r->n);
    return r->n < LINE || err_set(e, ERR_DEVICE, "nacred sends too long a line");
}

// A capture that runs answers at once; to begin one may take long, as a session that is resumed is
// read whole.
static bool wait_for_end(struct remote *r, struct err *e)
{
    const int silence_ms = r->order->silence_ms ? r->order->silence_ms : SILENCE_MS;
    while (!r->over) {
        struct pollfd p[2] = {{r->fd, POLLIN, 0}, {stop_fd(true), POLLIN, 0}};
        const int n = poll(p, 2, r->capture ? silence_ms : -1);
        if (n < 0 && errno != EINTR)
            return err_errno(e, "poll");
        if (n == 0 && r->asked)
            return err_set(e, ERR_DEVICE,
                           "nacred does not answer; the light is off, and --resume goes on");
        if (n == 0 && !ask_whether_it_lives(r, e))
            return false;
        if (n <= 0)
            continue;
        if (p[1].revents) {
            const bool got = stop_asked();
            if (got && (r->stopped || !r->capture)) // asked twice, or nothing to stop yet
                return err_set(e, ERR_PARTIAL, "interrupted");
            if (got && !ask_to_stop(r, e))
                return false;
        }
        if (p[0].revents && !receive(r, e))
            return false;
    }
    if (r->how.code)
        *e = r->how;
    return r->how.code == ERR_NONE;
}

static bool once(const struct remote_order *order, bool *unheard, struct err *e)
{
    struct remote *r = xcalloc(1, sizeof *r);
    r->order = order;
    r->fd = endpoint_connect(e);
    const bool ok = r->fd >= 0 && ask_to_start(r, e) && wait_for_end(r, e);
    *unheard = !ok && r->fd >= 0 && r->gone && !r->capture;
    if (r->fd >= 0)
        close(r->fd);
    free(r);
    return ok;
}

bool remote_capture(const struct remote_order *order, struct err *e)
{
    enum { TRIES = 50, EACH_US = 100000 };
    stop_fd(true); // from here on signals wait until they are looked at
    bool unheard, ok = once(order, &unheard, e);
    for (int k = 0; unheard && k < 3; k++) // it was about to end, idle: a new one is started
        ok = once(order, &unheard, e);
    // What is to be resumed may not have ended yet: nacred needs a moment when its client dies.
    for (int k = 0; !ok && order->resume && e->code == ERR_FILE && k < TRIES &&
                    strstr(e->msg, "another process is writing");
         k++) {
        usleep(EACH_US);
        ok = once(order, &unheard, e);
    }
    return ok;
}

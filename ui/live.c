// live.c - JSON-RPC to nacred without waiting, and its preview memory.
#define _GNU_SOURCE
#include "ui/live.h"
#include "acquire/endpoint.h"
#include "acquire/preview.h"
#include "acquire/rpc.h"
#include "core/log.h"
#include "core/mem.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

enum { LINE = 1 << 16 };
enum { ASK_HELLO = 1, ASK_PREVIEW, ASK_LIST, ASK_WATCH, ASK_ORDER, ASK_START };

static const double retry_s = 1, list_s = 0.5, look_s = 0.05;

static const char gone[] = "nacred has gone; waiting for it to come back";

struct live {
    char *path;
    int fd;   // -1: not connected
    bool met; // it was connected before
    double next_s;
    struct live_status status;
    struct preview_memory *memory; // NULL: none yet
    uint64_t seen;
    bool fresh; // the memory's frame was not taken yet
    char in[LINE + 1];
    size_t n;
};

bool live_open(struct live **out, const char *socket, struct err *e)
{
    char *path = socket && strcmp(socket, "auto") ? xstrdup(socket) : endpoint_path(e);
    if (!path)
        return false;
    struct live *l = xcalloc(1, sizeof *l);
    l->path = path;
    l->fd = -1;
    *out = l;
    return true;
}

static void forget(struct live *l, const char *why)
{
    if (l->fd >= 0)
        close(l->fd);
    if (l->memory)
        munmap(l->memory, sizeof *l->memory);
    l->fd = -1;
    l->memory = NULL;
    l->n = 0;
    l->seen = 0;
    l->fresh = false;
    const int event = l->status.event + l->status.connected;
    l->status = (struct live_status){.event = event};
    snprintf(l->status.why, sizeof l->status.why, "%s: %s", l->path, why);
}

void live_close(struct live *l)
{
    if (!l)
        return;
    forget(l, "");
    free(l->path);
    free(l);
}

const struct live_status *live_status(const struct live *l)
{
    return &l->status;
}

static void say(struct live *l, char *line) // takes line; a dead daemon is noticed when listening
{
    const ssize_t n = l->fd >= 0 ? send(l->fd, line, strlen(line), MSG_NOSIGNAL) : 0;
    (void)n;
    free(line);
}

static void ask(struct live *l, int id, const char *method)
{
    struct rpc_object *o = rpc_object();
    if (id == ASK_WATCH || id == ASK_ORDER)
        rpc_put_int(o, "capture", l->status.capture);
    say(l, rpc_request(id, method, o));
}

void live_order(struct live *l, const char *method)
{
    if (l->status.capture)
        ask(l, ASK_ORDER, method);
}

void live_start(struct live *l, const char *rig, const char *plan, const char *session)
{
    const struct {
        const char *name, *path;
    } files[] = {{"rig", rig}, {"plan", plan}, {"session", session}};
    struct rpc_object *o = rpc_object();
    for (int k = 0; k < 3; k++) {
        char *path = endpoint_file(files[k].path);
        rpc_put_text(o, files[k].name, path);
        free(path);
    }
    say(l, rpc_request(ASK_START, "capture.start", o));
    snprintf(l->status.last, sizeof l->status.last, "asked for a capture");
    l->status.event++;
}

static void try_connect(struct live *l)
{
    struct sockaddr_un a = {.sun_family = AF_UNIX};
    if (strlen(l->path) >= sizeof a.sun_path) {
        forget(l, "the name is too long for a socket");
        return;
    }
    strcpy(a.sun_path, l->path);
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0 || connect(fd, (struct sockaddr *)&a, sizeof a)) {
        const int why = errno;
        if (fd >= 0)
            close(fd);
        forget(l, why != ENOENT && why != ECONNREFUSED ? strerror(why)
                  : l->met                             ? gone
                                                       : "nacred does not run");
        return;
    }
    l->fd = fd;
    l->met = true;
    l->status.connected = true;
    l->status.event++;
    l->status.why[0] = 0;
    ask(l, ASK_HELLO, "hello");
    ask(l, ASK_PREVIEW, "preview.open");
}

static void take_state(struct live *l, const char *text)
{
    char state[sizeof l->status.state];
    snprintf(state, sizeof state, "%.*s", (int)strcspn(text, "\""), text);
    if (strcmp(state, l->status.state) != 0)
        l->status.event++;
    memcpy(l->status.state, state, sizeof state);
}

// The list that capture.list answers with is looked through as text: rpc.h reads flat values only.
static void take_list(struct live *l, const char *line)
{
    const char *at = strstr(line, "\"capture\":");
    const int64_t capture = at ? strtoll(at + strlen("\"capture\":"), NULL, 10) : 0;
    const char *state = at ? strstr(line, "\"state\":\"") : NULL;
    if (state && capture == l->status.capture)
        take_state(l, state + strlen("\"state\":\""));
    if (capture == l->status.capture)
        return;
    l->status.capture = capture;
    l->status.event++;
    if (capture)
        ask(l, ASK_WATCH, "capture.watch");
}

static void copy_text(char *to, size_t size, const struct rpc_message *m, const char *name)
{
    const char *text = rpc_text(m, name);
    snprintf(to, size, "%s", text ? text : "");
}

static void take_frame(struct live *l, const struct rpc_message *m)
{
    struct live_status *s = &l->status;
    char verdict[32], reason[160];
    s->done = (int)rpc_int(m, "done", s->done);
    s->planned = (int)rpc_int(m, "planned", s->planned);
    copy_text(verdict, sizeof verdict, m, "verdict");
    copy_text(reason, sizeof reason, m, "reason");
    snprintf(s->last, sizeof s->last, "frame %d: %s%s%s", (int)rpc_int(m, "id", 0), verdict,
             *reason ? ", " : "", reason);
}

static void take_line(struct live *l, const char *line)
{
    struct err e;
    enum rpc_code code;
    struct rpc_message *m = rpc_read(line, &code, &e);
    if (!m)
        return;
    struct live_status *s = &l->status;
    const char *event = rpc_method(m);
    const int before = s->event++;
    if (event && !strcmp(event, "capture.frame")) {
        take_frame(l, m);
    } else if (event && !strcmp(event, "capture.end")) {
        copy_text(s->last, sizeof s->last, m, "message");
        s->capture = 0;
    } else if (!event && rpc_is_error(m, &e)) {
        snprintf(s->last, sizeof s->last, "%.200s", e.msg);
    } else if (!event && rpc_id(m) == ASK_HELLO) {
        s->pid = rpc_int(m, "pid", 0);
    } else if (!event && (rpc_id(m) == ASK_WATCH || rpc_id(m) == ASK_START)) {
        s->capture = rpc_int(m, "capture", s->capture);
        copy_text(s->session, sizeof s->session, m, "session");
        copy_text(s->state, sizeof s->state, m, "state");
        s->done = (int)rpc_int(m, "done", 0);
        s->planned = (int)rpc_int(m, "planned", 0);
    } else if (!event && rpc_id(m) == ASK_LIST) {
        s->event = before;
        take_list(l, line);
    }
    rpc_free(m);
}

// A descriptor may come along: the preview's.
static void take_memory(struct live *l, struct msghdr *msg)
{
    for (struct cmsghdr *c = CMSG_FIRSTHDR(msg); c; c = CMSG_NXTHDR(msg, c)) {
        if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_RIGHTS)
            continue;
        int fd;
        memcpy(&fd, CMSG_DATA(c), sizeof fd);
        void *p = mmap(NULL, sizeof *l->memory, PROT_READ, MAP_SHARED, fd, 0);
        close(fd);
        if (p == MAP_FAILED)
            continue;
        if (l->memory)
            munmap(l->memory, sizeof *l->memory);
        l->memory = p;
    }
}

static void listen_once(struct live *l, bool *more)
{
    union {
        struct cmsghdr head;
        char room[CMSG_SPACE(sizeof(int))];
    } control;
    struct iovec to = {l->in + l->n, LINE - l->n};
    struct msghdr msg = {
        .msg_iov = &to, .msg_iovlen = 1, .msg_control = &control, .msg_controllen = sizeof control};
    const ssize_t n = recvmsg(l->fd, &msg, MSG_CMSG_CLOEXEC);
    *more = n > 0;
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) {
        forget(l, gone);
        return;
    }
    if (n < 0)
        return;
    take_memory(l, &msg);
    l->n += (size_t)n;
    l->in[l->n] = 0;
    char *start = l->in, *end;
    while ((end = strchr(start, '\n'))) {
        *end = 0;
        take_line(l, start);
        start = end + 1;
    }
    l->n -= (size_t)(start - l->in);
    memmove(l->in, start, l->n);
    if (l->n == LINE)
        forget(l, "nacred sends too long a line");
}

static const struct preview_picture *newest(const struct live *l)
{
    if (!l->memory || l->memory->magic != PREVIEW_MAGIC)
        return NULL;
    const struct preview_picture *p = &l->memory->picture[atomic_load(&l->memory->current) & 1];
    return p->w > 0 && p->h > 0 && p->w <= PREVIEW_SIDE && p->h <= PREVIEW_SIDE ? p : NULL;
}

bool live_turn(struct live *l)
{
    const int before = l->status.event;
    const double now = now_s();
    if (l->fd < 0 && now >= l->next_s) {
        try_connect(l);
        l->next_s = now + retry_s;
    }
    for (bool more = true; l->fd >= 0 && more;)
        listen_once(l, &more);
    if (l->fd >= 0 && now >= l->next_s) {
        ask(l, ASK_LIST, "capture.list");
        l->next_s = now + list_s;
    }
    const struct preview_picture *p = newest(l);
    l->fresh = l->fresh || (p && p->seq + 1 != l->seen);
    return l->fresh || l->status.event != before;
}

double live_patience(const struct live *l)
{
    const double due = l->next_s - now_s();
    return l->status.capture && due > look_s ? look_s : due > 0 ? due : 0;
}

bool live_take(struct live *l, struct live_frame *f)
{
    const struct preview_picture *p = newest(l);
    struct err e;
    if (!p || !l->fresh)
        return false;
    const uint32_t serial = atomic_load(&p->serial);
    struct live_frame got = {.pattern = p->pattern, .exposure_ns = p->exposure_ns, .seq = p->seq};
    const int w = p->w, h = p->h;
    const double black = p->black, range = p->white - p->black;
    if (w > PREVIEW_SIDE || h > PREVIEW_SIDE || !(range > 0) || !image_init(&got.im, w, h, 1, &e))
        return false;
    for (int k = 0; k < w * h; k++)
        got.im.px[k] = (float)((p->px[k] - black) / range);
    if (serial % 2 || atomic_load(&p->serial) != serial) { // written meanwhile: next time
        image_finish(&got.im);
        return false;
    }
    l->seen = got.seq + 1;
    l->fresh = false;
    *f = got;
    return true;
}

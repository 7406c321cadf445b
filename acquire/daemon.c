// daemon.c - methods, captures, and who is told.
#define _GNU_SOURCE
#include "acquire/daemon.h"
#include "acquire/clock.h"
#include "acquire/preview.h"
#include "acquire/rpc.h"
#include "acquire/server.h"
#include "acquire/shooter.h"
#include "core/mem.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MAX_CAPTURES = 8 };

struct capture {
    struct daemon *daemon;
    int64_t id; // 0: free
    uid_t uid;  // whose it is
    struct shooter *shooter;
    struct server_client *owner; // NULL: gone, or detached
    struct server_client *watcher[SERVER_CLIENTS];
    int n_watchers;
    char *session;
    bool detached, over;
    struct err how;
};

struct daemon {
    struct loop *loop;
    struct server *server;
    const struct drivers *drivers;
    struct preview *preview; // made when first asked for
    struct capture capture[MAX_CAPTURES];
    int64_t last_id, idle_ns;
    struct loop_source *idle, *sweeper;
    bool stopping;
};

static void tell(struct capture *c, const char *line)
{
    if (c->owner)
        server_send(c->owner, line);
    for (int k = 0; k < c->n_watchers; k++)
        server_send(c->watcher[k], line);
}

static void tell_event(struct capture *c, const char *name, struct rpc_object *o)
{
    rpc_put_int(o, "capture", c->id);
    char *line = rpc_event(name, o);
    tell(c, line);
    free(line);
}

static void check_idle(struct daemon *d)
{
    bool busy = server_clients(d->server) > 0;
    for (int k = 0; k < MAX_CAPTURES; k++)
        busy |= d->capture[k].id != 0;
    if (d->stopping) {
        bool running = false;
        for (int k = 0; k < MAX_CAPTURES; k++)
            running |= d->capture[k].id != 0;
        if (!running)
            loop_stop(d->loop);
    }
    loop_arm(d->idle, busy || !d->idle_ns ? 0 : clock_boot_ns() + d->idle_ns);
}

static void idle(void *ctx)
{
    struct daemon *d = ctx;
    loop_stop(d->loop);
}

// --- captures ---

static void frame_kept(void *ctx, const struct session_frame *f, int done, int planned)
{
    struct rpc_object *o = rpc_object();
    rpc_put_int(o, "id", f->id);
    rpc_put_int(o, "step", f->step.index);
    rpc_put_int(o, "attempt", f->attempt);
    rpc_put_text(o, "verdict", f->verdict);
    rpc_put_text(o, "reason", f->reason);
    rpc_put_num(o, "exposure_s", session_exposure_s(f));
    rpc_put_num(o, "saturated", f->saturated);
    rpc_put_int(o, "done", done);
    rpc_put_int(o, "planned", planned);
    tell_event(ctx, "capture.frame", o);
}

static void frame_seen(void *ctx, const struct cam_frame *f, const struct cam_caps *caps)
{
    struct capture *c = ctx;
    if (c->daemon->preview)
        preview_show(c->daemon->preview, f, caps);
}

static void ended(void *ctx, const struct err *how)
{
    struct capture *c = ctx;
    c->over = true;
    c->how = *how;
    loop_arm(c->daemon->sweeper, 1); // the shooter is freed when its own callback has returned
}

static void sweep(void *ctx)
{
    struct daemon *d = ctx;
    for (int k = 0; k < MAX_CAPTURES; k++) {
        struct capture *c = &d->capture[k];
        if (!c->over)
            continue;
        shooter_free(c->shooter); // the session is closed before anyone is told
        struct rpc_object *o = rpc_object();
        rpc_put_int(o, "code", (int)c->how.code);
        rpc_put_text(o, "message", c->how.code ? c->how.msg : "complete");
        tell_event(c, "capture.end", o);
        free(c->session);
        *c = (struct capture){0};
    }
    check_idle(d);
}

// Who may connect may capture and look on; a capture is stopped by its own user, by the daemon's
// and by root.
static bool may(const struct server_client *from, uid_t owner, const char *what, struct err *e)
{
    const uid_t uid = server_uid(from);
    return uid == owner || uid == getuid() || uid == 0 ||
           err_set(e, ERR_DATA, "%s belongs to user %u, you are %u", what, (unsigned)owner,
                   (unsigned)uid);
}

static struct capture *find(struct daemon *d, const struct rpc_message *m, struct err *e)
{
    const int64_t id = rpc_int(m, "capture", 0);
    for (int k = 0; k < MAX_CAPTURES; k++)
        if (id > 0 && d->capture[k].id == id && !d->capture[k].over)
            return &d->capture[k];
    err_set(e, ERR_DATA, "no capture %lld is running", (long long)id);
    return NULL;
}

// --- methods: each answers with a result, or fails with *e ---

typedef struct rpc_object *method_call(struct daemon *d, struct server_client *from,
                                       const struct rpc_message *m, struct err *e);

static struct rpc_object *hello(struct daemon *d, struct server_client *from,
                                const struct rpc_message *m, struct err *e)
{
    struct rpc_object *o = rpc_object();
    (void)d;
    (void)from;
    (void)m;
    (void)e;
    rpc_put_text(o, "program", "nacred");
    rpc_put_text(o, "version", NACRE_VERSION);
    rpc_put_int(o, "protocol", RPC_PROTOCOL);
    rpc_put_int(o, "pid", getpid());
    return o;
}

static void describe(const struct capture *c, struct rpc_object *o)
{
    int done, planned;
    shooter_progress(c->shooter, &done, &planned);
    rpc_put_int(o, "capture", c->id);
    rpc_put_text(o, "session", c->session);
    rpc_put_text(o, "state", shooter_state(c->shooter));
    rpc_put_int(o, "done", done);
    rpc_put_int(o, "planned", planned);
}

static struct rpc_object *capture_start(struct daemon *d, struct server_client *from,
                                        const struct rpc_message *m, struct err *e)
{
    struct capture *c = NULL;
    for (int k = 0; k < MAX_CAPTURES && !c; k++)
        if (!d->capture[k].id)
            c = &d->capture[k];
    if (!c || d->stopping) {
        err_set(e, ERR_DEVICE, d->stopping ? "nacred is ending" : "%d captures are running already",
                MAX_CAPTURES);
        return NULL;
    }
    *c = (struct capture){
        .daemon = d, .session = xstrdup(rpc_text(m, "session")), .detached = rpc_flag(m, "detach")};
    const struct shooter_order order = {.rig = rpc_text(m, "rig"),
                                        .plan = rpc_text(m, "plan"),
                                        .session = c->session,
                                        .resume = rpc_flag(m, "resume"),
                                        .drivers = d->drivers,
                                        .kept = frame_kept,
                                        .seen = frame_seen,
                                        .end = ended,
                                        .ctx = c};
    c->shooter = shooter_new(d->loop, &order, e);
    if (!c->shooter) {
        free(c->session);
        *c = (struct capture){0};
        return NULL;
    }
    c->id = ++d->last_id;
    c->owner = from;
    c->uid = server_uid(from);
    struct rpc_object *o = rpc_object();
    describe(c, o);
    return o;
}

static struct capture *find_own(struct daemon *d, const struct server_client *from,
                                const struct rpc_message *m, struct err *e)
{
    struct capture *c = find(d, m, e);
    return c && may(from, c->uid, "the capture", e) ? c : NULL;
}

static struct rpc_object *capture_pause(struct daemon *d, struct server_client *from,
                                        const struct rpc_message *m, struct err *e)
{
    struct capture *c = find_own(d, from, m, e);
    if (c)
        shooter_pause(c->shooter);
    return c ? rpc_object() : NULL;
}

static struct rpc_object *capture_continue(struct daemon *d, struct server_client *from,
                                           const struct rpc_message *m, struct err *e)
{
    struct capture *c = find_own(d, from, m, e);
    if (c)
        shooter_continue(c->shooter);
    return c ? rpc_object() : NULL;
}

static struct rpc_object *capture_abort(struct daemon *d, struct server_client *from,
                                        const struct rpc_message *m, struct err *e)
{
    struct capture *c = find_own(d, from, m, e);
    if (c)
        shooter_abort(c->shooter);
    return c ? rpc_object() : NULL;
}

static struct rpc_object *capture_watch(struct daemon *d, struct server_client *from,
                                        const struct rpc_message *m, struct err *e)
{
    struct capture *c = find(d, m, e);
    if (!c)
        return NULL;
    bool already = c->owner == from;
    for (int k = 0; k < c->n_watchers; k++)
        already |= c->watcher[k] == from;
    if (!already && c->n_watchers < SERVER_CLIENTS)
        c->watcher[c->n_watchers++] = from;
    struct rpc_object *o = rpc_object();
    describe(c, o);
    return o;
}

static struct rpc_object *capture_list(struct daemon *d, struct server_client *from,
                                       const struct rpc_message *m, struct err *e)
{
    struct rpc_object *list = rpc_object();
    (void)from;
    (void)m;
    (void)e;
    rpc_append(list, "captures", NULL);
    for (int k = 0; k < MAX_CAPTURES; k++)
        if (d->capture[k].id && !d->capture[k].over) {
            struct rpc_object *o = rpc_object();
            describe(&d->capture[k], o);
            rpc_append(list, "captures", o);
        }
    return list;
}

static struct rpc_object *preview_open(struct daemon *d, struct server_client *from,
                                       const struct rpc_message *m, struct err *e)
{
    (void)from;
    (void)m;
    if (!d->preview && !(d->preview = preview_new(e)))
        return NULL;
    struct rpc_object *o = rpc_object();
    rpc_put_int(o, "bytes", (int64_t)sizeof(struct preview_memory));
    return o; // the descriptor goes with the answer
}

static struct rpc_object *daemon_end(struct daemon *d, struct server_client *from,
                                     const struct rpc_message *m, struct err *e)
{
    (void)m;
    if (!may(from, getuid(), "nacred", e))
        return NULL;
    daemon_stop(d);
    return rpc_object();
}

static struct rpc_object *describe_methods(struct daemon *d, struct server_client *from,
                                           const struct rpc_message *m, struct err *e);

static const struct rpc_param none[] = {{0}};
static const struct rpc_param one_capture[] = {
    {"capture", RPC_INT, true, "as capture.start answered"},
    {0},
};
static const struct rpc_param start_params[] = {
    {"rig", RPC_TEXT, true, "absolute path"},
    {"plan", RPC_TEXT, true, "absolute path"},
    {"session", RPC_TEXT, true, "absolute path of the folder to make, or to go on with"},
    {"resume", RPC_FLAG, false, "go on with a session"},
    {"detach", RPC_FLAG, false, "go on when this client goes"},
    {0},
};

static const struct method {
    const char *name, *help;
    const struct rpc_param *params;
    method_call *call;
    bool sends_preview;
} methods[] = {
    {"hello", "program, version, protocol, pid", none, hello, false},
    {"describe", "all methods and their parameters", none, describe_methods, false},
    {"capture.start", "begin; then events capture.frame and capture.end", start_params,
     capture_start, false},
    {"capture.pause", "finish the shot, light off, wait", one_capture, capture_pause, false},
    {"capture.continue", "after a pause", one_capture, capture_continue, false},
    {"capture.abort", "light off, end; what is kept stays", one_capture, capture_abort, false},
    {"capture.watch", "get the events of a capture too", one_capture, capture_watch, false},
    {"capture.list", "captures that run", none, capture_list, false},
    {"preview.open", "shared memory with the newest frame", none, preview_open, true},
    {"daemon.stop", "stop all captures and end", none, daemon_end, false},
};
enum { METHODS = sizeof methods / sizeof *methods };

static struct rpc_object *describe_methods(struct daemon *d, struct server_client *from,
                                           const struct rpc_message *m, struct err *e)
{
    static const char *const kinds[] = {"text", "integer", "boolean"};
    struct rpc_object *list = rpc_object();
    (void)d;
    (void)from;
    (void)m;
    (void)e;
    rpc_put_int(list, "protocol", RPC_PROTOCOL);
    for (int k = 0; k < METHODS; k++) {
        struct rpc_object *o = rpc_object();
        rpc_put_text(o, "method", methods[k].name);
        rpc_put_text(o, "help", methods[k].help);
        rpc_append(o, "params", NULL);
        for (const struct rpc_param *p = methods[k].params; p->name; p++) {
            struct rpc_object *q = rpc_object();
            rpc_put_text(q, "name", p->name);
            rpc_put_text(q, "type", kinds[p->kind]);
            rpc_put_flag(q, "needed", p->needed);
            rpc_put_text(q, "help", p->help);
            rpc_append(o, "params", q);
        }
        rpc_append(list, "methods", o);
    }
    return list;
}

// --- the server's callbacks ---

static void send_error(struct server_client *to, const struct rpc_message *m, int code,
                       const char *text)
{
    char *line = rpc_error(m, code, text);
    server_send(to, line);
    free(line);
}

static void call(struct daemon *d, struct server_client *from, const struct rpc_message *m,
                 const struct method *how)
{
    struct err e = {0};
    if (!rpc_check(m, how->params, &e)) {
        send_error(from, m, RPC_PARAMS, e.msg);
        return;
    }
    struct rpc_object *result = how->call(d, from, m, &e);
    if (!result) {
        send_error(from, m, RPC_ERR - (int)e.code, e.msg);
        return;
    }
    char *line = rpc_reply(m, result);
    if (how->sends_preview)
        server_send_fd(from, line, preview_fd(d->preview));
    else if (rpc_wants_reply(m))
        server_send(from, line);
    free(line);
}

static void line_came(void *ctx, struct server_client *from, const char *text)
{
    struct daemon *d = ctx;
    enum rpc_code code;
    struct err e = {0};
    loop_arm(d->idle, 0);
    struct rpc_message *m = rpc_read(text, &code, &e);
    if (!m) {
        send_error(from, NULL, code, e.msg);
        return;
    }
    const char *name = rpc_method(m);
    const struct method *how = NULL;
    for (int k = 0; name && k < METHODS; k++)
        if (!strcmp(methods[k].name, name))
            how = &methods[k];
    if (how)
        call(d, from, m, how);
    else
        send_error(from, m, RPC_METHOD, "no such method; describe lists them");
    rpc_free(m);
}

static void client_gone(void *ctx, struct server_client *client)
{
    struct daemon *d = ctx;
    for (int k = 0; k < MAX_CAPTURES; k++) {
        struct capture *c = &d->capture[k];
        int kept = 0;
        for (int w = 0; w < c->n_watchers; w++)
            if (c->watcher[w] != client)
                c->watcher[kept++] = c->watcher[w];
        c->n_watchers = kept;
        if (c->id && c->owner == client) {
            c->owner = NULL;
            if (!c->detached && !c->over)
                shooter_abort(c->shooter);
        }
    }
    check_idle(d);
}

struct daemon *daemon_new(struct loop *l, int listening, const struct drivers *drivers)
{
    struct daemon *d = xcalloc(1, sizeof *d);
    d->loop = l;
    d->drivers = drivers;
    d->idle = loop_timer(l, idle, d);
    d->sweeper = loop_timer(l, sweep, d);
    d->server = server_new(l, listening, &(struct server_calls){line_came, client_gone, d});
    return d;
}

void daemon_free(struct daemon *d)
{
    if (!d)
        return;
    for (int k = 0; k < MAX_CAPTURES; k++) {
        shooter_free(d->capture[k].shooter);
        free(d->capture[k].session);
    }
    server_free(d->server);
    preview_free(d->preview);
    loop_drop(d->idle);
    loop_drop(d->sweeper);
    free(d);
}

void daemon_end_when_idle(struct daemon *d, int64_t idle_ns)
{
    d->idle_ns = idle_ns;
    check_idle(d);
}

void daemon_stop(struct daemon *d)
{
    d->stopping = true;
    for (int k = 0; k < MAX_CAPTURES; k++)
        if (d->capture[k].id && !d->capture[k].over)
            shooter_abort(d->capture[k].shooter);
    loop_arm(d->sweeper, 1);
}

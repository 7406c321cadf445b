// main_nacred.c - nacred: owns cameras, triggers and sessions, and does what it is asked.
#define _GNU_SOURCE
#include "acquire/clock.h"
#include "acquire/daemon.h"
#include "acquire/endpoint.h"
#include "acquire/server.h"
#include "acquire/service.h"
#include "acquire/stop.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/units.h"
#include "ui/drivers.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char help[] =
    "usage: nacred [--socket PATH] [--idle TIME]\n"
    "Owns cameras, triggers and sessions; nacre capture starts it when none runs.\n"
    "  --socket PATH  where to listen (default: where clients look; NACRE_SOCKET)\n"
    "  --idle TIME    end when nobody is connected and nothing runs for this long\n"
    "JSON-RPC 2.0, one document a line: docs/protocol.md. Under systemd it takes the socket,\n"
    "says when it is ready and feeds the watchdog.\n";

struct args {
    char *socket; // owned
    double idle_s;
};

static bool parse(int argc, char **argv, struct args *a, struct err *e)
{
    for (int k = 1; k < argc; k++) {
        const bool has_value = k + 1 < argc;
        if (!strcmp(argv[k], "--socket") && has_value)
            a->socket = xstrdup(argv[++k]);
        else if (!strcmp(argv[k], "--idle") && has_value) {
            if (!quantity_parse(argv[++k], UNIT_S, &a->idle_s, e))
                return err_in(e, "--idle");
        } else
            return err_set(e, ERR_USAGE, "'%s' is not understood; see nacred --help", argv[k]);
    }
    return true;
}

struct main {
    struct daemon *daemon;
    struct loop_source *beat;
    int64_t every_ns;
};

static void told_to_end(void *ctx)
{
    struct main *m = ctx;
    if (stop_asked())
        daemon_stop(m->daemon);
}

static void beat(void *ctx)
{
    struct main *m = ctx;
    service_beat();
    loop_arm(m->beat, clock_boot_ns() + m->every_ns);
}

// The log beside the socket (endpoint.h) when it has nothing to say, then the socket.
static void tidy(const char *socket)
{
    char *log = xasprintf("%s.log", socket);
    struct stat st;
    if (!stat(log, &st) && S_ISREG(st.st_mode) && !st.st_size)
        unlink(log);
    unlink(socket);
    free(log);
}

// `path` is unlinked while it is still listened at: a nacred that is started now makes its own.
static bool serve(int listening, const char *path, double idle_s, struct err *e)
{
    struct main m = {.every_ns = service_watchdog_ns()};
    struct loop *l = loop_new();
    m.daemon = daemon_new(l, listening, &all_drivers);
    loop_watch(l, stop_fd(true), told_to_end, &m);
    m.beat = loop_timer(l, beat, &m);
    if (m.every_ns)
        beat(&m);
    daemon_end_when_idle(m.daemon, llround(idle_s * 1e9));
    service_say_ready();
    const bool ok = loop_run(l, e);
    if (path)
        tidy(path);
    service_say_stopping();
    daemon_free(m.daemon);
    loop_free(l);
    return ok;
}

int main(int argc, char **argv)
{
    struct args a = {0};
    struct err e = {0};
    if (argc > 1 && !strcmp(argv[1], "--help")) {
        fputs(help, stdout);
        return 0;
    }
    bool ok = parse(argc, argv, &a, &e);
    int listening = ok ? service_socket() : -1;
    const bool activated = listening >= 0;
    if (ok && !activated) {
        ok = a.socket || (a.socket = endpoint_path(&e));
        listening = ok ? server_listen(a.socket, &e) : -1;
        ok = listening >= 0;
    }
    ok = ok && serve(listening, activated ? NULL : a.socket, a.idle_s, &e);
    free(a.socket);
    if (!ok)
        log_error("nacred: %s", e.msg);
    return ok ? 0 : (int)e.code;
}

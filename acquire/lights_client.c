// lights_client.c - the lights as the run sees them: a trigger whose lines another process holds.
#define _GNU_SOURCE
#include "acquire/clock.h"
#include "acquire/lights.h"
#include "core/datapath.h"
#include "core/mem.h"
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <libgen.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

enum { ANSWER_MS = 300, START_MS = 10000 };
extern char **environ;

struct kept {
    struct trig base; // fd is the socket
    char *rig, *run;
    pid_t pid;
    int64_t started_ns;
    int early_deaths;          // in a row
    char news[LIGHTS_MESSAGE]; // said unasked, not yet passed on
};

static bool died(struct err *e)
{
    return err_set(e, ERR_DEVICE, "nacre-lights has died");
}

// It hangs: nothing comes, or so much waits to be heard that no more fits.
static bool deaf(struct err *e)
{
    return err_set(e, ERR_DEVICE, "nacre-lights does not answer");
}

// The next message, at most `ms` from now; false: none, or the process is gone.
static bool receive(struct kept *k, int ms, char text[LIGHTS_MESSAGE], struct err *e)
{
    struct pollfd p = {k->base.fd, POLLIN, 0};
    const int n = poll(&p, 1, ms);
    if (n <= 0)
        return deaf(e);
    const ssize_t got = recv(k->base.fd, text, LIGHTS_MESSAGE - 1, MSG_DONTWAIT);
    if (got <= 0)
        return died(e);
    text[got] = 0;
    return true;
}

static bool is_news(struct kept *k, const char *text)
{
    if (strncmp(text, "off ", 4) != 0)
        return false;
    snprintf(k->news, sizeof k->news, "%s", text);
    k->base.changed_ns = clock_boot_ns();
    return true;
}

static bool ask(struct kept *k, const char *question, struct err *e)
{
    char text[LIGHTS_MESSAGE];
    int code = 0, at = 0;
    if (send(k->base.fd, question, strlen(question), MSG_NOSIGNAL | MSG_DONTWAIT) < 0)
        return errno == EAGAIN ? deaf(e) : died(e);
    do {
        if (!receive(k, ANSWER_MS, text, e))
            return false;
    } while (is_news(k, text));
    if (sscanf(text, "ok %" SCNd64 " %" SCNd64, &k->base.changed_ns, &k->base.ends_ns) == 2)
        return true;
    if (sscanf(text, "fail %d %n", &code, &at) == 1)
        return err_set(e, (enum err_code)code, "%s", text + at);
    return err_set(e, ERR_DEVICE, "nacre-lights said '%.60s'", text);
}

static char *program(void)
{
    char *self = self_path(), *path = xasprintf("%s/nacre-lights", dirname(self));
    free(self);
    return path;
}

static bool spawn(struct kept *k, int child_end, struct err *e)
{
    char *path = program();
    char *args[] = {path, (char *)"--rig", k->rig, (char *)"--run", k->run, NULL};
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attr;
    sigset_t none;
    sigemptyset(&none);
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_adddup2(&files, child_end, STDIN_FILENO);
    posix_spawnattr_init(&attr);
    posix_spawnattr_setflags(&attr, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSID);
    posix_spawnattr_setsigmask(&attr, &none);
    const int rc = posix_spawn(&k->pid, path, &files, &attr, args, environ);
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attr);
    if (rc)
        err_set(e, ERR_DEVICE, "%s: %s", path, strerror(rc));
    free(path);
    return rc == 0;
}

static bool start(struct kept *k, struct err *e)
{
    int ends[2], at = 0, lines, code;
    char text[LIGHTS_MESSAGE];
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends))
        return err_errno(e, "socketpair");
    const bool spawned = spawn(k, ends[1], e);
    close(ends[1]);
    if (k->base.fd < 0)
        k->base.fd = ends[0];
    else { // the loop goes on watching the same number
        dup3(ends[0], k->base.fd, O_CLOEXEC);
        close(ends[0]);
    }
    if (!spawned || !receive(k, START_MS, text, e))
        return false;
    if (sscanf(text, "ready %d %n", &lines, &at) == 1) {
        k->base.caps.lines = lines;
        snprintf(k->base.caps.model, sizeof k->base.caps.model, "%.63s", text + at);
        k->base.changed_ns = k->started_ns = clock_boot_ns();
        return true;
    }
    if (sscanf(text, "fail %d %n", &code, &at) == 1)
        return err_set(e, (enum err_code)code, "%s", text + at);
    return err_set(e, ERR_DEVICE, "nacre-lights said '%.60s'", text);
}

static void wait_for_end(struct kept *k)
{
    enum { PATIENCE_MS = 2000, EACH_MS = 5 };
    for (int ms = 0; k->pid > 0 && ms < PATIENCE_MS; ms += EACH_MS) {
        if (waitpid(k->pid, NULL, WNOHANG) == k->pid)
            k->pid = 0;
        else
            usleep(1000 * EACH_MS);
    }
}

static void reap(struct kept *k)
{
    if (k->pid > 0)
        kill(k->pid, SIGKILL); // already dead, or hanging: then maybe in the kernel, for ever
    wait_for_end(k);
    k->pid = 0;
}

static bool restart(struct kept *k, struct err *e)
{
    enum { EARLY_NS = 1000000000, MOST = 5 };
    k->early_deaths = clock_boot_ns() - k->started_ns < EARLY_NS ? k->early_deaths + 1 : 0;
    reap(k);
    return k->early_deaths > MOST ? err_set(e, ERR_DEVICE, "it dies again and again") : start(k, e);
}

static bool kept_set(struct trig *t, uint32_t state, struct err *e)
{
    struct kept *k = (struct kept *)t;
    char question[60];
    struct err why;
    snprintf(question, sizeof question, "set %" PRIu32, state);
    if (ask(k, question, e))
        return true;
    if (e->code == ERR_DATA)
        return false;
    // Whatever went wrong, the lights must go off: a new keeper does that at its start.
    if (!restart(k, &why))
        return false;
    snprintf(k->news, sizeof k->news, "nacre-lights started again: %.200s", e->msg);
    return !state || ask(k, question, e);
}

static bool kept_pulse(struct trig *t, uint32_t mask, int64_t duration_ns, struct err *e)
{
    char question[80];
    snprintf(question, sizeof question, "pulse %" PRIu32 " %" PRId64, mask, duration_ns);
    return ask((struct kept *)t, question, e);
}

static void kept_close(struct trig *t)
{
    struct kept *k = (struct kept *)t;
    if (k->base.fd >= 0)
        shutdown(k->base.fd, SHUT_RDWR); // it goes dark and ends
    wait_for_end(k);
    reap(k);
    free(k->rig);
    free(k->run);
}

static const struct trig_driver kept_trig = {
    .name = "nacre-lights",
    .summary = "lines held by nacre-lights",
    .size = sizeof(struct kept),
    .set = kept_set,
    .pulse = kept_pulse,
    .close = kept_close,
};

struct trig *lights_open(const struct rig *rig, const char *run, struct err *e)
{
    struct kept *k = xcalloc(1, sizeof *k);
    k->base = (struct trig){.drv = &kept_trig, .fd = -1};
    k->rig = xstrdup(rig->path);
    k->run = xstrdup(run);
    if (start(k, e) || restart(k, e)) // once more, should it have been killed on its way
        return &k->base;
    trig_close(&k->base);
    return NULL;
}

bool lights_is_kept(const struct trig *t)
{
    return t && t->drv == &kept_trig;
}

void lights_beat(struct trig *t)
{
    if (lights_is_kept(t))
        (void)!send(t->fd, "beat", 4, MSG_NOSIGNAL | MSG_DONTWAIT);
}

bool lights_pump(struct trig *t, char *news, size_t size, struct err *e)
{
    struct kept *k = (struct kept *)t;
    char text[LIGHTS_MESSAGE];
    struct err why;
    *news = 0;
    if (!lights_is_kept(t))
        return true;
    struct pollfd p = {t->fd, POLLIN, 0};
    while (poll(&p, 1, 0) > 0)
        if (!receive(k, 0, text, &why)) {
            if (!restart(k, e))
                return err_in(e, "%s, and cannot be started again", why.msg);
            snprintf(k->news, sizeof k->news, "%.100s; a new one has switched the lines off",
                     why.msg);
        } else {
            is_news(k, text);
        }
    snprintf(news, size, "%.*s", (int)size - 1, k->news);
    k->news[0] = 0;
    return true;
}

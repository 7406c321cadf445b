// lights.c - nacre-lights from the inside: one trigger, one socket, three reasons to go dark.
#define _GNU_SOURCE
#include "acquire/lights.h"
#include "acquire/clock.h"
#include "acquire/loop.h"
#include "acquire/stop.h"
#include <errno.h>
#include <inttypes.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

const int64_t lights_silence_ns = 500000000;

struct keeper {
    struct trig *trig;
    const int64_t *max_on_ns;
    int socket;
    struct loop *loop;
    struct loop_source *timer;
    uint32_t on;
    int64_t off_at_ns[LIGHTS_LINES]; // of lines that are on: by their cap, or the end of a pulse
    bool is_pulse;
    int64_t heard_ns;
    bool broken; // the trigger failed to go dark: try again soon
};

__attribute__((format(printf, 2, 3))) static void say(struct keeper *k, const char *fmt, ...)
{
    char text[LIGHTS_MESSAGE];
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(text, sizeof text, fmt, ap);
    va_end(ap);
    // A peer that does not read must not hold the lights up: it will miss this message.
    (void)!send(k->socket, text, strlen(text), MSG_DONTWAIT | MSG_NOSIGNAL);
}

static int64_t now_or(int64_t a, int64_t b)
{
    return a && a < b ? a : b;
}

static void arm(struct keeper *k)
{
    int64_t at = 0;
    for (int l = 0; l < LIGHTS_LINES; l++)
        if (k->on >> l & 1)
            at = at ? now_or(k->off_at_ns[l], at) : k->off_at_ns[l];
    if (k->on)
        at = now_or(k->heard_ns + lights_silence_ns, at);
    if (k->broken)
        at = clock_boot_ns() + 1000000;
    loop_arm(k->timer, at);
}

static bool switch_to(struct keeper *k, uint32_t mask, struct err *e)
{
    const bool ok = trig_set(k->trig, mask, e);
    k->broken = !ok;
    if (!ok)
        return false;
    const int64_t now = clock_boot_ns();
    for (int l = 0; l < LIGHTS_LINES; l++)
        if (mask >> l & 1 && !(k->on >> l & 1))
            k->off_at_ns[l] = now + k->max_on_ns[l];
    k->on = mask;
    k->is_pulse = false;
    return true;
}

static void go_dark(struct keeper *k, uint32_t lines, const char *reason)
{
    struct err e;
    const uint32_t were_on = k->on & lines;
    if (switch_to(k, k->on & ~lines, &e) && were_on && reason)
        say(k, "off %u %s", were_on, reason);
}

static void time_came(void *ctx)
{
    struct keeper *k = ctx;
    const int64_t now = clock_boot_ns();
    uint32_t expired = 0;
    if (k->broken)
        go_dark(k, UINT32_MAX, "late, the trigger had failed");
    for (int l = 0; l < LIGHTS_LINES; l++)
        if (k->on >> l & 1 && now >= k->off_at_ns[l])
            expired |= UINT32_C(1) << l;
    if (expired)
        go_dark(k, expired, k->is_pulse ? NULL : "on for longer than the rig allows");
    if (k->on && now >= k->heard_ns + lights_silence_ns)
        go_dark(k, UINT32_MAX, "nothing heard for 500 ms");
    arm(k);
}

static bool allowed(struct keeper *k, uint32_t mask, int64_t for_ns, struct err *e)
{
    for (int l = 0; l < LIGHTS_LINES; l++)
        if (mask >> l & 1 && (!k->max_on_ns[l] || for_ns > k->max_on_ns[l]))
            return err_set(e, ERR_DATA, "line %d: %s", l,
                           k->max_on_ns[l] ? "longer than the rig allows" : "not in the rig");
    return true;
}

static bool pulse(struct keeper *k, uint32_t mask, int64_t ns, struct err *e)
{
    if (!allowed(k, mask, ns, e) || !trig_pulse(k->trig, mask, ns, e))
        return false;
    for (int l = 0; l < LIGHTS_LINES; l++)
        if (mask >> l & 1)
            k->off_at_ns[l] = k->trig->ends_ns; // once more, should the device have forgotten
    k->on |= mask;
    k->is_pulse = true;
    return true;
}

static void answer(struct keeper *k, const char *text)
{
    struct err e = {0};
    uint32_t mask;
    int64_t ns;
    bool ok;
    if (!strcmp(text, "beat"))
        return;
    if (sscanf(text, "set %" SCNu32, &mask) == 1)
        ok = allowed(k, mask, 0, &e) && (mask == k->on || switch_to(k, mask, &e));
    else if (sscanf(text, "pulse %" SCNu32 " %" SCNd64, &mask, &ns) == 2)
        ok = pulse(k, mask, ns, &e);
    else
        ok = err_set(&e, ERR_DATA, "not understood");
    if (ok)
        say(k, "ok %" PRId64 " %" PRId64, k->trig->changed_ns, k->trig->ends_ns);
    else
        say(k, "fail %d %s", (int)e.code, e.msg);
}

static void heard(void *ctx)
{
    struct keeper *k = ctx;
    char text[LIGHTS_MESSAGE];
    ssize_t n;
    while ((n = recv(k->socket, text, sizeof text - 1, MSG_DONTWAIT)) > 0) {
        text[n] = 0;
        k->heard_ns = clock_boot_ns();
        answer(k, text);
    }
    if (n == 0 || (errno != EAGAIN && errno != EINTR)) {
        go_dark(k, UINT32_MAX, NULL);
        loop_stop(k->loop);
    }
    arm(k);
}

static void told_to_end(void *ctx)
{
    struct keeper *k = ctx;
    go_dark(k, UINT32_MAX, NULL);
    loop_stop(k->loop);
}

bool lights_serve(struct trig *t, const int64_t max_on_ns[LIGHTS_LINES], int socket, struct err *e)
{
    struct keeper k = {.trig = t, .max_on_ns = max_on_ns, .socket = socket, .loop = loop_new()};
    signal(SIGHUP, SIG_IGN);
    k.timer = loop_timer(k.loop, time_came, &k);
    loop_watch(k.loop, socket, heard, &k);
    loop_watch(k.loop, stop_fd(false), told_to_end, &k); // Ctrl-C is for the other end
    k.heard_ns = clock_boot_ns();
    say(&k, "ready %d %s", t->caps.lines, t->caps.model);
    bool ok = loop_run(k.loop, e);
    for (int tries = 0; k.broken && tries < 1000; tries++) { // the last duty before going
        usleep(1000);
        go_dark(&k, UINT32_MAX, NULL);
    }
    if (k.broken)
        ok = err_set(e, ERR_DEVICE, "a light line could not be switched off");
    loop_free(k.loop);
    return ok;
}

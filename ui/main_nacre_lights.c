// main_nacre_lights.c - nacre-lights: holds the light lines of a rig and nothing else.
//
// Started by nacred with a socket as its standard input. With --off it only switches every line of
// the rig off and ends: for people, and without a rig for ExecStopPost.
#define _GNU_SOURCE
#include "acquire/lights.h"
#include "core/log.h"
#include "ui/drivers.h"
#include "ui/lights_record.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

static const char help[] =
    "usage: nacre-lights --rig RIG [--run NAME] [--off]\n"
    "       nacre-lights --off\n"
    "Holds the light lines of a rig for nacred, which talks to it on standard input.\n"
    "  --rig RIG   the rig file: lines and the longest time that each may be on\n"
    "  --run NAME  what @run in the rig's URIs becomes\n"
    "  --off       switch all lines off and end; without --rig: those of every nacre-lights that "
    "a\n"
    "              service has left behind (RUNTIME_DIRECTORY)\n";

struct args {
    const char *rig, *run;
    bool off;
};

static bool parse(int argc, char **argv, struct args *a, struct err *e)
{
    for (int k = 1; k < argc; k++) {
        const bool has_value = k + 1 < argc;
        if (!strcmp(argv[k], "--off"))
            a->off = true;
        else if (!strcmp(argv[k], "--rig") && has_value)
            a->rig = argv[++k];
        else if (!strcmp(argv[k], "--run") && has_value)
            a->run = argv[++k];
        else
            return err_set(e, ERR_USAGE, "'%s' is not understood; see nacre-lights --help",
                           argv[k]);
    }
    return a->rig || a->off || err_set(e, ERR_USAGE, "needs --rig RIG; see nacre-lights --help");
}

static bool serve(const struct args *a, struct err *e)
{
    struct rig rig;
    int64_t max_on_ns[LIGHTS_LINES] = {0};
    if (!rig_open(&rig, a->rig, e))
        return false;
    for (int k = 0; k < rig.n_lights; k++)
        max_on_ns[rig.light[k].line] = llround(1e9 * rig.light[k].max_on_s);
    bool ok = rig.lights_uri || err_set(e, ERR_DATA, "%s: has no lights", a->rig);
    if (ok) {
        char *uri = rig_uri(&rig, rig.lights_uri, a->run ? a->run : "");
        struct trig *t = trig_open(all_triggers, uri, e); // all lines off
        char *record = a->off ? NULL : lights_record_begin(a->rig, a->run ? a->run : "");
        ok = t && (a->off || lights_serve(t, max_on_ns, STDIN_FILENO, e));
        trig_close(t);
        if (ok)
            lights_record_end(record);
        else // a line that could not be switched off stays known
            free(record);
        free(uri);
    }
    rig_finish(&rig);
    return ok;
}

static bool off(const char *rig, const char *run, struct err *e)
{
    return serve(&(struct args){.rig = rig, .run = run, .off = true}, e);
}

int main(int argc, char **argv)
{
    struct args a = {0};
    struct err e = {0};
    if (argc > 1 && !strcmp(argv[1], "--help")) {
        fputs(help, stdout);
        return 0;
    }
    if (parse(argc, argv, &a, &e) && (a.rig ? serve(&a, &e) : lights_record_each(off, &e)))
        return 0;
    char text[LIGHTS_MESSAGE]; // to whoever waits for "ready"; a person reads it on stderr
    snprintf(text, sizeof text, "fail %d %.400s", (int)e.code, e.msg);
    if (send(STDIN_FILENO, text, strlen(text), MSG_NOSIGNAL | MSG_DONTWAIT) < 0)
        log_error("nacre-lights: %s", e.msg);
    return (int)e.code;
}

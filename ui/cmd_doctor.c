// cmd_doctor.c - nacre doctor: what this machine has, what it lacks, and the remedy for each.
#define _GNU_SOURCE
#include "acquire/endpoint.h"
#include "core/datapath.h"
#include "core/mem.h"
#include "render/gl.h"
#include "ui/commands.h"
#include "ui/doctor.h"
#include "ui/drivers.h"
#include <glob.h>
#include <grp.h>
#include <libgen.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <time.h>
#include <unistd.h>

struct finding {
    enum { FINE, WARN, MISSING } how;
    char *what;         // owned
    const char *remedy; // NULL when fine
};

static struct finding check_memory(void)
{
    const double gb = (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGESIZE) * 1e-9;
    return (struct finding){
        gb < 3 ? WARN : FINE, xasprintf("%d threads, %.1f GB", omp_get_max_threads(), gb),
        gb < 3 ? "tables of 2048 nodes need 2 GB: use --memory or smaller sizes" : NULL};
}

static struct finding check_disk(void)
{
    struct statvfs s;
    if (statvfs(".", &s))
        return (struct finding){WARN, xstrdup("this folder cannot be read"),
                                "run nacre in a folder of yours"};
    const double gb = (double)s.f_bavail * (double)s.f_frsize * 1e-9;
    return (struct finding){gb < 2 ? WARN : FINE, xasprintf("%.1f GB free here", gb),
                            gb < 2 ? "a session of 60 frames of 24 Mpx takes 3 GB: free some space"
                                   : NULL};
}

static struct finding check_clock(void)
{
    struct timex state = {0};
    const bool adrift = adjtimex(&state) == TIME_ERROR;
    const time_t now = time(NULL);
    struct tm t;
    gmtime_r(&now, &t);
    const bool ok = t.tm_year + 1900 >= 2024;
    return (struct finding){ok && !adrift ? FINE : WARN,
                            xasprintf("%04d-%02d-%02d UTC%s", t.tm_year + 1900, t.tm_mon + 1,
                                      t.tm_mday, adrift ? ", not synchronised" : ""),
                            !ok      ? "set the clock: records and sessions are dated"
                            : adrift ? "records are dated: apt install systemd-timesyncd, or chrony"
                                     : NULL};
}

// nacred and nacre-lights lie beside this program, and clients have a safe place to meet them.
static struct finding check_daemon(void)
{
    static const char *const programs[] = {"nacred", "nacre-lights"};
    struct err e = {0};
    char *self = self_path();
    const char *folder = dirname(self);
    struct finding f = {.how = FINE};
    for (int k = 0; !f.what && k < 2; k++) {
        char *path = xasprintf("%s/%s", folder, programs[k]);
        if (access(path, X_OK))
            f = (struct finding){MISSING, xasprintf("%s not found", path),
                                 "install the package nacred, or build all of nacre"};
        free(path);
    }
    char *socket = f.what ? NULL : endpoint_path(&e);
    if (socket)
        f.what = xasprintf("at %s", socket);
    else if (!f.what)
        f = (struct finding){MISSING, xstrdup(e.msg), "or set NACRE_SOCKET to a path of yours"};
    free(socket);
    free(self);
    return f;
}

static bool is_member(gid_t group)
{
    gid_t all[256];
    const int n = getgroups(256, all);
    bool is = getegid() == group;
    for (int k = 0; k < n; k++)
        is = is || all[k] == group;
    return is;
}

// Who may use the devices and the service: the group of the udev rules and of the socket.
static struct finding check_group(void)
{
    const struct group *g = getgrnam("nacre");
    if (!g)
        return (struct finding){FINE, xstrdup("no group 'nacre' (the simulated rig needs none)"),
                                NULL};
    const bool in = !getuid() || is_member(g->gr_gid);
    return (struct finding){
        in ? FINE : WARN,
        xasprintf("%s the group 'nacre'", in ? "may do what is allowed to" : "not in"),
        in ? NULL : "sudo adduser $USER nacre, and log in again"};
}

static struct finding check_rules(void)
{
    static const char *const folders[] = {"/etc/udev/rules.d", "/usr/lib/udev/rules.d",
                                          "/lib/udev/rules.d"};
    for (int k = 0; k < 3; k++) {
        char *path = xasprintf("%s/70-nacre.rules", folders[k]);
        if (!access(path, R_OK))
            return (struct finding){FINE, path, NULL};
        free(path);
    }
    glob_t g;
    const bool any = !glob("/dev/video*", 0, NULL, &g) || !glob("/dev/gpiochip*", 0, NULL, &g);
    return (struct finding){
        any ? WARN : FINE, xstrdup("no udev rules installed (the simulated rig needs none)"),
        any ? "copy acquire/udev/70-nacre.rules to /etc/udev/rules.d, or install nacred" : NULL};
}

static bool has_driver(const char *name)
{
    for (const struct cam_driver *const *d = all_drivers.cameras; *d; d++)
        if (!strcmp((*d)->name, name))
            return true;
    for (const struct trig_driver *const *d = all_triggers; *d; d++)
        if (!strcmp((*d)->name, name))
            return true;
    return false;
}

// Drivers whose library was not there when this program was built.
static struct finding check_drivers(void)
{
    static const char *const of_devices[] = {"v4l2", "libcamera", "gpiod", "usb"};
    char *list[2] = {xstrdup(""), xstrdup("")}; // without, with
    for (size_t k = 0; k < sizeof of_devices / sizeof *of_devices; k++) {
        char **in = &list[has_driver(of_devices[k])];
        char *longer = xasprintf("%s%s%s", *in, **in ? " " : "", of_devices[k]);
        free(*in);
        *in = longer;
    }
    const struct finding f = {
        *list[0] ? WARN : FINE,
        *list[0] ? xasprintf("%s; without %s", list[1], list[0]) : xstrdup(list[1]),
        *list[0] ? "install the -dev package that docs/devices.md names, and build again" : NULL};
    free(list[0]);
    free(list[1]);
    return f;
}

static struct finding check_data(void)
{
    struct err e = {0};
    char *path = data_path("rigs/sim.yaml", &e);
    if (path)
        return (struct finding){FINE, path, NULL};
    return (struct finding){MISSING, xstrdup("rigs/sim.yaml not found"),
                            "set NACRE_DATA to the folder that holds rigs/"};
}

// Device nodes of a kind: how many there are, and whether this user may open them.
static struct finding check_nodes(const char *pattern, const char *kind, const char *remedy)
{
    glob_t g;
    int all = 0, usable = 0;
    if (!glob(pattern, 0, NULL, &g)) {
        all = (int)g.gl_pathc;
        for (size_t k = 0; k < g.gl_pathc; k++)
            usable += !access(g.gl_pathv[k], R_OK | W_OK);
        globfree(&g);
    }
    if (!all)
        return (struct finding){FINE, xasprintf("no %s (the simulated rig needs none)", kind),
                                NULL};
    return (struct finding){usable < all ? WARN : FINE,
                            xasprintf("%d %s, %d usable", all, kind, usable),
                            usable < all ? remedy : NULL};
}

static struct finding check_cameras(void)
{
    return check_nodes("/dev/video*", "video devices",
                       "install the udev rules, or join the group 'video' and log in again");
}

static struct finding check_gpio(void)
{
    return check_nodes("/dev/gpiochip*", "GPIO chips",
                       "install the udev rules, or join the group 'gpio'");
}

static struct finding check_gl(void)
{
    struct gl_context *c = NULL;
    struct err e = {0};
    if (!gl_context_open(&c, &e))
        return (struct finding){WARN, xstrdup(e.msg),
                                "install libegl1 and libgl1-mesa-dri, or render --backend cpu"};
    char *name = xstrdup(gl_name());
    gl_context_close(c);
    return (struct finding){FINE, name, NULL};
}

static const struct check {
    const char *name;
    struct finding (*look)(void);
} checks[] = {
    {"machine", check_memory}, {"disk", check_disk},       {"clock", check_clock},
    {"data", check_data},      {"daemon", check_daemon},   {"group", check_group},
    {"rules", check_rules},    {"drivers", check_drivers}, {"cameras", check_cameras},
    {"gpio", check_gpio},      {"gl", check_gl},
};

struct args {
    bool devices;
};

static bool run(const void *p, struct cli *cli, struct err *e)
{
    const struct args *a = p;
    static const char *const words[] = {"fine", "warning", "missing"};
    int missing = 0;
    if (a->devices) {
        doctor_devices(cli);
        return true;
    }
    doc_text(cli->doc, "version", NACRE_VERSION);
    for (size_t k = 0; k < sizeof checks / sizeof *checks; k++) {
        struct finding f = checks[k].look();
        if (cli->json) {
            struct doc *item = doc_item(cli->doc, "checks");
            doc_text(item, "name", checks[k].name);
            doc_text(item, "state", words[f.how]);
            doc_text(item, "found", f.what);
            doc_text(item, "remedy", f.remedy);
        } else {
            char *line =
                xasprintf("%s%s%s%s", f.how == FINE ? "" : words[f.how], f.how == FINE ? "" : ": ",
                          f.what, f.remedy ? "\n                         " : "");
            char *whole = xasprintf("%s%s", line, f.remedy ? f.remedy : "");
            doc_text(cli->doc, checks[k].name, whole);
            free(whole);
            free(line);
        }
        missing += f.how == MISSING;
        free(f.what);
    }
    return !missing || err_set(e, ERR_PARTIAL, "%d thing(s) missing, see above", missing);
}

static const struct opt opts[] = {
    {.name = "devices",
     .kind = OPT_FLAG,
     .at = offsetof(struct args, devices),
     .help = "list the drivers of cameras, lights and filters, their options, and what they see"},
    {0},
};

const struct command cmd_doctor = {
    .name = "doctor",
    .summary = "check this machine and name the remedy for what is amiss",
    .operands = "",
    .opts = opts,
    .args_size = sizeof(struct args),
    .run = run,
};

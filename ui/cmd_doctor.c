// cmd_doctor.c - nacre doctor: what this machine has, what it lacks, and the remedy for each.
#define _GNU_SOURCE
#include "core/datapath.h"
#include "core/mem.h"
#include "render/gl.h"
#include "ui/commands.h"
#include "ui/doctor.h"
#include <glob.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
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
    const time_t now = time(NULL);
    struct tm t;
    gmtime_r(&now, &t);
    const bool ok = t.tm_year + 1900 >= 2024;
    return (struct finding){
        ok ? FINE : WARN,
        xasprintf("%04d-%02d-%02d UTC", t.tm_year + 1900, t.tm_mon + 1, t.tm_mday),
        ok ? NULL : "set the clock: records and sessions are dated"};
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
                       "add yourself to the group 'video' and log in again");
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
    {"machine", check_memory},  {"disk", check_disk}, {"clock", check_clock}, {"data", check_data},
    {"cameras", check_cameras}, {"gpio", check_gpio}, {"gl", check_gl},
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
    .summary = "check this machine: cores, disk, data, devices, GL",
    .operands = "",
    .opts = opts,
    .args_size = sizeof(struct args),
    .run = run,
};

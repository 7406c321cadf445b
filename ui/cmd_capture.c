// cmd_capture.c - nacre capture: shoot a plan on a rig into a session.
#define _GNU_SOURCE
#include "acquire/shooter.h"
#include "core/datapath.h"
#include "core/log.h"
#include "core/mem.h"
#include "ui/commands.h"
#include "ui/drivers.h"
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/signalfd.h>
#include <unistd.h>

struct args {
    const char *rig, *plan, *out;
    bool dry_run, resume;
};

// A file as given, else one that ships ("rigs/sim.yaml" works from any folder).
static char *find_file(const char *given)
{
    struct err ignored;
    char *shipped = access(given, F_OK) ? data_path(given, &ignored) : NULL;
    return shipped ? shipped : xstrdup(given);
}

static void describe(const struct plan_report *r, struct doc *d)
{
    doc_int(d, "frames", r->frames);
    doc_int(d, "brackets", r->groups);
    doc_num(d, "duration_s", r->duration_s);
    doc_num(d, "bytes", r->bytes);
    doc_num(d, "free_bytes", r->free_bytes);
    for (int k = 0; k < r->n_rounded; k++) {
        struct doc *item = doc_item(d, "rounded");
        doc_num(item, "asked_s", 1e-9 * (double)r->rounded[k][0]);
        doc_num(item, "becomes_s", 1e-9 * (double)r->rounded[k][1]);
    }
}

struct capture {
    struct loop *loop;
    struct shooter *shooter;
    struct progress bar;
    int signals, bad;
    struct err how;
};

static void kept(void *ctx, const struct session_frame *f, int done, int planned)
{
    struct capture *c = ctx;
    if (strcmp(f->verdict, "good") != 0) {
        c->bad++;
        log_warn("step %d, shot %d: %s: %s", f->step.index, f->attempt, f->verdict, f->reason);
    }
    c->bar.total = planned;
    progress_step(&c->bar, done - c->bar.done);
}

static void ended(void *ctx, const struct err *how)
{
    struct capture *c = ctx;
    c->how = *how;
    loop_stop(c->loop);
}

static void interrupted(void *ctx)
{
    struct capture *c = ctx;
    struct signalfd_siginfo info;
    if (read(c->signals, &info, sizeof info) == sizeof info)
        shooter_abort(c->shooter);
}

static bool shoot(struct shooter_order *order, struct capture *c, struct err *e)
{
    sigset_t set, before;
    sigemptyset(&set);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    sigprocmask(SIG_BLOCK, &set, &before); // before the drivers start their threads
    c->loop = loop_new();
    order->kept = kept;
    order->end = ended;
    order->ctx = c;
    c->shooter = shooter_new(c->loop, order, e);
    bool ok = c->shooter != NULL;
    if (ok) {
        int planned;
        long done;
        int before_done;
        shooter_progress(c->shooter, &before_done, &planned);
        done = before_done;
        progress_start(&c->bar, "capturing", planned);
        progress_step(&c->bar, done);
        c->signals = signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
        loop_watch(c->loop, c->signals, interrupted, c);
        ok = loop_run(c->loop, e);
        progress_end(&c->bar);
        if (ok && c->how.code) {
            *e = c->how;
            ok = false;
        }
        close(c->signals);
    }
    shooter_free(c->shooter);
    loop_free(c->loop);
    sigprocmask(SIG_SETMASK, &before, NULL);
    return ok;
}

static bool report(const char *folder, struct cli *cli, struct err *e)
{
    struct session *s;
    struct session_report r;
    if (!session_open(&s, folder, SESSION_READ, e))
        return false;
    const bool ok = session_status(s, &r, e);
    session_close(s);
    if (!ok)
        return false;
    doc_text(cli->doc, "session", folder);
    doc_text(cli->doc, "status", session_state_name[r.state]);
    doc_int(cli->doc, "frames", r.good);
    doc_int(cli->doc, "planned", r.planned);
    doc_int(cli->doc, "rejected", r.other);
    return true;
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    struct capture c = {0};
    struct plan_report plan;
    char *rig = find_file(a->rig), *plan_file = find_file(a->plan);
    struct shooter_order order = {.rig = rig,
                                  .plan = plan_file,
                                  .session = a->out,
                                  .resume = a->resume,
                                  .drivers = &all_drivers};
    bool ok;
    if (a->dry_run) {
        ok = shooter_check(&order, &plan, e);
        if (ok)
            describe(&plan, cli->doc);
    } else {
        struct err why;
        ok = shoot(&order, &c, e);
        if (ok || e->code == ERR_PARTIAL)
            ok = report(a->out, cli, ok ? e : &why) && ok;
    }
    free(rig);
    free(plan_file);
    return ok;
}

#define AT(field) offsetof(struct args, field)
static const struct opt options[] = {
    {"rig", OPT_FILE, AT(rig), "RIG", "rigs/sim.yaml", "camera, lights and filters"},
    {"plan", OPT_FILE, AT(plan), "PLAN", "rigs/plans/bracket.yaml", "what to shoot"},
    {"o", OPT_FILE, AT(out), "SESSION", NULL, "the folder to make", .needed = true},
    {"dry-run", OPT_FLAG, AT(dry_run),
     .help = "only check the plan: time, space, limits, rounding; no light goes on"},
    {"resume", OPT_FLAG, AT(resume),
     .help = "go on with a session: what is proven is kept, the rest is shot"},
    {0},
};

const struct command cmd_capture = {
    .name = "capture",
    .summary = "shoot a plan on a rig into a session",
    .operands = "",
    .opts = options,
    .args_size = sizeof(struct args),
    .notes = "Every frame is on disk, with its SHA-256 in the ledger, before it counts. Ctrl-C\n"
             "switches the light off and leaves a session that --resume completes.\n"
             "  nacre capture --rig rigs/sim.yaml --plan rigs/plans/bracket.yaml -o lcd\n"
             "  nacre capture --rig rigs/sim.yaml --plan rigs/plans/full.yaml -o full --dry-run\n",
    .run = run,
};

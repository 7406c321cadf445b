// cmd_capture.c - nacre capture: shoot a plan on a rig into a session.
#define _GNU_SOURCE
#include "acquire/shooter.h"
#include "core/datapath.h"
#include "core/log.h"
#include "ui/commands.h"
#include "ui/drivers.h"
#include "ui/remote.h"
#include <stdlib.h>
#include <string.h>

struct args {
    const char *rig, *plan, *out;
    bool dry_run, resume;
};

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

static void kept(void *ctx, int step, int attempt, const char *verdict, const char *reason,
                 int done, int planned)
{
    struct progress *bar = ctx;
    if (strcmp(verdict, "good") != 0)
        log_warn("step %d, shot %d: %s: %s", step, attempt, verdict, reason);
    bar->total = planned;
    progress_step(bar, done - bar->done);
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

static bool check(const struct args *a, const char *rig, const char *plan, struct cli *cli,
                  struct err *e)
{
    struct plan_report r;
    const struct shooter_order order = {
        .rig = rig, .plan = plan, .session = a->out, .drivers = &all_drivers};
    if (!shooter_check(&order, &r, e))
        return false;
    describe(&r, cli->doc);
    return true;
}

static bool shoot(const struct args *a, const char *rig, const char *plan, struct cli *cli,
                  struct err *e)
{
    struct progress bar;
    struct err why;
    const struct remote_order order = {.rig = rig,
                                       .plan = plan,
                                       .session = a->out,
                                       .resume = a->resume,
                                       .kept = kept,
                                       .ctx = &bar};
    progress_start(&bar, "capturing", 0);
    const bool ok = remote_capture(&order, e);
    progress_end(&bar);
    return (ok || e->code == ERR_PARTIAL) && report(a->out, cli, ok ? e : &why) && ok;
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct args *a = args;
    char *rig = data_file(a->rig), *plan = data_file(a->plan);
    const bool ok = a->dry_run ? check(a, rig, plan, cli, e) : shoot(a, rig, plan, cli, e);
    free(rig);
    free(plan);
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

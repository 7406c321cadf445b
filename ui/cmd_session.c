// cmd_session.c - nacre session: look at a session, prove it, make its products again, export it.
#define _GNU_SOURCE
#include "core/mem.h"
#include "core/session.h"
#include "ui/commands.h"
#include "ui/session_verbs.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// For people one line a frame; the whole truth under --json.
static void list_frame(const struct session_frame *f, struct cli *cli)
{
    const char *key = strcmp(f->verdict, "good") ? "rejected" : "frames";
    if (cli->json) {
        session_describe_frame(f, doc_item(cli->doc, key));
        return;
    }
    char asked[40], seen[40] = "-", *name = xasprintf("%.*s", 40, f->path);
    quantity_text(session_exposure_s(f), UNIT_S, asked, sizeof asked);
    if (f->measured_ns)
        quantity_text(1e-9 * (double)f->measured_ns, UNIT_S, seen, sizeof seen);
    for (char *c = name; *c; c++) // a dot would nest the key
        *c = *c == '.' ? ' ' : *c;
    name[strcspn(name, " ")] = 0;
    char *line =
        xasprintf("%-9s %-8s %-9s measured %-9s %4.1f %% saturated  %s%s%s",
                  *f->step.light ? f->step.light : "dark", *f->step.filter ? f->step.filter : "-",
                  asked, seen, 100 * f->saturated, f->verdict, *f->reason ? ": " : "", f->reason);
    doc_text(cli->doc, name, line);
    free(name);
    free(line);
}

static bool show(struct session *s, const struct session_args *a, struct cli *cli, struct err *e)
{
    (void)a;
    struct session_report r;
    struct session_frame *frame;
    int n;
    if (!session_status(s, &r, e) || !session_frames(s, false, &frame, &n, e))
        return false;
    char *created = session_get(s, "created"), *version = session_get(s, "nacre.version");
    char digest[SHA256_TEXT];
    if (!session_digest(s, digest, e))
        return false;
    doc_text(cli->doc, "session", session_folder(s));
    doc_text(cli->doc, "created", created);
    doc_text(cli->doc, "version", version);
    doc_text(cli->doc, "sha256", digest);
    session_describe_state(&r, cli->doc);
    if (cli->json) { // also when there is none
        doc_list(cli->doc, "frames");
        doc_list(cli->doc, "rejected");
    }
    for (int k = 0; k < n; k++)
        list_frame(&frame[k], cli);
    const bool ok = session_describe_meterings(s, cli->doc, e) &&
                    (!cli->json || session_describe_history(s, cli->doc, e)) &&
                    session_describe_products(s, cli->doc, e);
    free(created);
    free(version);
    free(frame);
    return ok;
}

static bool verify(struct session *s, const struct session_args *a, struct cli *cli, struct err *e)
{
    (void)a;
    struct session_report r;
    if (!session_verify(s, &r, e))
        return false;
    session_describe_state(&r, cli->doc);
    if (r.state == SESSION_DAMAGED)
        return err_set(e, ERR_DATA, "%s: damaged: %s%s", session_folder(s), r.problem[0],
                       r.n_problems > 1 ? " (and more)" : "");
    return r.state == SESSION_COMPLETE ||
           err_set(e, ERR_PARTIAL, "%s: partial: %d of %d%s frames", session_folder(s), r.good,
                   r.planned, r.is_final ? "" : " or more");
}

static const struct {
    const char *name;
    bool (*call)(struct session *s, const struct session_args *a, struct cli *cli, struct err *e);
} jobs[] = {
    {"show", show},
    {"verify", verify},
    {"replay", session_replay},
    {"export", session_export},
};
enum { JOBS = sizeof jobs / sizeof *jobs };

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct session_args *a = args;
    const char *verb = cli->operand[0];
    struct session *s;
    size_t k = 0;
    while (k < JOBS && strcmp(verb, jobs[k].name) != 0)
        k++;
    if (k == JOBS)
        return err_set(e, ERR_USAGE, "'%s' is not one of show, verify, replay, export", verb);
    if (!session_open(&s, cli->operand[1], SESSION_READ, e))
        return false;
    const bool ok = jobs[k].call(s, a, cli, e);
    session_close(s);
    return ok;
}

#define AT(field) offsetof(struct session_args, field)
static const struct opt options[] = {
    {"o", OPT_FILE, AT(out), "FOLDER", NULL, "the folder to make", .verbs = "export"},
    {"verify", OPT_FLAG, AT(verify), .help = "only compare; nothing is replaced",
     .verbs = "replay"},
    {0},
};

static const struct verb verbs[] = {
    {"show", "SESSION", "what was planned and photographed; --json has every detail"},
    {"verify", "SESSION", "read every file again: is it complete, partial or damaged?"},
    {"replay", "SESSION", "make every product again by its own command, compare the bytes"},
    {"export", "SESSION", "a BagIt folder: every file with its SHA-256, the ledger as JSON"},
    {0},
};

const struct command cmd_session = {
    .name = "session",
    .summary = "look at a session, prove it, make its products again, export it",
    .operands = "show|verify|replay|export SESSION",
    .min_operands = 2,
    .max_operands = 2,
    .opts = options,
    .args_size = sizeof(struct session_args),
    .verbs = verbs,
    .notes = "verify ends with 0 when the session is complete, 6 when partial, 3 when damaged;\n"
             "replay with 0 when all bytes are the same, 6 when not, naming which. Products are\n"
             "files that -o puts into SESSION/products, and those made from SESSION elsewhere.\n\n"
             "  nacre session show lcd --json\n"
             "  nacre hdr lcd -o lcd/products/radiance.exr; nacre session replay lcd --verify\n"
             "  nacre session export lcd -o lcd-bag",
    .run = run,
};

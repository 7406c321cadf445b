// session_replay.c - a session's products once more, by the commands that made them.
//
// A product is proven when the file is as recorded, all that it was made from is as it was then,
// and its command makes the same bytes again.
#define _GNU_SOURCE
#include "core/log.h"
#include "core/mem.h"
#include "core/product.h"
#include "ui/child.h"
#include "ui/provenance.h"
#include "ui/session_verbs.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct replay {
    struct session *session;
    char *folder;  // the session's, absolute
    char *scratch; // NULL: products are made in their places
    int bad, skipped;
    char first[300]; // what is said of the first bad one
};

static bool is_inside(const struct product *p)
{
    return !*p->folder;
}

static char *full_path(const struct replay *r, const struct product *p, const char *path)
{
    const char *from = is_inside(p) ? r->folder : p->folder;
    return *path == '/' ? xstrdup(path) : xasprintf("%s/%s", from, path);
}

static bool same_sum(const char *path, const char *sum, const char *what, char *why, size_t size)
{
    struct err e;
    char hex[SHA256_TEXT];
    const bool read = product_hash(path, hex, &e);
    if (read && !strcmp(hex, sum))
        return true;
    if (read)
        snprintf(why, size, "%s", what);
    else
        snprintf(why, size, "%.*s", (int)size - 1, e.msg);
    return false;
}

// The file as it is now. Elsewhere than in the session it may be gone: that is its user's business.
static bool check_file(const struct replay *r, const struct product *p, char *why, size_t size)
{
    if (!r->scratch || !is_inside(p))
        return true;
    char *path = full_path(r, p, p->path);
    const bool ok = same_sum(path, p->sha256, "the file is not the one that was made", why, size);
    free(path);
    return ok;
}

static bool check_inputs(const struct replay *r, const struct product *p, char *why, size_t size)
{
    bool ok = true;
    for (int k = 0; ok && k < p->n_inputs; k++) {
        const bool is_session = is_inside(p) && !strcmp(p->input[k].path, ".");
        char *path = full_path(r, p, p->input[k].path);
        char *what = xasprintf("its input %s has changed since",
                               is_session ? "(the session's frames)" : p->input[k].path);
        ok = same_sum(path, p->input[k].sha256, what, why, size);
        free(what);
        free(path);
    }
    return ok;
}

// A session may have been moved since a command read it to make a file elsewhere. That file is not
// part of the session, and its command cannot be run any more.
static bool is_out_of_reach(const struct replay *r, const struct product *p)
{
    bool gone = false;
    for (int k = 0; !is_inside(p) && k < p->n_inputs; k++) {
        char *path = full_path(r, p, p->input[k].path);
        gone |= access(path, F_OK) != 0;
        free(path);
    }
    return gone;
}

static bool make_again(const struct replay *r, const struct product *p, const char *path, char *why,
                       size_t size)
{
    struct child c = {0};
    struct err e = {0};
    const char *words = strchr(p->command, ' ');
    setenv(PROVENANCE_INSTEAD, path, 1);
    const bool ran =
        child_run_in(is_inside(p) ? r->folder : p->folder, words ? words + 1 : "", &c, &e);
    unsetenv(PROVENANCE_INSTEAD);
    const int status = c.status;
    child_finish(&c);
    if (ran && !status)
        return true;
    if (ran)
        snprintf(why, size, "its command ended with exit code %d", status);
    else
        snprintf(why, size, "%.*s", (int)size - 1, e.msg);
    return false;
}

// Where the product is made now: the suffix chooses the format, so it stays.
static char *place(const struct replay *r, const struct product *p)
{
    const char *name = strrchr(p->path, '/');
    return r->scratch ? xasprintf("%s%s%s", r->scratch, name ? "" : "/", name ? name : p->path)
                      : full_path(r, p, p->path);
}

static void replay_one(struct replay *r, const struct product *p, struct cli *cli)
{
    struct doc *d = doc_item(cli->doc, "products");
    doc_text(d, "path", p->path);
    doc_text(d, "command", p->command);
    if (is_out_of_reach(r, p)) {
        doc_text(d, "result", "skipped: it lies elsewhere, and what it was made from is gone");
        r->skipped++;
        return;
    }
    char why[300] = "";
    char *path = place(r, p);
    const double start_s = now_s();
    const bool same =
        check_inputs(r, p, why, sizeof why) && check_file(r, p, why, sizeof why) &&
        make_again(r, p, path, why, sizeof why) &&
        same_sum(path, p->sha256, "made again, it is not the same bytes", why, sizeof why);
    if (r->scratch)
        unlink(path);
    free(path);
    if (strcmp(p->version, NACRE_VERSION) != 0)
        log_warn("%s: was made by nacre %s, this is " NACRE_VERSION, p->path, p->version);
    doc_text(d, "result", same ? "same" : why);
    doc_num(d, "time_s", now_s() - start_s);
    if (!same && !r->bad++)
        snprintf(r->first, sizeof r->first, "%.100s: %.190s", p->path, why);
}

static bool replay_all(struct replay *r, const struct product *p, int n, struct cli *cli,
                       struct err *e)
{
    struct session_report report;
    if (!session_verify(r->session, &report, e))
        return false;
    if (report.state == SESSION_DAMAGED)
        return err_set(e, ERR_PARTIAL, "%s: its frames are not what they were: %s", r->folder,
                       report.problem[0]);
    for (int k = 0; k < n; k++)
        replay_one(r, &p[k], cli);
    doc_int(cli->doc, "same", n - r->bad - r->skipped);
    doc_int(cli->doc, "skipped", r->skipped);
    doc_int(cli->doc, "differ", r->bad);
    if (!n)
        log_note("%s: nothing was made from this session yet", r->folder);
    return !r->bad || err_set(e, ERR_PARTIAL, "%s: %d of %d products cannot be proven: %s",
                              r->folder, r->bad, n, r->first);
}

bool session_replay(struct session *s, const struct session_args *a, struct cli *cli, struct err *e)
{
    struct product *p;
    int n;
    const char *tmp = getenv("TMPDIR");
    struct replay r = {.session = s, .folder = realpath(session_folder(s), NULL)};
    if (!r.folder)
        return err_errno(e, "%s", session_folder(s));
    if (a->verify)
        r.scratch = xasprintf("%s/nacre-replay-XXXXXX", tmp && *tmp ? tmp : "/tmp");
    bool ok = (!r.scratch || mkdtemp(r.scratch) || err_errno(e, "%s", r.scratch)) &&
              product_list(s, &p, &n, e);
    if (ok) {
        doc_list(cli->doc, "products");
        ok = replay_all(&r, p, n, cli, e);
        for (int k = 0; k < n; k++)
            product_finish(&p[k]);
        free(p);
    }
    if (r.scratch)
        rmdir(r.scratch);
    free(r.scratch);
    free(r.folder);
    return ok;
}

// provenance.c - finds the paths among a command's words, and the session that they belong to.
#define _GNU_SOURCE
#include "ui/provenance.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/product.h"
#include "ui/words.h"
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

struct provenance {
    int argc;
    char **argv; // [argc] words as the command has them
    char **own;  // [n_own] words of argv that are allocated here
    int n_own;
    const char **out;   // the value of -o, in args
    const char ***path; // [n_paths] other words that are paths, in args or cli->operand
    int n_paths;
    const char ***list; // [n_lists] words that are lists with paths in them, in args
    int n_lists;
    char *session, *line; // NULL: nothing is recorded; NULL: as it was typed
    bool inside;          // the product lies in the session
    struct product product;
};

// Whether a word is one of those that "auto|srgb|FILE rest" offers.
static bool is_keyword(const char *offered, const char *word)
{
    const size_t len = strlen(word), end = offered ? strcspn(offered, " ") : 0;
    for (size_t at = 0; at < end; at += strcspn(offered + at, "| ") + 1)
        if (!strncmp(offered + at, word, len) && strchr("| ", offered[at + len]))
            return true;
    return false;
}

static bool holds_path(const struct opt *o)
{
    return o->kind == OPT_FILE || (o->kind == OPT_TEXT && o->arg && strstr(o->arg, "FILE"));
}

// Lists of records or pictures: "FILE,..", "IMAGE,..".
static bool holds_paths(const struct opt *o)
{
    return o->kind == OPT_LIST && (strstr(o->arg, "FILE,") || strstr(o->arg, "IMAGE,"));
}

static void add_path(struct provenance *p, const char **at, const char *offered)
{
    if (*at && !is_keyword(offered, *at) && !access(*at, F_OK)) {
        p->path = xrealloc(p->path, (size_t)p->n_paths + 1, sizeof *p->path);
        p->path[p->n_paths++] = at;
    }
}

static void find_paths(struct provenance *p, const struct command *cmd, void *args, struct cli *cli)
{
    for (const struct opt *o = cmd->opts; o && o->name; o++) {
        const char **at = (const char **)((char *)args + o->at);
        if (!strcmp(o->name, "o") && o->kind == OPT_FILE)
            p->out = at;
        else if (holds_path(o))
            add_path(p, at, o->arg);
        else if (holds_paths(o) && *at) {
            p->list = xrealloc(p->list, (size_t)p->n_lists + 1, sizeof *p->list);
            p->list[p->n_lists++] = at;
        }
    }
    for (int k = 0; k < cli->n; k++)
        add_path(p, (const char **)&cli->operand[k], k ? NULL : cmd->operands);
}

static bool is_session_folder(const char *path)
{
    char *ledger = xasprintf("%s/ledger.db", path);
    const bool there = !access(ledger, F_OK);
    free(ledger);
    return there;
}

// Where -o will be: its folder must exist, the file need not. Allocated, or NULL.
static char *real_output(const char *out)
{
    char folder[PATH_MAX], *slash = strrchr(out, '/');
    char *given =
        slash ? xasprintf("%.*s", slash == out ? 1 : (int)(slash - out), out) : xstrdup(".");
    const bool there = realpath(given, folder) != NULL;
    free(given);
    return there ? xasprintf("%s/%s", folder[1] ? folder : "", slash ? slash + 1 : out) : NULL;
}

// The session in whose products/ a file lies; allocated, or NULL.
static char *session_of(const char *file)
{
    for (const char *at = file; (at = strstr(at, "/products/")); at++) {
        char *folder = xasprintf("%.*s", (int)(at - file), file);
        if (is_session_folder(folder))
            return folder;
        free(folder);
    }
    return NULL;
}

// A path as it is called from within `folder`.
static char *from_within(const char *folder, const char *path)
{
    char real[PATH_MAX];
    const size_t n = strlen(folder);
    const char *full = realpath(path, real) ? real : path;
    if (strncmp(full, folder, n) != 0 || (full[n] && full[n] != '/'))
        return xstrdup(full);
    return xstrdup(full[n] ? full + n + 1 : ".");
}

// The same of each path in a list.
static char *all_from_within(const char *folder, const char *list)
{
    char *copy = xstrdup(list), *rest = copy, *all = NULL;
    for (char *one; (one = strsep(&rest, ","));) {
        char *path = access(one, F_OK) ? xstrdup(one) : from_within(folder, one);
        char *longer = xasprintf("%s%s%s", all ? all : "", all ? "," : "", path);
        free(path);
        free(all);
        all = longer;
    }
    free(copy);
    return all;
}

static char *keep(struct provenance *p, char *word)
{
    p->own = xrealloc(p->own, (size_t)p->n_own + 1, sizeof *p->own);
    return p->own[p->n_own++] = word;
}

// The word that *at points to, or ends in ("--name=word"), becomes another one; takes it.
static void replace(struct provenance *p, const char **at, char *path)
{
    for (int k = 0; k < p->argc; k++)
        for (size_t skip = 0; skip <= strlen(p->argv[k]); skip++)
            if (p->argv[k] + skip == *at) {
                p->argv[k] = keep(p, xasprintf("%.*s%s", (int)skip, p->argv[k], path));
                *at = p->argv[k] + skip;
                free(path);
                return;
            }
    free(path); // a default: it is no path of the user's
}

// From here on the command runs in the session's folder.
static bool go_inside(struct provenance *p, char *real_out, struct err *e)
{
    for (int k = 0; k < p->n_paths; k++)
        replace(p, p->path[k], from_within(p->session, *p->path[k]));
    for (int k = 0; k < p->n_lists; k++)
        replace(p, p->list[k], all_from_within(p->session, *p->list[k]));
    replace(p, p->out, from_within(p->session, real_out));
    p->line = words_join(p->argc, p->argv);
    p->product.path = xstrdup(*p->out);
    p->product.folder = xstrdup("");
    return !chdir(p->session) || err_errno(e, "%s", p->session);
}

static bool note_input(struct provenance *p, const char *path, struct err *e)
{
    char hex[SHA256_TEXT];
    struct stat st;
    if (stat(path, &st) || (!S_ISREG(st.st_mode) && !is_session_folder(path)))
        return true;
    if (!product_hash(path, hex, e))
        return false;
    product_add_input(&p->product, path, hex);
    return true;
}

static bool note_inputs(struct provenance *p, struct err *e)
{
    bool ok = true;
    for (int k = 0; ok && k < p->n_paths; k++)
        ok = note_input(p, *p->path[k], e);
    for (int k = 0; ok && k < p->n_lists; k++) {
        char *copy = xstrdup(*p->list[k]), *rest = copy;
        for (char *one; ok && (one = strsep(&rest, ","));)
            ok = note_input(p, one, e);
        free(copy);
    }
    return ok;
}

static char *first_session(const struct provenance *p)
{
    for (int k = 0; k < p->n_paths; k++)
        if (is_session_folder(*p->path[k]))
            return realpath(*p->path[k], NULL);
    return NULL;
}

bool provenance_begin(struct provenance **out, const struct command *cmd, void *args,
                      struct cli *cli, int argc, char **argv, struct err *e)
{
    struct provenance *p = *out = xcalloc(1, sizeof *p);
    p->argc = argc;
    p->argv = xcalloc((size_t)argc, sizeof *p->argv);
    memcpy(p->argv, argv, (size_t)argc * sizeof *argv);
    find_paths(p, cmd, args, cli);
    char *real_out = p->out && *p->out ? real_output(*p->out) : NULL;
    if (!real_out)
        return true;
    p->session = session_of(real_out);
    p->inside = p->session != NULL;
    bool ok = true;
    if (p->inside) {
        ok = go_inside(p, real_out, e);
        cli->line = p->line;
    } else if ((p->session = first_session(p))) {
        p->product.path = xstrdup(real_out);
        p->product.folder = realpath(".", NULL);
    }
    free(real_out);
    const char *instead = getenv(PROVENANCE_INSTEAD);
    if (instead) {
        *p->out = keep(p, xstrdup(instead));
        unsetenv(PROVENANCE_INSTEAD);
        log_quiet = true;
        free(p->session);
        p->session = NULL;
    }
    if (ok && p->session) {
        p->product.command = xstrdup(cli->line);
        p->product.version = xstrdup(NACRE_VERSION);
        ok = note_inputs(p, e);
    }
    return ok;
}

static bool record(struct provenance *p, struct err *e)
{
    struct stat st;
    struct err ignored;
    struct timespec now;
    if (stat(*p->out, &st) || !S_ISREG(st.st_mode))
        return true; // a folder, such as an export
    clock_gettime(CLOCK_REALTIME, &now);
    p->product.utc_ns = (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
    const bool ok = sha256_file(*p->out, p->product.sha256, e) &&
                    product_record(p->session, &p->product, p->inside ? e : &ignored);
    return ok || !p->inside; // a session that cannot be written can still be used
}

bool provenance_end(struct provenance *p, bool done, struct err *e)
{
    if (!p)
        return true;
    const bool ok = !done || !p->session || record(p, e);
    for (int k = 0; k < p->n_own; k++)
        free(p->own[k]);
    free(p->own);
    free(p->argv);
    free(p->path);
    free(p->list);
    free(p->session);
    free(p->line);
    product_finish(&p->product);
    free(p);
    return ok;
}

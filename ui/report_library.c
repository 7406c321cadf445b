// report_library.c - reads the list of a library and the cards, times and logs that it names.
#define _GNU_SOURCE
#include "ui/report_library.h"
#include "core/infile.h"
#include "core/mem.h"
#include "core/yaml.h"
#include "ui/doc.h"
#include "ui/report.h"
#include <libgen.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MOST_TEXT = 16 << 20 };

// Files of a list are named from its folder; those of a page too.
struct place {
    char *folder;
};

static char *below(const struct place *p, const char *file)
{
    return *file == '/' ? xstrdup(file) : xasprintf("%s/%s", p->folder, file);
}

static bool is_there(const struct place *p, const char *file)
{
    char *path = below(p, file);
    const bool there = !access(path, F_OK);
    free(path);
    return there;
}

static char *slurp(const struct place *p, const char *file)
{
    struct err ignored;
    size_t size;
    char *path = below(p, file), *text = infile_slurp(path, MOST_TEXT, &size, &ignored);
    free(path);
    return text;
}

const struct stage *entry_stage(const struct entry *s, const char *name)
{
    for (int k = 0; k < s->n_stages; k++)
        if (!strcmp(s->stage[k].name, name))
            return &s->stage[k];
    return NULL;
}

// Snakemake's benchmark: a line of names, a line of values; seconds first, then h:m:s, peak MB.
static void take_time(struct stage *s, const char *text)
{
    const char *values = text ? strchr(text, '\n') : NULL;
    s->seconds = s->peak_mb = NAN;
    if (values && sscanf(values, " %lf %*s %lf", &s->seconds, &s->peak_mb) < 1)
        s->seconds = NAN;
}

// The last line that says something.
static char *last_words(const char *text)
{
    const char *end = text + strlen(text);
    while (end > text && strchr(" \n\r", end[-1]))
        end--;
    const char *begin = end;
    while (begin > text && begin[-1] != '\n')
        begin--;
    return end > begin ? xasprintf("%.*s", (int)(end - begin), begin) : NULL;
}

// The first stage in the order of work that has no product but last words; else the first with a
// log. (When a job of several stages fails on a cluster, what it had made is removed with it.)
static void find_failure(struct entry *s, const struct place *p, struct ynode *stages)
{
    for (int k = 0; !s->reason && k < s->n_stages; k++) {
        const char *log = ynode_text(ymap_find(ylist_at(stages, k), "log"));
        if (is_there(p, s->stage[k].file) || !is_there(p, log))
            continue;
        char *text = slurp(p, log);
        s->reason = text ? last_words(text) : NULL;
        if (s->reason || !s->failed)
            s->failed = s->stage[k].name;
        free(text);
    }
}

static char *card_text(const struct doc *card, const char *stage, const char *what)
{
    char *key = xasprintf("files.%s.%s", stage, what);
    const char *text = doc_get_text(card, key);
    free(key);
    return text ? xstrdup(text) : NULL;
}

static bool take_card(struct entry *s, const struct place *p, struct err *e)
{
    const char *file = s->stage[s->n_stages - 1].file;
    char *text = slurp(p, file);
    struct doc *card = text ? doc_parse(text) : NULL;
    free(text);
    if (!card)
        return err_set(e, ERR_DATA, "%s: not a card of nacre report sample", file);
    s->error = doc_get_num(card, "error");
    s->tables_error = doc_get_num(card, "tables_error");
    for (int k = 0; k < s->n_stages; k++) {
        s->stage[k].sha256 = card_text(card, s->stage[k].name, "sha256");
        s->stage[k].command = card_text(card, s->stage[k].name, "command");
    }
    doc_free(card);
    return true;
}

static bool take_stage(struct stage *s, const struct place *p, struct ynode *at, struct err *e)
{
    const char *log, *time = NULL;
    if (!ymap_text(at, "stage", Y_NEEDED, &s->name, e) ||
        !ymap_text(at, "file", Y_NEEDED, &s->file, e) || !ymap_text(at, "log", Y_NEEDED, &log, e) ||
        !ymap_text(at, "time", Y_OPTIONAL, &time, e))
        return false;
    char *text = time ? slurp(p, time) : NULL;
    take_time(s, text);
    free(text);
    return true;
}

static bool take_entry(struct entry *s, const struct place *p, struct ynode *at, struct err *e)
{
    struct ynode *stages;
    if (!ymap_text(at, "name", Y_NEEDED, &s->name, e) ||
        !ymap_list(at, "stages", Y_NEEDED, &stages, e))
        return false;
    s->n_stages = ylist_count(stages);
    if (!s->n_stages)
        return yaml_bad(stages, e, "no stages; the last one must be the sample's card");
    s->stage = xcalloc((size_t)s->n_stages, sizeof *s->stage);
    s->error = s->tables_error = s->peak_mb = NAN;
    for (int k = 0; k < s->n_stages; k++) {
        struct stage *one = &s->stage[k];
        if (!take_stage(one, p, ylist_at(stages, k), e))
            return false;
        s->seconds += isnan(one->seconds) ? 0 : one->seconds;
        s->peak_mb = fmax(s->peak_mb, one->peak_mb);
    }
    s->done = is_there(p, s->stage[s->n_stages - 1].file);
    if (s->done)
        return take_card(s, p, e);
    find_failure(s, p, stages);
    return true;
}

static void library_finish(struct library *l)
{
    for (int k = 0; k < l->n; k++) {
        for (int i = 0; i < l->entry[k].n_stages; i++) {
            free(l->entry[k].stage[i].sha256);
            free(l->entry[k].stage[i].command);
        }
        free(l->entry[k].stage);
        free(l->entry[k].reason);
    }
    free(l->entry);
}

static bool take_list(struct library *l, const struct place *p, struct yaml *y, struct err *e)
{
    struct ynode *samples;
    l->title = "Library of samples";
    if (!ymap_text(yaml_root(y), "title", Y_OPTIONAL, &l->title, e) ||
        !ymap_list(yaml_root(y), "samples", Y_NEEDED, &samples, e))
        return false;
    const int n = ylist_count(samples);
    l->entry = xcalloc((size_t)n + 1, sizeof *l->entry);
    for (; l->n < n; l->n++) {
        struct entry *s = &l->entry[l->n];
        if (!take_entry(s, p, ylist_at(samples, l->n), e)) {
            l->n++; // what it holds by now is freed, too
            return false;
        }
        l->n_done += s->done;
    }
    return true;
}

static void tell(const struct library *l, const char *folder, struct cli *cli)
{
    char *page = xasprintf("%s/index.html", folder), *csv = xasprintf("%s/samples.csv", folder);
    doc_text(cli->doc, "page", page);
    doc_text(cli->doc, "csv", csv);
    doc_int(cli->doc, "samples", l->n);
    doc_int(cli->doc, "done", l->n_done);
    for (int k = 0; k < l->n; k++) {
        const struct entry *s = &l->entry[k];
        if (s->done)
            continue;
        struct doc *item = doc_item(cli->doc, "missing");
        doc_text(item, "name", s->name);
        doc_text(item, "stage", s->failed ? s->failed : "");
        doc_text(item, "reason", s->reason ? s->reason : "");
    }
    free(page);
    free(csv);
}

bool report_library(const struct report_args *a, struct cli *cli, struct err *e)
{
    if (cli->n != 2)
        return err_set(e, ERR_USAGE, "library takes one list");
    const char *list = cli->operand[1];
    char *copy = xstrdup(list);
    const struct place p = {dirname(copy)};
    struct library l = {0};
    struct yaml *y = NULL;
    bool ok = yaml_open(&y, list, e) && take_list(&l, &p, y, e) &&
              library_write_page(&l, a->out, e) && library_write_csv(&l, a->out, e);
    if (ok) {
        tell(&l, a->out, cli);
        ok = l.n_done == l.n ||
             err_set(e, ERR_PARTIAL, "%d of %d samples are done; %s/index.html names the others",
                     l.n_done, l.n, a->out);
    }
    library_finish(&l);
    yaml_close(y, false, &(struct err){0});
    free(copy);
    return ok;
}

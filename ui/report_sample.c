// report_sample.c - the card of one sample: its files, their sums, and how they were made.
#define _GNU_SOURCE
#include "core/hfield_file.h"
#include "core/imgfile.h"
#include "core/infile.h"
#include "core/mem.h"
#include "core/outfile.h"
#include "core/product.h"
#include "core/yaml.h"
#include "ui/doc.h"
#include "ui/report.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_JSON = 16 << 20 };

static void set_text(struct doc *card, const char *stage, const char *what, const char *text)
{
    char *key = xasprintf("files.%s.%s", stage, what);
    if (text)
        doc_text(card, key, text);
    free(key);
}

static void take_meta(struct doc *card, const char *stage, const struct meta *m)
{
    const struct meta_item *error = meta_find(m, "nacre.error_l2"); // of the first 1, 2, ... tables
    set_text(card, stage, "command", meta_text(m, "nacre.command"));
    set_text(card, stage, "version", meta_text(m, "nacre.version"));
    if (error && error->n)
        doc_num(card, "tables_error", error->num[error->n - 1]);
}

static bool take_record(struct doc *card, const char *stage, const char *path, struct err *e)
{
    struct yaml *y = NULL;
    const char *command = NULL, *version = NULL;
    const bool ok = yaml_open(&y, path, e) &&
                    ymap_text(yaml_root(y), "command", Y_OPTIONAL, &command, e) &&
                    ymap_text(yaml_root(y), "version", Y_OPTIONAL, &version, e);
    if (ok) {
        set_text(card, stage, "command", command);
        set_text(card, stage, "version", version);
    }
    yaml_close(y, false, &(struct err){0});
    return ok;
}

// The document of nacre compare.
static bool take_error(struct doc *card, const char *path, struct err *e)
{
    size_t size;
    char *text = infile_slurp(path, MOST_JSON, &size, e);
    struct doc *d = text ? doc_parse(text) : NULL;
    const bool ok = !text ? err_in(e, "%s", path)
                          : d != NULL || err_set(e, ERR_DATA, "%s: not a JSON object", path);
    if (d && isfinite(doc_get_num(d, "relative_l2"))) {
        doc_num(card, "error", doc_get_num(d, "relative_l2"));
        doc_num(card, "worst_of_peak", doc_get_num(d, "worst_of_peak"));
    }
    doc_free(d);
    free(text);
    return ok;
}

static bool take_told(struct doc *card, const char *stage, const char *path, struct err *e)
{
    const char *end = path_ext(path);
    struct image im = {0};
    struct hfield hf = {0};
    bool ok = true;
    if (!strcmp(end, ".json"))
        ok = take_error(card, path, e);
    else if (!strcmp(end, ".yaml"))
        ok = take_record(card, stage, path, e);
    else if (path_is_height(path) && (ok = hfield_read(&hf, path, NULL, e)))
        take_meta(card, stage, &hf.meta);
    else if (!strcmp(end, ".exr") && (ok = image_read(&im, path, e)))
        take_meta(card, stage, &im.meta);
    image_finish(&im);
    hfield_finish(&hf);
    return ok;
}

// A session is its ledger, whose clocks differ from day to day: its sum is that of what was
// photographed.
static bool sum(const char *path, char hex[SHA256_TEXT], struct err *e)
{
    const char *name = strrchr(path, '/');
    if (!name || strcmp(name, "/ledger.db") != 0)
        return sha256_file(path, hex, e);
    char *folder = xasprintf("%.*s", (int)(name - path), path);
    const bool ok = product_hash(folder, hex, e);
    free(folder);
    return ok;
}

static bool add(struct doc *card, const char *word, struct err *e)
{
    char hex[SHA256_TEXT];
    const char *path = strchr(word, '=');
    if (!path || path == word || !path[1])
        return err_set(e, ERR_USAGE, "'%.80s' is not STAGE=FILE", word);
    char *stage = xasprintf("%.*s", (int)(path - word), word);
    const bool known = !strchr(stage, '.') ||
                       err_set(e, ERR_USAGE, "'%.80s': a stage has no dot in its name", stage);
    const bool ok = known && sum(++path, hex, e) && take_told(card, stage, path, e);
    if (ok) {
        set_text(card, stage, "path", path);
        set_text(card, stage, "sha256", hex);
    }
    free(stage);
    return ok;
}

bool report_sample(const struct report_args *a, struct cli *cli, struct err *e)
{
    struct doc *card = doc_new();
    char *text = NULL;
    size_t size = 0;
    bool ok = true;
    doc_text(card, "name", cli->operand[1]);
    doc_text(card, "version", NACRE_VERSION);
    for (int k = 2; ok && k < cli->n; k++)
        ok = add(card, cli->operand[k], e);
    if (ok) {
        FILE *f = open_memstream(&text, &size);
        doc_print(card, true, f);
        fclose(f);
        ok = outfile_write(a->out, text, size, e);
        doc_text(cli->doc, "output", a->out);
        doc_int(cli->doc, "files", cli->n - 2);
    }
    free(text);
    doc_free(card);
    return ok;
}

// yaml.c - libyaml's document tree behind typed, line-aware reading.
#define _GNU_SOURCE
#include "core/yaml.h"
#include "core/mem.h"
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <yaml.h>

enum { MAX_DEPTH = 32, MAX_NODES = 100000 };

struct ynode {
    struct yaml *file;
    const char *key; // in the map above; "" in a list
    const char *text;
    int line;
    enum { SCALAR, MAP, LIST } kind;
    int n;
    struct ynode **child; // [n], owned
    bool known;           // a key that somebody asked for
    const char **asked;   // [n_asked] keys asked of this map, for "did you mean"
    int n_asked;
};

struct yaml {
    char *name;
    yaml_document_t doc;
    struct ynode *root;
};

static void node_free(struct ynode *n)
{
    if (!n)
        return;
    for (int k = 0; k < n->n; k++)
        node_free(n->child[k]);
    free(n->child);
    free(n->asked);
    free(n);
}

static struct ynode *node_new(struct yaml *y, int id, const char *key, int depth, int *budget,
                              struct err *e)
{
    const yaml_node_t *from = yaml_document_get_node(&y->doc, id);
    if (depth > MAX_DEPTH || --*budget < 0) { // aliases may nest without end
        err_set(e, ERR_DATA, "%s: nested too deeply or too large", y->name);
        return NULL;
    }
    struct ynode *n = xcalloc(1, sizeof *n);
    *n = (struct ynode){.file = y, .key = key, .text = "", .line = (int)from->start_mark.line + 1};
    if (from->type == YAML_SCALAR_NODE) {
        n->text = (const char *)from->data.scalar.value;
        return n;
    }
    const bool map = from->type == YAML_MAPPING_NODE;
    n->kind = map ? MAP : LIST;
    const int count = map ? (int)(from->data.mapping.pairs.top - from->data.mapping.pairs.start)
                          : (int)(from->data.sequence.items.top - from->data.sequence.items.start);
    n->child = xcalloc((size_t)count, sizeof(struct ynode *));
    for (int k = 0; k < count; k++) {
        const char *name = "";
        int value;
        if (map) {
            const yaml_node_pair_t *pair = &from->data.mapping.pairs.start[k];
            const yaml_node_t *kn = yaml_document_get_node(&y->doc, pair->key);
            name = kn->type == YAML_SCALAR_NODE ? (const char *)kn->data.scalar.value : "";
            value = pair->value;
            for (int p = 0; p < n->n; p++)
                if (!strcmp(n->child[p]->key, name)) {
                    err_set(e, ERR_DATA, "%s:%d: %s: given twice", y->name,
                            (int)kn->start_mark.line + 1, name);
                    node_free(n);
                    return NULL;
                }
        } else {
            value = from->data.sequence.items.start[k];
        }
        struct ynode *c = node_new(y, value, name, depth + 1, budget, e);
        if (!c) {
            node_free(n);
            return NULL;
        }
        n->child[n->n++] = c;
    }
    return n;
}

static bool load(struct yaml **out, const char *name, const char *text, size_t size, struct err *e)
{
    struct yaml *y = xcalloc(1, sizeof *y);
    y->name = xstrdup(name);
    yaml_parser_t parser;
    yaml_parser_initialize(&parser);
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, size);
    const bool parsed = yaml_parser_load(&parser, &y->doc);
    if (!parsed)
        err_set(e, ERR_DATA, "%s:%d: not YAML: %s", name, (int)parser.problem_mark.line + 1,
                parser.problem ? parser.problem : "cannot be read");
    else if (!yaml_document_get_root_node(&y->doc))
        err_set(e, ERR_DATA, "%s: is empty", name);
    else {
        int budget = MAX_NODES;
        y->root = node_new(y, 1, "", 0, &budget, e);
    }
    const bool ok = y->root && (y->root->kind == MAP ||
                                err_set(e, ERR_DATA, "%s:1: expected 'key: value' lines", name));
    if (!ok) {
        node_free(y->root);
        if (parsed)
            yaml_document_delete(&y->doc);
    }
    yaml_parser_delete(&parser);
    if (!ok) {
        free(y->name);
        free(y);
        return false;
    }
    *out = y;
    return true;
}

bool yaml_open_text(struct yaml **y, const char *name, const char *text, struct err *e)
{
    return load(y, name, text, strlen(text), e);
}

bool yaml_open(struct yaml **y, const char *path, struct err *e)
{
    enum { LIMIT = 4 << 20 };
    FILE *f = fopen(path, "rb");
    if (!f)
        return err_errno(e, "%s", path);
    char *text = xcalloc(LIMIT, 1);
    const size_t n = fread(text, 1, LIMIT, f);
    const bool failed = ferror(f) != 0;
    if (failed)
        err_errno(e, "%s", path);
    fclose(f);
    const bool ok = !failed && (n < LIMIT || err_set(e, ERR_DATA, "%s: longer than 4 MiB", path)) &&
                    load(y, path, text, n, e);
    free(text);
    return ok;
}

struct ynode *yaml_root(struct yaml *y)
{
    y->root->known = true;
    return y->root;
}

// Edit distance, for "did you mean"; keys are short.
static int distance(const char *a, const char *b)
{
    enum { LONGEST = 40 };
    const size_t na = strlen(a), nb = strlen(b);
    if (na > LONGEST || nb > LONGEST)
        return LONGEST;
    int row[LONGEST + 1];
    for (size_t j = 0; j <= nb; j++)
        row[j] = (int)j;
    for (size_t i = 1; i <= na; i++) {
        int diagonal = row[0];
        row[0] = (int)i;
        for (size_t j = 1; j <= nb; j++) {
            const int up = row[j], change = diagonal + (a[i - 1] != b[j - 1]);
            const int least = up < row[j - 1] ? up + 1 : row[j - 1] + 1;
            row[j] = least < change ? least : change;
            diagonal = up;
        }
    }
    return row[nb];
}

static bool check_known(const struct ynode *n, struct err *e)
{
    for (int k = 0; k < n->n; k++) {
        const struct ynode *c = n->child[k];
        if (n->kind == MAP && !c->known && n->known && n->n_asked) {
            const char *best = n->asked[0];
            for (int a = 1; a < n->n_asked; a++)
                if (distance(n->asked[a], c->key) < distance(best, c->key))
                    best = n->asked[a];
            return yaml_bad(c, e, "unknown key, did you mean '%s'?", best);
        }
        if ((c->known || n->kind == LIST) && !check_known(c, e))
            return false;
    }
    return true;
}

bool yaml_close(struct yaml *y, bool strict, struct err *e)
{
    if (!y)
        return true;
    const bool ok = !strict || check_known(y->root, e);
    node_free(y->root);
    yaml_document_delete(&y->doc);
    free(y->name);
    free(y);
    return ok;
}

bool yaml_bad(const struct ynode *n, struct err *e, const char *fmt, ...)
{
    char what[200];
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(what, sizeof what, fmt, ap);
    va_end(ap);
    return err_set(e, ERR_DATA, "%s:%d: %s%s%s", n->file->name, n->line, n->key,
                   *n->key ? ": " : "", what);
}

struct ynode *ymap_find(struct ynode *map, const char *key)
{
    if (map->kind != MAP)
        return NULL;
    map->asked = xrealloc(map->asked, (size_t)map->n_asked + 1, sizeof *map->asked);
    map->asked[map->n_asked++] = key;
    for (int k = 0; k < map->n; k++)
        if (!strcmp(map->child[k]->key, key)) {
            map->child[k]->known = true;
            return map->child[k];
        }
    return NULL;
}

bool ynode_is_map(const struct ynode *n)
{
    return n->kind == MAP;
}
bool ynode_is_list(const struct ynode *n)
{
    return n->kind == LIST;
}
int ylist_count(const struct ynode *n)
{
    return n->kind == LIST ? n->n : 0;
}
const char *ynode_text(const struct ynode *n)
{
    return n->text;
}
int ynode_line(const struct ynode *n)
{
    return n->line;
}
const char *ynode_key(const struct ynode *n)
{
    return n->key;
}

struct ynode *ylist_at(struct ynode *list, int k)
{
    list->child[k]->known = true;
    return list->child[k];
}

// Finds a key; *found NULL when it is absent and may be.
static bool find(struct ynode *map, const char *key, enum yneed need, struct ynode **found,
                 struct err *e)
{
    *found = ymap_find(map, key);
    return *found || need == Y_OPTIONAL || yaml_bad(map, e, "needs the key '%s'", key);
}

bool ynode_num(struct ynode *n, enum unit unit, double lo, double hi, double *out, struct err *e)
{
    struct err why;
    double value;
    if (n->kind != SCALAR)
        return yaml_bad(n, e, "expected %s", unit_example(unit));
    if (!quantity_parse(n->text, unit, &value, &why))
        return yaml_bad(n, e, "%s", why.msg);
    if (value < lo || value > hi) {
        char a[40], b[40];
        quantity_text(lo, unit, a, sizeof a);
        quantity_text(hi, unit, b, sizeof b);
        if (isinf(hi))
            return yaml_bad(n, e, "%s is out of range: must be at least %s", n->text, a);
        return yaml_bad(n, e, "%s is out of range: must be %s to %s", n->text, a, b);
    }
    *out = value;
    return true;
}

bool ymap_num(struct ynode *map, const char *key, enum yneed need, enum unit unit, double lo,
              double hi, double *out, struct err *e)
{
    struct ynode *n;
    return find(map, key, need, &n, e) && (!n || ynode_num(n, unit, lo, hi, out, e));
}

bool ymap_int(struct ynode *map, const char *key, enum yneed need, int lo, int hi, int *out,
              struct err *e)
{
    struct ynode *n;
    double value;
    if (!find(map, key, need, &n, e))
        return false;
    if (!n)
        return true;
    if (!ynode_num(n, UNIT_NONE, lo, hi, &value, e))
        return false;
    if (value != floor(value))
        return yaml_bad(n, e, "%s is not a whole number", n->text);
    *out = (int)value;
    return true;
}

bool ymap_bool(struct ynode *map, const char *key, enum yneed need, bool *out, struct err *e)
{
    int which = *out;
    if (!ymap_choice(map, key, need, "false|true|no|yes|off|on|0|1", &which, e))
        return false;
    *out = which % 2 != 0;
    return true;
}

bool ymap_text(struct ynode *map, const char *key, enum yneed need, const char **out, struct err *e)
{
    struct ynode *n;
    if (!find(map, key, need, &n, e))
        return false;
    if (n && n->kind != SCALAR)
        return yaml_bad(n, e, "expected a text");
    if (n)
        *out = n->text;
    return true;
}

bool ymap_choice(struct ynode *map, const char *key, enum yneed need, const char *choices, int *out,
                 struct err *e)
{
    struct ynode *n;
    if (!find(map, key, need, &n, e))
        return false;
    if (!n)
        return true;
    const size_t len = strlen(n->text);
    int k = 0;
    for (const char *s = choices;; k++) {
        const char *end = strchrnul(s, '|');
        if (len && (size_t)(end - s) == len && !strncasecmp(s, n->text, len)) {
            *out = k;
            return true;
        }
        if (!*end)
            return yaml_bad(n, e, "'%s' is not one of %s", n->text, choices);
        s = end + 1;
    }
}

bool ymap_map(struct ynode *map, const char *key, enum yneed need, struct ynode **out,
              struct err *e)
{
    struct ynode *n;
    if (!find(map, key, need, &n, e))
        return false;
    if (n && n->kind != MAP)
        return yaml_bad(n, e, "expected a map of 'key: value' lines");
    if (n)
        *out = n;
    return true;
}

bool ymap_list(struct ynode *map, const char *key, enum yneed need, struct ynode **out,
               struct err *e)
{
    struct ynode *n;
    if (!find(map, key, need, &n, e))
        return false;
    if (n && n->kind != LIST)
        return yaml_bad(n, e, "expected a list");
    if (n)
        *out = n;
    return true;
}

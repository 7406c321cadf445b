// doc.c - results as one JSON document or as aligned lines; jansson stays in this file.
#define _GNU_SOURCE
#include "ui/doc.h"
#include "core/mem.h"
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct doc {
    json_t *object;
    struct doc *next; // items handed out by doc_item(), freed with the root
};

struct doc *doc_new(void)
{
    struct doc *d = xcalloc(1, sizeof *d);
    d->object = json_object();
    return d;
}

void doc_free(struct doc *d)
{
    if (!d)
        return;
    json_decref(d->object);
    while (d) {
        struct doc *next = d->next;
        free(d);
        d = next;
    }
}

static void put(struct doc *d, const char *key, json_t *value)
{
    json_t *at = d->object;
    for (const char *dot; (dot = strchr(key, '.')); key = dot + 1) {
        char *name = xasprintf("%.*s", (int)(dot - key), key);
        json_t *below = json_object_get(at, name);
        if (!json_is_object(below)) {
            below = json_object();
            json_object_set_new(at, name, below);
        }
        at = below;
        free(name);
    }
    json_object_set_new(at, key, value);
}

void doc_num(struct doc *d, const char *key, double value)
{
    put(d, key, isfinite(value) ? json_real(value) : json_null());
}

void doc_int(struct doc *d, const char *key, long value)
{
    put(d, key, json_integer(value));
}
void doc_bool(struct doc *d, const char *key, bool value)
{
    put(d, key, json_boolean(value));
}

void doc_text(struct doc *d, const char *key, const char *value)
{
    json_t *s = value ? json_string(value) : json_null();
    put(d, key, s ? s : json_string("(not UTF-8)"));
}

void doc_nums(struct doc *d, const char *key, const double *value, int n)
{
    json_t *list = json_array();
    for (int k = 0; k < n; k++)
        json_array_append_new(list, isfinite(value[k]) ? json_real(value[k]) : json_null());
    put(d, key, list);
}

void doc_list(struct doc *d, const char *key)
{
    if (!json_is_array(json_object_get(d->object, key)))
        json_object_set_new(d->object, key, json_array());
}

struct doc *doc_item(struct doc *d, const char *key)
{
    doc_list(d, key);
    json_t *list = json_object_get(d->object, key);
    struct doc *item = xcalloc(1, sizeof *item);
    item->object = json_object();
    json_array_append_new(list, item->object); // the list keeps it alive
    item->next = d->next;
    d->next = item;
    return item;
}

struct doc *doc_parse(const char *text)
{
    json_t *object = json_loads(text, JSON_REJECT_DUPLICATES, NULL);
    if (!json_is_object(object)) {
        json_decref(object);
        return NULL;
    }
    struct doc *d = xcalloc(1, sizeof *d);
    d->object = object;
    return d;
}

static const json_t *get(const struct doc *d, const char *key)
{
    const json_t *at = d->object;
    for (const char *end; at && *key; key = *end ? end + 1 : end) {
        end = strchrnul(key, '.');
        char *name = xasprintf("%.*s", (int)(end - key), key);
        at = json_object_get(at, name);
        free(name);
    }
    return at;
}

double doc_get_num(const struct doc *d, const char *key)
{
    const json_t *v = get(d, key);
    return json_is_number(v) ? json_number_value(v) : NAN;
}

const char *doc_get_text(const struct doc *d, const char *key)
{
    return json_string_value(get(d, key));
}

static void print_value(const json_t *v, FILE *to)
{
    if (json_is_string(v))
        fputs(json_string_value(v), to);
    else if (json_is_integer(v))
        fprintf(to, "%lld", (long long)json_integer_value(v));
    else if (json_is_real(v))
        fprintf(to, "%.6g", json_real_value(v));
    else if (json_is_boolean(v))
        fputs(json_is_true(v) ? "yes" : "no", to);
    else
        fputs("-", to);
}

static void print_lines(const json_t *object, const char *prefix, FILE *to)
{
    const char *key;
    json_t *v;
    json_object_foreach((json_t *)object, key, v)
    {
        char *name = xasprintf("%s%s%s", prefix, *prefix ? "." : "", key);
        if (json_is_object(v)) {
            print_lines(v, name, to);
        } else if (json_is_array(v) && json_array_size(v) && json_is_object(json_array_get(v, 0))) {
            for (size_t k = 0; k < json_array_size(v); k++) {
                char *item = xasprintf("%s[%zu]", name, k);
                print_lines(json_array_get(v, k), item, to);
                free(item);
            }
        } else {
            fprintf(to, "%-24s ", name);
            if (json_is_array(v))
                for (size_t k = 0; k < json_array_size(v); k++) {
                    fputs(k ? ", " : "", to);
                    print_value(json_array_get(v, k), to);
                }
            else
                print_value(v, to);
            fputc('\n', to);
        }
        free(name);
    }
}

void doc_print(const struct doc *d, bool json, FILE *to)
{
    if (json) {
        json_dumpf(d->object, to, JSON_INDENT(2) | JSON_REAL_PRECISION(17));
        fputc('\n', to);
    } else {
        print_lines(d->object, "", to);
    }
}

// product.c - a record is some lines of text: a word, a blank, a value.
#define _GNU_SOURCE
#include "core/product.h"
#include "core/mem.h"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static const char prefix[] = "product:";

void product_add_input(struct product *p, const char *path, const char *sha256)
{
    p->input = xrealloc(p->input, (size_t)p->n_inputs + 1, sizeof *p->input);
    struct product_input *in = &p->input[p->n_inputs++];
    *in = (struct product_input){.path = xstrdup(path)};
    snprintf(in->sha256, sizeof in->sha256, "%s", sha256);
}

void product_finish(struct product *p)
{
    for (int k = 0; k < p->n_inputs; k++)
        free(p->input[k].path);
    free(p->input);
    free(p->path);
    free(p->folder);
    free(p->command);
    free(p->version);
    *p = (struct product){0};
}

bool product_hash(const char *path, char hex[SHA256_TEXT], struct err *e)
{
    struct stat st;
    if (stat(path, &st))
        return err_errno(e, "%s", path);
    if (!S_ISDIR(st.st_mode))
        return sha256_file(path, hex, e);
    struct session *s;
    if (!session_open(&s, path, SESSION_READ, e))
        return false;
    const bool ok = session_digest(s, hex, e);
    session_close(s);
    return ok;
}

static char *to_text(const struct product *p)
{
    char *text = NULL;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    fprintf(f, "folder %s\ncommand %s\nversion %s\nsha256 %s\nutc_ns %" PRId64 "\n", p->folder,
            p->command, p->version, p->sha256, p->utc_ns);
    for (int k = 0; k < p->n_inputs; k++)
        fprintf(f, "input %s %s\n", p->input[k].sha256, p->input[k].path);
    fclose(f);
    return text;
}

static bool has_newline(const struct product *p)
{
    bool any = strchr(p->path, '\n') || strchr(p->folder, '\n') || strchr(p->command, '\n');
    for (int k = 0; k < p->n_inputs; k++)
        any |= strchr(p->input[k].path, '\n') != NULL;
    return any;
}

static void from_text(struct product *p, const char *path, char *text)
{
    char *save = NULL;
    *p = (struct product){.path = xstrdup(path)};
    for (char *line = strtok_r(text, "\n", &save); line; line = strtok_r(NULL, "\n", &save)) {
        char *value = line + strcspn(line, " ");
        if (*value)
            *value++ = 0;
        if (!strcmp(line, "folder"))
            p->folder = xstrdup(value);
        else if (!strcmp(line, "command"))
            p->command = xstrdup(value);
        else if (!strcmp(line, "version"))
            p->version = xstrdup(value);
        else if (!strcmp(line, "sha256"))
            snprintf(p->sha256, sizeof p->sha256, "%s", value);
        else if (!strcmp(line, "utc_ns"))
            p->utc_ns = strtoll(value, NULL, 10);
        else if (!strcmp(line, "input") && strlen(value) >= SHA256_TEXT) {
            value[SHA256_TEXT - 1] = 0;
            product_add_input(p, value + SHA256_TEXT, value);
        }
    }
}

bool product_record(const char *session, const struct product *p, struct err *e)
{
    struct session *s;
    if (has_newline(p))
        return err_set(e, ERR_DATA, "%s: a name with a line break in it cannot be recorded",
                       p->path);
    if (!session_open(&s, session, SESSION_ADD, e))
        return false;
    char *key = xasprintf("%s%s", prefix, p->path), *text = to_text(p);
    const bool ok = session_set(s, key, text, e);
    free(key);
    free(text);
    session_close(s);
    return ok;
}

static int by_time(const void *a, const void *b)
{
    const struct product *p = a, *q = b;
    return p->utc_ns != q->utc_ns ? (p->utc_ns > q->utc_ns) - (p->utc_ns < q->utc_ns)
                                  : strcmp(p->path, q->path);
}

bool product_list(struct session *s, struct product **out, int *n, struct err *e)
{
    char **key;
    int count = 0;
    bool ok = session_keys(s, prefix, &key, &count, e);
    if (!ok)
        return false;
    struct product *p = xcalloc((size_t)count + 1, sizeof *p);
    for (int k = 0; k < count; k++) {
        char *text = session_get(s, key[k]);
        from_text(&p[k], key[k] + strlen(prefix), text ? text : (char[]){""});
        if (ok && (!p[k].folder || !p[k].command || !p[k].version || !*p[k].sha256))
            ok = err_set(e, ERR_DATA, "%s: the record of %s is not whole", session_folder(s),
                         p[k].path);
        free(text);
        free(key[k]);
    }
    free(key);
    qsort(p, (size_t)count, sizeof *p, by_time);
    if (ok) {
        *out = p;
        *n = count;
        return true;
    }
    for (int k = 0; k < count; k++)
        product_finish(&p[k]);
    free(p);
    return false;
}

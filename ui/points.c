// points.c - points (u, v, w) from a CSV file.
#define _GNU_SOURCE
#include "ui/points.h"
#include "core/mem.h"
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct columns {
    int of[3]; // column of u, v, w; -1: absent
    int last;  // the last one needed
};

// A header is a line whose first cell is not a number.
static bool is_header(const char *line)
{
    char *end;
    strtod(line, &end);
    return end == line;
}

static bool read_header(struct columns *c, char *line, const char *path, int number, struct err *e)
{
    *c = (struct columns){.of = {-1, -1, -1}};
    char *save = NULL, *cell = strtok_r(line, ",;\t\r\n", &save);
    for (int k = 0; cell; k++, cell = strtok_r(NULL, ",;\t\r\n", &save)) {
        while (isspace((unsigned char)*cell))
            cell++;
        const char *name = strchr("uvw", *cell);
        if (*cell && name && (!cell[1] || isspace((unsigned char)cell[1]))) {
            c->of[name - "uvw"] = k;
            c->last = k;
        }
    }
    return (c->of[0] >= 0 && c->of[1] >= 0) ||
           err_set(e, ERR_DATA, "%s:%d: the header names no columns u and v", path, number);
}

static int count_cells(const char *line)
{
    int n = 1;
    for (; *line; line++)
        n += *line == ',' || *line == ';' || *line == '\t';
    return n;
}

static bool read_row(struct points *p, const struct columns *c, char *line, const char *path,
                     int number, struct err *e)
{
    double at[3] = {0, 0, 2};
    const char *cell = line;
    for (int k = 0; k <= c->last; k++) {
        const size_t size = strcspn(cell, ",;\t\r\n");
        for (int q = 0; q < 3; q++) {
            if (c->of[q] != k)
                continue;
            char *end;
            at[q] = strtod(cell, &end);
            while (end < cell + size && isspace((unsigned char)*end))
                end++;
            if (end != cell + size || !size || !isfinite(at[q]))
                return err_set(e, ERR_DATA, "%s:%d: '%.*s' is not a number for %c", path, number,
                               (int)size, cell, "uvw"[q]);
        }
        cell += size;
        if (k < c->last && *cell != ',' && *cell != ';' && *cell != '\t')
            return err_set(e, ERR_DATA, "%s:%d: %d columns, %d are needed", path, number, k + 1,
                           c->last + 1);
        cell += k < c->last;
    }
    if (c->of[2] >= 0 && !(at[2] > 0 && at[2] <= 2))
        return err_set(e, ERR_DATA, "%s:%d: w = %g must be above 0 and at most 2", path, number,
                       at[2]);
    p->at = xrealloc(p->at, (size_t)p->n + 1, sizeof *p->at);
    memcpy(p->at[p->n++], at, sizeof at);
    return true;
}

static bool read_all(struct points *p, FILE *f, const char *path, struct err *e)
{
    struct columns c = {.last = -1};
    char *line = NULL;
    size_t size = 0;
    bool ok = true;
    for (int number = 1; ok && getline(&line, &size, f) > 0; number++) {
        char *text = line + strspn(line, " \t\r\n");
        if (!*text || *text == '#')
            continue;
        if (c.last < 0 && is_header(text)) {
            ok = read_header(&c, text, path, number, e);
            continue;
        }
        if (c.last < 0)
            c = count_cells(text) > 2 ? (struct columns){{0, 1, 2}, 2}
                                      : (struct columns){{0, 1, -1}, 1};
        ok = read_row(p, &c, text, path, number, e);
    }
    free(line);
    p->has_w = c.last >= 0 && c.of[2] >= 0;
    return ok && (p->n || err_set(e, ERR_DATA, "%s: no points", path));
}

bool points_read(struct points *p, const char *path, struct err *e)
{
    const bool is_stdin = !strcmp(path, "-");
    FILE *f = is_stdin ? stdin : fopen(path, "r");
    if (!f)
        return err_errno(e, "%s", path);
    struct points got = {0};
    const bool ok = read_all(&got, f, path, e);
    if (!is_stdin)
        fclose(f);
    if (ok)
        *p = got;
    else
        points_finish(&got);
    return ok;
}

void points_finish(struct points *p)
{
    if (!p)
        return;
    free(p->at);
    *p = (struct points){0};
}

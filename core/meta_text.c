// meta_text.c - numbers and metadata as text.
#define _GNU_SOURCE
#include "core/meta_text.h"
#include "core/mem.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

char *number_text(double v, char buf[NUMBER_TEXT])
{
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(buf, NUMBER_TEXT, "%.*g", digits, v);
        if (strtod(buf, NULL) == v)
            break;
    }
    return buf;
}

char *meta_value_text(const struct meta_item *it)
{
    char *text = NULL;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    if (!f)
        return xstrdup("");
    for (const char *c = it->text; c && *c; c++)
        putc(*c == '\n' || *c == '\r' ? ' ' : *c, f);
    for (int k = 0; k < it->n; k++) {
        char buf[NUMBER_TEXT];
        fprintf(f, "%s%s", k ? ", " : "", number_text(it->num[k], buf));
    }
    fclose(f);
    return text;
}

void meta_set_value(struct meta *m, const char *key, const char *value)
{
    double *num = NULL;
    int n = 0;
    for (const char *at = value;; at++) {
        char *end;
        const double v = strtod(at, &end);
        const bool is_number = end != at && (*end == 0 || *end == ',');
        if (!is_number) {
            meta_set_text(m, key, value);
            break;
        }
        num = xrealloc(num, (size_t)n + 1, sizeof *num);
        num[n++] = v;
        if (!*end) {
            meta_set_nums(m, key, num, n);
            break;
        }
        at = end;
    }
    free(num);
}

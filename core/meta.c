// meta.c - named numbers and texts that travel with a product.
#include "core/meta.h"
#include "core/mem.h"
#include <stdlib.h>
#include <string.h>

const struct meta_item *meta_find(const struct meta *m, const char *key)
{
    for (int k = 0; k < m->n; k++)
        if (!strcmp(m->item[k].key, key))
            return &m->item[k];
    return NULL;
}

static struct meta_item *fresh(struct meta *m, const char *key)
{
    struct meta_item *it = (struct meta_item *)meta_find(m, key);
    if (it) {
        free(it->text);
        free(it->num);
        *it = (struct meta_item){.key = it->key};
        return it;
    }
    m->item = xrealloc(m->item, (size_t)m->n + 1, sizeof *m->item);
    it = &m->item[m->n++];
    *it = (struct meta_item){.key = xstrdup(key)};
    return it;
}

void meta_set_text(struct meta *m, const char *key, const char *text)
{
    char *copy = xstrdup(text); // before fresh(): text may be the old value
    fresh(m, key)->text = copy;
}

void meta_set_nums(struct meta *m, const char *key, const double *value, int n)
{
    double *copy = xcalloc((size_t)n, sizeof *copy);
    memcpy(copy, value, (size_t)n * sizeof *copy);
    struct meta_item *it = fresh(m, key);
    it->num = copy;
    it->n = n;
}

void meta_set_num(struct meta *m, const char *key, double value)
{
    meta_set_nums(m, key, &value, 1);
}

void meta_drop(struct meta *m, const char *key)
{
    struct meta_item *it = (struct meta_item *)meta_find(m, key);
    if (!it)
        return;
    free(it->key);
    free(it->text);
    free(it->num);
    const size_t behind = (size_t)(m->item + m->n - it - 1);
    memmove(it, it + 1, behind * sizeof *it);
    m->n--;
}

const char *meta_text(const struct meta *m, const char *key)
{
    const struct meta_item *it = meta_find(m, key);
    return it ? it->text : NULL;
}

bool meta_num(const struct meta *m, const char *key, double *value)
{
    const struct meta_item *it = meta_find(m, key);
    if (!it || it->text || it->n < 1)
        return false;
    *value = it->num[0];
    return true;
}

void meta_copy(struct meta *to, const struct meta *from)
{
    for (int k = 0; k < from->n; k++) {
        const struct meta_item *it = &from->item[k];
        if (it->text)
            meta_set_text(to, it->key, it->text);
        else
            meta_set_nums(to, it->key, it->num, it->n);
    }
}

void meta_finish(struct meta *m)
{
    while (m->n)
        meta_drop(m, m->item[m->n - 1].key);
    free(m->item);
    *m = (struct meta){0};
}

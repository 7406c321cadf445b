// steps.c - a list, and the order in which its open entries are taken.
#include "acquire/steps.h"
#include "core/mem.h"
#include <stdlib.h>

void steps_init(struct steps *s, const struct plan *plan, const struct rig *rig,
                const struct cam_caps *caps, const struct session_step *step, const bool *done,
                int n)
{
    *s = (struct steps){.plan = plan, .rig = rig, .caps = caps};
    s->n_groups = plan_groups(plan, rig, &s->group);
    s->item = xcalloc((size_t)n + 1, sizeof *s->item);
    for (; s->n < n; s->n++)
        s->item[s->n] =
            (struct item){.step = step[s->n], .state = done[s->n] ? STEP_GOOD : STEP_OPEN};
}

void steps_finish(struct steps *s)
{
    free(s->group);
    free(s->item);
    *s = (struct steps){0};
}

static int next_in_group(const struct steps *s, int group, bool *busy)
{
    int first = -1, after = -1;
    for (int k = 0; k < s->n; k++) {
        const struct item *t = &s->item[k];
        if (t->step.group != group)
            continue;
        *busy |= t->state == STEP_KEEPING;
        if (t->state != STEP_OPEN)
            continue;
        if (first < 0)
            first = k;
        if (after < 0 && k >= s->cursor)
            after = k;
    }
    return after >= 0 ? after : first;
}

int steps_next(const struct steps *s, bool *busy)
{
    *busy = false;
    if (s->cursor < s->n) {
        const int k = next_in_group(s, s->item[s->cursor].step.group, busy);
        if (k >= 0 || *busy)
            return k;
    }
    for (int k = 0; k < s->n; k++)
        if (s->item[k].state == STEP_OPEN)
            return k;
    return -1;
}

const struct plan_group *steps_unplanned(const struct steps *s)
{
    for (int g = 0; g < s->n_groups; g++) {
        bool has = false;
        for (int k = 0; k < s->n && !has; k++)
            has = s->item[k].step.group == g;
        if (!has)
            return &s->group[g];
    }
    return NULL;
}

void steps_add(struct steps *s, const struct plan_group *g, const int64_t *exposure_ns, int n)
{
    struct session_step *step;
    const int count = plan_steps(s->plan, s->rig, g, exposure_ns, n, s->caps, s->n, &step);
    s->item = xrealloc(s->item, (size_t)(s->n + count) + 1, sizeof *s->item);
    for (int k = 0; k < count; k++)
        s->item[s->n++] = (struct item){.step = step[k]};
    free(step);
}

static int by_time(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

void steps_add_darks(struct steps *s, const struct plan_group *g)
{
    int64_t *ns = xcalloc((size_t)s->n + 1, sizeof *ns);
    int n = 0;
    for (int k = 0; k < s->n; k++)
        ns[k] = s->item[k].step.exposure_ns;
    qsort(ns, (size_t)s->n, sizeof *ns, by_time);
    for (int k = 0; k < s->n; k++)
        if (!n || ns[k] != ns[n - 1])
            ns[n++] = ns[k];
    steps_add(s, g, ns, n);
    free(ns);
}

int steps_of_frame(const struct steps *s, int id)
{
    for (int k = 0; id && k < s->n; k++)
        if (s->item[k].state == STEP_GOOD && s->item[k].id == id)
            return k;
    return -1;
}

void steps_progress(const struct steps *s, int *done, int *planned)
{
    *done = 0;
    *planned = s->n;
    for (int k = 0; k < s->n; k++)
        *done += s->item[k].state == STEP_GOOD;
}

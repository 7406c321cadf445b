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
    for (; s->n < n; s->n++) {
        s->item[s->n] = (struct item){.step = step[s->n]};
        steps_set(s, s->n, done[s->n] ? STEP_GOOD : STEP_OPEN);
    }
}

void steps_finish(struct steps *s)
{
    free(s->group);
    free(s->item);
    *s = (struct steps){0};
}

void steps_set(struct steps *s, int index, enum step_state state)
{
    struct item *t = &s->item[index];
    s->n_good += (state == STEP_GOOD) - (t->state == STEP_GOOD);
    t->state = state;
}

// Steps of a group lie together, and mostly the next one is just behind the cursor: a capture of
// many thousand frames must not look at all of them for each.
static int next_in_group(const struct steps *s, int group, bool *busy)
{
    int first = s->cursor;
    for (int k = s->cursor; k < s->n && s->item[k].step.group == group; k++)
        if (s->item[k].state == STEP_OPEN)
            return k;
    while (first > 0 && s->item[first - 1].step.group == group)
        first--;
    for (int k = first; k < s->n && s->item[k].step.group == group; k++) {
        if (s->item[k].state == STEP_OPEN)
            return k;
        *busy |= s->item[k].state == STEP_KEEPING;
    }
    return -1;
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
    const int next = s->n ? s->item[s->n - 1].step.group + 1 : 0; // they are planned in order
    return next < s->n_groups ? &s->group[next] : NULL;
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
    for (int k = s->n - 1; id && k >= 0; k--) {
        const struct item *t = &s->item[(s->cursor + 1 + k) % s->n]; // from the cursor backwards
        if (t->state == STEP_GOOD && t->id == id)
            return (int)(t - s->item);
    }
    return -1;
}

void steps_progress(const struct steps *s, int *done, int *planned)
{
    *done = s->n_good;
    *planned = s->n;
}

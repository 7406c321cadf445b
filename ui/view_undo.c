// view_undo.c - a ring of whole sets of parameters: small, and never wrong.
#include "ui/view_undo.h"

static struct params *at(struct undo *u, long k)
{
    return &u->step[k % UNDO_STEPS];
}

void undo_start(struct undo *u, const struct params *p)
{
    u->first = u->at = u->last = 0;
    u->step[0] = *p;
}

void undo_note(struct undo *u, const struct params *p)
{
    if (params_differ(at(u, u->at), p, 0) < 0)
        return;
    u->last = ++u->at;
    *at(u, u->at) = *p;
    if (u->last - u->first >= UNDO_STEPS)
        u->first++;
}

static bool go(struct undo *u, long to, struct params *p, enum param *what)
{
    if (to < u->first || to > u->last)
        return false;
    params_differ(at(u, u->at), at(u, to), what);
    u->at = to;
    *p = *at(u, to);
    return true;
}

bool undo_back(struct undo *u, struct params *p, enum param *what)
{
    return go(u, u->at - 1, p, what);
}

bool undo_forth(struct undo *u, struct params *p, enum param *what)
{
    return go(u, u->at + 1, p, what);
}

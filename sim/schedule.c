// schedule.c - lists of event numbers, or a chance.
#define _GNU_SOURCE
#include "sim/schedule.h"
#include "sim/rng.h"
#include <stdlib.h>
#include <string.h>

bool schedule_parse(struct schedule *s, const char *text, struct err *e)
{
    struct schedule got = {0};
    const char *at = text;
    char *end;
    bool ok = true;
    while (ok && *at) {
        const double x = strtod(at, &end);
        ok = end != at;
        if (ok && *end == '%') {
            got.chance = x / 100;
            ok = x >= 0 && x <= 100 && !end[1] && at == text;
            end++;
        } else if (ok && got.n < SCHEDULE_SPANS) {
            const long first = strtol(at, &end, 10);
            const long last = *end == '-' ? strtol(end + 1, &end, 10) : first;
            got.span[got.n].first = first;
            got.span[got.n++].last = last;
            ok = first >= 1 && last >= first && (!*end || (*end == '+' && end[1]));
        } else {
            ok = false;
        }
        at = end + (*end == '+');
    }
    if (!ok)
        return err_set(e, ERR_DATA, "'%.60s' is not a schedule such as 2, 3+7-9 or 5%%", text);
    *s = got;
    return true;
}

bool schedule_hits(const struct schedule *s, uint64_t seed, uint32_t kind, long k)
{
    for (int i = 0; i < s->n; i++)
        if (k >= s->span[i].first && k <= s->span[i].last)
            return true;
    struct rng r = rng_at(seed, RNG_FAULT + (kind << 8), (uint64_t)k);
    return rng_uniform(&r) < s->chance;
}

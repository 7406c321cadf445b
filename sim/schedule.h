// schedule.h - when a fault happens: "2", "2+5+8-10" (counted from 1), "5%" (by chance, seeded).
#pragma once
#include "core/err.h"
#include <stdint.h>

enum { SCHEDULE_SPANS = 32 };

struct schedule {
    int n;
    struct {
        long first, last;
    } span[SCHEDULE_SPANS];
    double chance;
};

// "" is never. ERR_DATA with what would be right.
bool schedule_parse(struct schedule *s, const char *text, struct err *e);
// Whether the k-th event (from 1) is hit; `kind` tells faults of one seed apart.
bool schedule_hits(const struct schedule *s, uint64_t seed, uint32_t kind, long k);

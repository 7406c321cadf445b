// judge.h - whether a frame proves its step. Pure: what was asked, said and seen in; a verdict out.
//
// good            counts as the step's proof
// damaged         the device says so, the size is wrong, or rows are those of the frame before
// duplicate       the same counts as the frame before
// wrong-exposure  the device reports another exposure (or gain) than was asked
// wrong-focus     the device reports another focus than was asked
// wrong-light     the pixels disagree with the reported exposure: exposure, light or filter are not
//                 what the device claims
// uneven          some rows saw less or more light than others, against a neighbour of the bracket
// light-missed    by the clock, the light was not on for all of all rows' exposure
// not-dark        light in a dark frame
// same-filter     the same picture as through the filter before: the filter did not move
#pragma once
#include "acquire/camera.h"
#include "acquire/measure.h"
#include "core/session.h"

struct judge_facts {
    bool damaged, duplicate;
    int stale_first, stale_last; // rows that are those of the frame before; -1: none
    const struct cam_caps *caps;
    const struct measure_level *level;
    const struct measure_ratio *ratio; // against a good frame of the group; NULL: none
    int64_t ratio_ns;                  // exposure of that frame
    const struct measure_ratio *other; // against a frame of the group before, other filter; NULL
    int64_t other_ns;
    double own_residual; // of this group's or the last one's own pairs, to compare `other` with
};

// Fills verdict, reason, measured_ns, measured_sigma and saturated of a frame that is otherwise
// complete.
void judge(struct session_frame *f, const struct judge_facts *facts);

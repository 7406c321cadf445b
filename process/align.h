// align.h - whether the camera moved between the frames of a bracket.
#pragma once
#include "process/hdr.h"

struct shift {
    double dx_px, dy_px, sigma_px; // of the later frame's picture; one standard deviation
    bool known;                    // false: the frames share too little structure
};

// Shift of each frame against the next shorter one, chained so that the shortest has none; [n].
// Gradient least squares from coarse to fine on pixels that both frames measure (Lucas & Kanade
// 1981): good to some hundredths of a pixel, up to about 1/50 of the picture.
bool align_frames(const struct hdr_frames *f, struct shift *shift, struct err *e);
bool align_codes(const struct bracket *b, const struct response *r, struct shift *shift,
                 struct err *e);

// frames.h - the frames of a bracket read from files: codes where they are 8 bit, samples
// elsewhere.
#pragma once
#include "core/err.h"
#include "core/image.h"
#include "process/hdr.h"

struct frames {
    int n, w, h, nc;
    const char **path;  // [n], not owned
    double *time_s;     // [n] as printed in the file, NAN where it says nothing; owned
    uint8_t **code;     // [n] frames [h][w][nc] of 8-bit pictures, owned; or NULL
    float **px;         // [n] frames [h][w][nc] of linear ones, black level removed, owned; or NULL
    bool printed_times; // from a photograph's EXIF: nominal
    double saturation;  // of px; INFINITY: none known
    struct meta meta;   // of the first frame
};

// Reads them all. ERR_DATA: fewer than two, sizes or kinds that differ, NaN; each names the file.
bool frames_read(struct frames *f, int n, char **path, struct err *e);
void frames_finish(struct frames *f); // accepts a zeroed struct

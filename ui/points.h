// points.h - points (u, v, w) from a CSV file.
#pragma once
#include "core/err.h"
#include <stdbool.h>

struct points {
    int n;
    bool has_w;
    double (*at)[3]; // [n] u, v, w (2, straight on, where the file has none), owned
};

// Columns u,v[,w], in this order or as a header line names them; more columns are passed over.
// Empty lines and '#' comments too. "-" is stdin. ERR_DATA names file and line.
bool points_read(struct points *p, const char *path, struct err *e);
void points_finish(struct points *p); // accepts a zeroed struct

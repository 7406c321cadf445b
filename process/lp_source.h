// lp_source.h - the picture of logpolar.h as a spline that is read line by line.
#pragma once
#include "process/logpolar.h"
#include <stddef.h>
#include <stdint.h>

enum { LP_EDGE = 3, LP_TILE = 32 }; // samples a quintic reaches to either side; picture tile, px

// A sector's point at distance a along its axis and b = t a across is the pixel (c_line + sign a)
// of `lines`, (c_at + b) within the line.
struct lp_view {
    const float *coef; // [lines][width]
    int lines, width;
    double c_line, c_at;
    const uint8_t *live; // [ceil(lines / LP_TILE)][ceil(width / LP_TILE)] 0: no signal near
};

struct lp_source {
    float *coef, *turned; // [h][w] and [w][h], owned
    uint8_t *live, *live_turned;
    struct lp_view rows, columns; // sectors +-y read rows, sectors +-x columns
    double reach[4];              // px from the centre to the frame in sector +x, +y, -x, -y
};

bool lp_source_init(struct lp_source *s, const struct lp_picture *p, struct err *e);
void lp_source_finish(struct lp_source *s);

// The spline at (x, y) from the centre; falls to 0 over the pixel beyond the frame.
double lp_source_at(const struct lp_source *s, double x, double y);

// row[k] = L on sector's ring a at slope t0 + k dt, k < rays. `line` is scratch of
// lp_source_scratch() floats. live[k / 16]: 0 where 16 samples have no signal (and are 0).
size_t lp_source_scratch(const struct lp_source *s);
void lp_source_ring(const struct lp_source *s, int sector, double a, double t0, double dt, int rays,
                    float *line, float *row, uint8_t *live);

// view_layout.h - which part of the window shows what.
#pragma once
#include "ui/gui.h"
#include <stdbool.h>

enum { PANES = 3 };

struct layout {
    struct gui_rect list, side, status; // no height: not shown
    struct gui_rect pane[PANES];        // [n_panes]
    int n_panes;
};

// One pane fills the middle; two share it; of three the first has the left part.
void layout_make(struct layout *l, double w, double h, double scale, bool panels, int n_panes);
int layout_pane_at(const struct layout *l, double x, double y); // -1: none

// How a picture lies in a pane: the point (x, y) of it is in the pane's middle.
struct placing {
    double zoom; // pixels of the window per pixel of the picture
    double x, y;
};
struct placing placing_fit(struct gui_rect pane, int w, int h);
void placing_zoom(struct placing *p, struct gui_rect pane, double x, double y, double steps);
void placing_to_picture(const struct placing *p, struct gui_rect pane, double x, double y,
                        double *i, double *j);
void placing_to_window(const struct placing *p, struct gui_rect pane, double i, double j, double *x,
                       double *y);

// view_layout.c - rectangles of the window, pictures in them.
#define _GNU_SOURCE
#include "ui/view_layout.h"
#include <math.h>

void layout_make(struct layout *l, double w, double h, double scale, bool panels, int n_panes)
{
    const double list = panels ? round(210 * scale) : 0, side = panels ? round(330 * scale) : 0;
    const double status = panels ? round(28 * scale) : 0, gap = round(2 * scale);
    const double left = fmin(list, w / 4), right = fmin(side, w / 2);
    const struct gui_rect middle = {left, 0, fmax(1, w - left - right), fmax(1, h - status)};
    *l = (struct layout){.n_panes = n_panes < PANES ? n_panes : PANES,
                         .list = {0, 0, left, panels ? h - status : 0},
                         .side = {w - right, 0, right, panels ? h - status : 0},
                         .status = {0, h - status, w, status}};
    const double main =
        l->n_panes < 2 ? middle.w : round((middle.w - gap) * (n_panes == 2 ? 0.5 : 0.6));
    l->pane[0] = (struct gui_rect){middle.x, 0, main, middle.h};
    for (int k = 1; k < l->n_panes; k++) {
        const double high = l->n_panes == 2 ? middle.h : floor((middle.h - gap) / 2);
        l->pane[k] = (struct gui_rect){middle.x + main + gap, (k - 1) * (high + gap),
                                       fmax(1, middle.w - main - gap), fmax(1, high)};
    }
}

int layout_pane_at(const struct layout *l, double x, double y)
{
    for (int k = 0; k < l->n_panes; k++) {
        const struct gui_rect *r = &l->pane[k];
        if (x >= r->x && y >= r->y && x < r->x + r->w && y < r->y + r->h)
            return k;
    }
    return -1;
}

struct placing placing_fit(struct gui_rect pane, int w, int h)
{
    return (struct placing){fmin(pane.w / w, pane.h / h), w / 2.0, h / 2.0};
}

void placing_to_picture(const struct placing *p, struct gui_rect pane, double x, double y,
                        double *i, double *j)
{
    *i = p->x + (x - pane.x - pane.w / 2) / p->zoom;
    *j = p->y + (y - pane.y - pane.h / 2) / p->zoom;
}

void placing_to_window(const struct placing *p, struct gui_rect pane, double i, double j, double *x,
                       double *y)
{
    *x = pane.x + pane.w / 2 + (i - p->x) * p->zoom;
    *y = pane.y + pane.h / 2 + (j - p->y) * p->zoom;
}

// What is under (x, y) stays there.
void placing_zoom(struct placing *p, struct gui_rect pane, double x, double y, double steps)
{
    double i, j;
    placing_to_picture(p, pane, x, y, &i, &j);
    p->zoom = fmax(1e-3, fmin(200, p->zoom * exp(0.2 * steps)));
    p->x = i - (x - pane.x - pane.w / 2) / p->zoom;
    p->y = j - (y - pane.y - pane.h / 2) / p->zoom;
}

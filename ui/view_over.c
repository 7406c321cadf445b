// view_over.c - what is drawn over the pictures: names, scales, the split line, orders, messages.
#define _GNU_SOURCE
#include "core/colormap.h"
#include "ui/view.h"
#include <math.h>
#include <stdio.h>

static const unsigned light = 0xe0ffffff, dim = 0xb0d0d0d0, dark = 0xa0000000, amber = 0xff57b8ee;

static void say_on_dark(const struct view *v, double x, double y, const char *text, unsigned color)
{
    const double pad = 5 * v->scale;
    gui_fill((struct gui_rect){x - pad, y - pad / 2, gui_say_width(text) + 2 * pad,
                               gui_line_height() + pad / 2},
             dark);
    gui_say(x, y, color, text);
}

// The colours from the peak down, a tick at every decade.
static void draw_scale(const struct view *v, struct gui_rect r, double peak, const char *what)
{
    const double decades = v->params->v[PARAM_DECADES], s = v->scale;
    const double wide = fmin(320 * s, r.w - 80 * s), high = 10 * s;
    const double x = r.x + (r.w - wide) / 2, y = r.y + r.h - 42 * s;
    const int steps = 128;
    gui_fill((struct gui_rect){x - 34 * s, y - 24 * s, wide + 68 * s, 58 * s}, dark);
    gui_say(x, y - 22 * s, light, what);
    for (int k = 0; k < steps; k++) {
        unsigned char c[3];
        colormap((k + 0.5) / steps, c);
        gui_fill((struct gui_rect){x + wide * k / steps, y, wide / steps + 1, high},
                 0xff000000u | (unsigned)c[2] << 16 | (unsigned)c[1] << 8 | c[0]);
    }
    for (int k = 0; k <= (int)decades; k++) {
        char text[40];
        const double at = x + wide * (1 - k / decades);
        snprintf(text, sizeof text, "%.2g", peak * pow(10, -k));
        gui_line(at, y, at, y + high + 3 * s, light, s);
        gui_say(at - gui_say_width(text) / 2, y + high + 2 * s, light, text);
    }
}

static void draw_split(const struct view *v, struct gui_rect r)
{
    static const char *const names[] = {"no diffraction", "table", "slits", "G04"};
    const double x = r.x + v->params->v[PARAM_SPLIT] * r.w, gap = 12 * v->scale;
    const char *left = names[(int)v->params->v[PARAM_KIND]];
    const char *right = names[(int)v->params->v[PARAM_AGAINST]];
    gui_line(x, r.y, x, r.y + r.h, light, v->scale);
    const double y = r.y + r.h - gui_line_height() - 2 * gap;
    say_on_dark(v, x - gap - gui_say_width(left), y, left, light);
    say_on_dark(v, x + gap, y, right, light);
}

static void mark_order(const struct view *v, double x, double y, double spacing, bool side)
{
    gui_circle(x, y, fmin(7 * v->scale, 0.36 * spacing), side ? amber : light, 1.2 * v->scale);
}

// Where the pitch sends its orders, over a table: for white light each order is a line of colours,
// its ends and the chosen wavelength.
static void draw_orders(const struct view *v, int pane)
{
    const struct table *t = &v->stage.scene.object[0].material.table;
    const double step = v->params->v[PARAM_LAMBDA] / v->params->v[PARAM_PITCH];
    const int most = (int)fmin(40, t->range / step);
    const double spacing = step / t->range * t->n / 2 * v->placing[pane].zoom;
    for (int m = -most; m <= most; m++)
        for (int n = -most; n <= most; n++) {
            double x, y;
            placing_to_window(&v->placing[pane], v->layout.pane[pane],
                              (m * step / t->range + 1) * t->n / 2,
                              (1 - n * step / t->range) * t->n / 2, &x, &y);
            mark_order(v, x, y, spacing, m || n);
        }
}

// The same orders where the camera sees them.
static void draw_camera_orders(const struct view *v, int pane)
{
    double ci, cj, h_per_px;
    source_center(v, &ci, &cj, &h_per_px);
    const double step = v->params->v[PARAM_LAMBDA] / v->params->v[PARAM_PITCH] / h_per_px;
    const int most = (int)fmin(40, fmax(v->picture.w, v->picture.h) / step);
    const double spacing = step * v->placing[pane].zoom;
    for (int m = -most; m <= most; m++)
        for (int n = -most; n <= most; n++) {
            double x, y;
            const double i = ci + m * step, j = cj + n * step;
            if (i < 0 || j < 0 || i > v->picture.w - 1 || j > v->picture.h - 1)
                continue;
            placing_to_window(&v->placing[pane], v->layout.pane[pane], i + 0.5, j + 0.5, &x, &y);
            mark_order(v, x, y, spacing, m || n);
        }
}

static const char *pane_title(const struct view *v, int k)
{
    static char text[120];
    const struct source *s = &v->source;
    if (!s->on)
        return pane_kind_name[v->pane[k]];
    if (v->pane[k] == PANE_PICTURE)
        snprintf(text, sizeof text, s->is_live ? "camera" : "frame %d of %d", s->reel.at + 1,
                 s->reel.n);
    else if (v->pane[k] == PANE_TABLE)
        snprintf(text, sizeof text, "table of %d frame%s, %d nodes", s->frames,
                 s->frames == 1 ? "" : "s", v->stage.scene.object[0].material.table.n);
    else
        return "material";
    return text;
}

static void draw_pane(const struct view *v, int k)
{
    const struct gui_rect r = v->layout.pane[k];
    static const char *const quantity[] = {"value", "S_d, luminance, 1/sr", "radiance, luminance"};
    const bool material = v->pane[k] == PANE_MATERIAL;
    const int compare = material ? (int)v->params->v[PARAM_COMPARE] : 0;
    struct shown shown = v->pane[k] == PANE_TABLE ? v->table_shown : v->picture_shown;
    gui_clip(r);
    if (v->pane[k] == PANE_TABLE && v->params->v[PARAM_ORDERS] > 0)
        draw_orders(v, k);
    if (v->pane[k] == PANE_PICTURE && v->source.on && v->params->v[PARAM_ORDERS] > 0)
        draw_camera_orders(v, k);
    if (compare == COMPARE_SPLIT)
        draw_split(v, r);
    if (compare == COMPARE_DIFFERENCE || (int)v->params->v[PARAM_LOOK] == LOOK_FALSE) {
        if (material)
            stage_show((struct stage *)&v->stage, &shown, v->params);
        draw_scale(v, r, shown.peak, quantity[v->pane[k]]);
    }
    if (v->layout.n_panes > 1)
        say_on_dark(v, r.x + 12 * v->scale, r.y + 8 * v->scale, pane_title(v, k), dim);
    gui_unclip();
}

static void draw_message(struct view *v)
{
    const struct layout *l = &v->layout;
    const double x0 = l->list.w, x1 = l->status.w - l->side.w;
    const double wide = fmin(560 * v->scale, x1 - x0 - 40 * v->scale);
    const char *text = v->trouble[0]     ? v->trouble
                       : view_is_busy(v) ? "loading..."
                       : v->at < 0       ? "Nothing is open: drop a file here."
                                         : NULL;
    if (!text || (!v->trouble[0] && v->layout.n_panes))
        return;
    gui_panel("message",
              (struct gui_rect){(x0 + x1 - wide) / 2, l->status.y * 0.42, wide, 160 * v->scale},
              true);
    (v->trouble[0] ? gui_warn : gui_note)(text);
    gui_panel_end();
}

void view_over(struct view *v)
{
    if (v->params && !v->trouble[0])
        for (int k = 0; k < v->layout.n_panes; k++)
            draw_pane(v, k);
    draw_message(v);
}

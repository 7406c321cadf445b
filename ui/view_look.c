// view_look.c - what is under the mouse, pane by pane.
#define _GNU_SOURCE
#include "ui/view.h"
#include <math.h>

// The colour that tells no wavelength: the light's, or a sensor's grey.
static const double *white_of(const struct view *v, enum pane_kind pane)
{
    static const double grey[3] = {1, 1, 1};
    return pane == PANE_PICTURE ? grey : v->stage.scene.light_color;
}

static void look_at_table(struct view *v, int pane)
{
    const struct table *t = view_table(v);
    double x, y;
    placing_to_picture(&v->placing[pane], v->layout.pane[pane], v->mouse.x, v->mouse.y, &x, &y);
    v->has_spot =
        spot_of_table(&v->spot, t, t->range * (2 * x / t->n - 1), t->range * (1 - 2 * y / t->n));
}

static void look_at_material(struct view *v, int pane)
{
    const struct gl_target *t = &v->stage.target;
    double x, y;
    placing_to_picture(&v->placing[pane], v->layout.pane[pane], v->mouse.x, v->mouse.y, &x, &y);
    x = floor(fmax(0, fmin(t->w - 1, x)));
    y = floor(fmax(0, fmin(t->h - 1, y)));
    v->pixel[0] = x;
    v->pixel[1] = y;
    v->has_spot = spot_of_scene(&v->spot, &v->stage.scene, x, y, t->w, t->h);
    if (v->has_spot)
        stage_pixel(&v->stage, (int)x, (int)y, v->spot.rgb);
}

static void look_at_picture(struct view *v, int pane)
{
    const struct image *im = &v->picture;
    placing_to_picture(&v->placing[pane], v->layout.pane[pane], v->mouse.x, v->mouse.y,
                       &v->pixel[0], &v->pixel[1]);
    const int i = (int)floor(v->pixel[0]), j = (int)floor(v->pixel[1]);
    v->has_spot = i >= 0 && j >= 0 && i < im->w && j < im->h;
    if (!v->has_spot)
        return;
    v->spot = (struct spot){.u = NAN, .v = NAN, .w = NAN, .in_rad = NAN, .out_rad = NAN};
    if (v->source.on) {
        double ci, cj, h_per_px;
        source_center(v, &ci, &cj, &h_per_px);
        v->spot.u = (i - ci) * h_per_px;
        v->spot.v = (j - cj) * h_per_px;
    }
    const float *px = im->px + ((size_t)j * (size_t)im->w + (size_t)i) * (size_t)im->nc;
    for (int c = 0; c < 3; c++) {
        static const char *const variance[] = {"var.R", "var.G", "var.B"};
        int var = image_channel_index(im, variance[c]);
        if (var < 0)
            var = image_channel_index(im, "var.Y");
        v->spot.rgb[c] = (double)px[im->nc < 3 || var == 1 ? 0 : c];
        v->spot.sigma[c] = var >= 0       ? sqrt(fmax(0, (double)px[var]))
                           : v->source.on ? source_sigma(&v->source, v->spot.rgb[c])
                                          : NAN;
    }
}

void view_look(struct view *v)
{
    const int pane = layout_pane_at(&v->layout, v->mouse.x, v->mouse.y);
    v->has_spot = false;
    if (pane < 0 || v->trouble[0] || gui_wants_mouse() || !v->params)
        return;
    switch (v->pane[pane]) {
    case PANE_TABLE: look_at_table(v, pane); break;
    case PANE_MATERIAL: look_at_material(v, pane); break;
    case PANE_PICTURE: look_at_picture(v, pane); break;
    }
    if (v->has_spot)
        spot_conclude(&v->spot, white_of(v, v->pane[pane]), v->params->v[PARAM_LAMBDA],
                      v->params->v[PARAM_PITCH]);
}

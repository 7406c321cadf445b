// sample_read.c - the kinds of samples and their YAML (docs/simulator.md).
#define _GNU_SOURCE
#include "core/hfield_file.h"
#include "core/mem.h"
#include "sim/sample.h"
#include "sim/surface.h"
#include <libgen.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_SHAPES = 64 };

static struct shape *add_shape(struct sample *s, struct shape shape)
{
    s->shape = xrealloc(s->shape, (size_t)s->n_shapes + 1, sizeof *s->shape);
    s->shape[s->n_shapes] = shape;
    return &s->shape[s->n_shapes++];
}

// A list of numbers, or one number that stands for all.
static bool read_numbers(struct ynode *map, const char *key, enum unit unit, double lo, double hi,
                         double *out, int count, struct err *e)
{
    struct ynode *n = ymap_find(map, key);
    if (!n)
        return true;
    if (!ynode_is_list(n)) {
        double one;
        if (!ynode_num(n, unit, lo, hi, &one, e))
            return false;
        for (int k = 0; k < count; k++)
            out[k] = one;
        return true;
    }
    if (ylist_count(n) != count)
        return yaml_bad(n, e, "%d values, needs %d or one for all", ylist_count(n), count);
    for (int k = 0; k < count; k++)
        if (!ynode_num(ylist_at(n, k), unit, lo, hi, &out[k], e))
            return false;
    return true;
}

static bool read_flat(struct sample *s, struct ynode *y, struct err *e)
{
    (void)y;
    (void)e;
    s->period_x_m = 1e-7; // one order; where the others would be does not matter
    return true;
}

static bool read_blazed(struct sample *s, struct ynode *y, struct err *e)
{
    double lines_per_m = 600e3, blaze_rad = 13 * M_PI / 180;
    if (!ymap_num(y, "lines", Y_OPTIONAL, UNIT_PER_M, 1e3, 1e7, &lines_per_m, e) ||
        !ymap_num(y, "blaze", Y_OPTIONAL, UNIT_RAD, 0, 1.2, &blaze_rad, e))
        return false;
    s->period_x_m = 1 / lines_per_m;
    add_shape(s,
              (struct shape){0, 1, 0, 1, .amplitude = 1, .rise_m = s->period_x_m * tan(blaze_rad)});
    return true;
}

static bool read_cd(struct sample *s, struct ynode *y, struct err *e)
{
    double pitch_m = 2e-6, pit_m = 0.5e-6, depth_m = 120e-9;
    if (!ymap_num(y, "pitch", Y_OPTIONAL, UNIT_M, 1e-7, 1e-3, &pitch_m, e) ||
        !ymap_num(y, "pit", Y_OPTIONAL, UNIT_M, 1e-9, 0.999 * pitch_m, &pit_m, e) ||
        !ymap_num(y, "depth", Y_OPTIONAL, UNIT_M, 0, 1e-5, &depth_m, e))
        return false;
    s->period_x_m = pitch_m;
    s->layout = SAMPLE_DISC;
    add_shape(s, (struct shape){0, pit_m / pitch_m, 0, 1, .amplitude = 1, .height_m = -depth_m});
    return true;
}

// Sub-pixels side by side; the black matrix between them is the ground.
static bool read_lcd(struct sample *s, struct ynode *y, struct err *e)
{
    enum { MOST = 8 };
    double pitch_m[2] = {25e-6, 25e-6}, open[2] = {0.7, 0.8}, amplitude[MOST] = {1, 0.85, 0.7};
    double depth_m = 0;
    int count = 3;
    s->ground = 0.15;
    if (!read_numbers(y, "pitch", UNIT_M, 1e-7, 1e-3, pitch_m, 2, e) ||
        !ymap_int(y, "subpixels", Y_OPTIONAL, 1, MOST, &count, e) ||
        !read_numbers(y, "opening", UNIT_NONE, 0.01, 1, open, 2, e) ||
        !read_numbers(y, "amplitude", UNIT_NONE, 0, 1, amplitude, count, e) ||
        !ymap_num(y, "ground", Y_OPTIONAL, UNIT_NONE, 0, 1, &s->ground, e) ||
        !ymap_num(y, "depth", Y_OPTIONAL, UNIT_M, -1e-5, 1e-5, &depth_m, e))
        return false;
    s->period_x_m = pitch_m[0];
    s->period_y_m = pitch_m[1];
    for (int k = 0; k < count; k++)
        add_shape(s, (struct shape){(k + 0.5 - 0.5 * open[0]) / count,
                                    (k + 0.5 + 0.5 * open[0]) / count, 0.5 - 0.5 * open[1],
                                    0.5 + 0.5 * open[1], .amplitude = amplitude[k],
                                    .height_m = -depth_m});
    return true;
}

// Chevron pixels, as in TV panels: two halves that lean either way give two diagonal directions.
static bool read_tv(struct sample *s, struct ynode *y, struct err *e)
{
    double pitch_m[2] = {60e-6, 90e-6}, open[2] = {0.75, 0.85}, lean_rad = 20 * M_PI / 180;
    s->ground = 0.1;
    if (!read_numbers(y, "pitch", UNIT_M, 1e-7, 1e-3, pitch_m, 2, e) ||
        !read_numbers(y, "opening", UNIT_NONE, 0.01, 1, open, 2, e) ||
        !ymap_num(y, "ground", Y_OPTIONAL, UNIT_NONE, 0, 1, &s->ground, e) ||
        !ymap_num(y, "lean", Y_OPTIONAL, UNIT_RAD, -1.2, 1.2, &lean_rad, e))
        return false;
    s->period_x_m = pitch_m[0];
    s->period_y_m = pitch_m[1];
    const double shear = tan(lean_rad) * pitch_m[1] / pitch_m[0], half = 0.5 * open[1];
    const struct shape lower = {0.5 - 0.5 * open[0], 0.5 + 0.5 * open[0], 0.5 - half, 0.5,
                                .shear = shear,      .amplitude = 1};
    struct shape upper = lower; // begins where the lower half ends
    upper.s0 += shear * half;
    upper.s1 += shear * half;
    upper.t0 = 0.5;
    upper.t1 = 0.5 + half;
    upper.shear = -shear;
    add_shape(s, lower);
    add_shape(s, upper);
    return true;
}

static bool read_holographic(struct sample *s, struct ynode *y, struct err *e)
{
    double pitch_m = 1.2e-6, depth_m = 150e-9;
    s->rough_rms_m = 40e-9;
    s->rough_length_m = 6e-6;
    if (!ymap_num(y, "pitch", Y_OPTIONAL, UNIT_M, 1e-7, 1e-4, &pitch_m, e) ||
        !ymap_num(y, "depth", Y_OPTIONAL, UNIT_M, 0, 2e-6, &depth_m, e))
        return false;
    s->period_x_m = s->period_y_m = pitch_m;
    return surface_egg_crate(&s->map, pitch_m, 48, depth_m, e);
}

static bool read_random(struct sample *s, struct ynode *y, struct err *e)
{
    s->rough_rms_m = 60e-9;
    s->rough_length_m = 3e-6;
    return read_flat(s, y, e);
}

static bool read_surface(struct sample *s, struct ynode *y, struct surface_recipe r, struct err *e)
{
    int seed = 1;
    if (!ymap_num(y, "tile", Y_OPTIONAL, UNIT_M, 1e-6, 1e-3, &r.tile_m, e) ||
        !ymap_int(y, "nodes", Y_OPTIONAL, 16, 1024, &r.nodes, e) ||
        !ymap_num(y, "period", Y_OPTIONAL, UNIT_M, 1e-8, 1e-4, &r.period_m, e) ||
        !ymap_num(y, "spread", Y_OPTIONAL, UNIT_NONE, 0, 1, &r.spread, e) ||
        !ymap_num(y, "rms", Y_OPTIONAL, UNIT_M, 0, 1e-5, &r.rms_m, e) ||
        !ymap_int(y, "seed", Y_OPTIONAL, 0, INT32_MAX, &seed, e))
        return false;
    r.seed = (uint64_t)seed;
    s->period_x_m = s->period_y_m = r.tile_m;
    struct err why;
    return surface_make(&s->map, &r, &why) || yaml_bad(y, e, "%s", why.msg);
}

static bool read_quasi_periodic(struct sample *s, struct ynode *y, struct err *e)
{
    return read_surface(s, y,
                        (struct surface_recipe){.tile_m = 65e-6,
                                                .nodes = 256,
                                                .period_m = 1.6e-6,
                                                .spread = 0.06,
                                                .spread_rad = 0.12,
                                                .rms_m = 55e-9},
                        e);
}

static bool read_quasi_random(struct sample *s, struct ynode *y, struct err *e)
{
    return read_surface(s, y,
                        (struct surface_recipe){.tile_m = 65e-6,
                                                .nodes = 256,
                                                .period_m = 2e-6,
                                                .spread = 0.12,
                                                .spread_rad = M_PI,
                                                .rms_m = 60e-9},
                        e);
}

// One cell measured elsewhere; it repeats, so its edges should meet.
static bool read_height(struct sample *s, struct ynode *y, const char *path, struct err *e)
{
    const char *file = NULL;
    struct hfield_hints hints = {0};
    double pitch_m[2] = {0, 0};
    if (!ymap_text(y, "file", Y_NEEDED, &file, e) ||
        !read_numbers(y, "pixel", UNIT_M, 1e-10, 1e-3, pitch_m, 2, e) ||
        !ymap_num(y, "z-scale", Y_OPTIONAL, UNIT_M, 1e-12, 1e-3, &hints.z_scale_m, e))
        return false;
    hints.dx_m = pitch_m[0];
    hints.dy_m = pitch_m[1];
    char *copy = xstrdup(path);
    char *full = *file == '/' ? xstrdup(file) : xasprintf("%s/%s", dirname(copy), file);
    struct err why;
    bool ok = hfield_read(&s->map, full, &hints, &why);
    if (!ok && why.code == ERR_FILE)
        *e = why;
    else if (!ok)
        yaml_bad(ymap_find(y, "file"), e, "%s", why.msg);
    free(full);
    free(copy);
    const long missing = ok ? hfield_missing(&s->map) : 0;
    if (missing)
        return yaml_bad(ymap_find(y, "file"), e, "%ld nodes are missing: fill them first", missing);
    s->period_x_m = s->map.nx * s->map.dx_m;
    s->period_y_m = s->map.ny * s->map.dy_m;
    return ok;
}

static bool read_one_shape(struct sample *s, struct ynode *item, bool one_d, struct err *e)
{
    double x[2] = {0, 1}, t[2] = {0, 1};
    struct shape p = {.amplitude = 1};
    if (!ynode_is_map(item))
        return yaml_bad(item, e, "a shape is a map such as {x: [0, 0.5], amplitude: 1}");
    if (!read_numbers(item, "x", UNIT_NONE, -1, 2, x, 2, e) ||
        !read_numbers(item, "y", UNIT_NONE, -1, 2, t, 2, e) ||
        !ymap_num(item, "shear", Y_OPTIONAL, UNIT_NONE, -5, 5, &p.shear, e) ||
        !ymap_num(item, "amplitude", Y_OPTIONAL, UNIT_NONE, 0, 1, &p.amplitude, e) ||
        !ymap_num(item, "height", Y_OPTIONAL, UNIT_M, -1e-4, 1e-4, &p.height_m, e) ||
        !ymap_num(item, "rise", Y_OPTIONAL, UNIT_M, -1e-4, 1e-4, &p.rise_m, e))
        return false;
    if (!(x[0] < x[1] && x[1] - x[0] <= 1 && t[0] < t[1] && t[1] - t[0] <= 1))
        return yaml_bad(item, e, "x and y must each be [from, to] with from < to, at most 1 apart");
    if (one_d && (t[0] != 0 || t[1] != 1 || p.shear != 0))
        return yaml_bad(item, e, "y and shear need a period in y");
    p.s0 = x[0], p.s1 = x[1], p.t0 = t[0], p.t1 = t[1];
    add_shape(s, p);
    return true;
}

// The closed forms add up what each shape changes, so no place may belong to two shapes.
static bool overlap(const struct sample *s)
{
    enum { GRID = 256 };
    for (int j = 0; j < GRID; j++)
        for (int i = 0; i < GRID; i++) {
            int owners = 0;
            for (int k = 0; k < s->n_shapes; k++) {
                const struct shape *p = &s->shape[k];
                const double y = (j + 0.5) / GRID - p->t0, t = y - floor(y);
                const double x = (i + 0.5) / GRID - p->s0 - p->shear * t;
                owners += t < p->t1 - p->t0 && x - floor(x) < p->s1 - p->s0;
            }
            if (owners > 1)
                return true;
        }
    return false;
}

static bool read_shapes(struct sample *s, struct ynode *y, struct err *e)
{
    double period_m[2] = {NAN, INFINITY};
    struct ynode *period = ymap_find(y, "period"), *list = NULL;
    if (!period)
        return yaml_bad(y, e, "needs the key 'period'");
    const int count = ynode_is_list(period) ? 2 : 1;
    if (!read_numbers(y, "period", UNIT_M, 1e-8, 1e-3, period_m, count, e) ||
        !ymap_num(y, "ground", Y_OPTIONAL, UNIT_NONE, 0, 1, &s->ground, e) ||
        !ymap_list(y, "shapes", Y_NEEDED, &list, e))
        return false;
    if (!ylist_count(list) || ylist_count(list) > MAX_SHAPES)
        return yaml_bad(list, e, "%d shapes: must be 1 to %d", ylist_count(list), MAX_SHAPES);
    s->period_x_m = period_m[0];
    s->period_y_m = period_m[1];
    for (int k = 0; k < ylist_count(list); k++)
        if (!read_one_shape(s, ylist_at(list, k), count == 1, e))
            return false;
    return !overlap(s) || yaml_bad(list, e, "two shapes overlap");
}

static const struct kind {
    const char *name;
    bool (*read)(struct sample *s, struct ynode *y, struct err *e); // NULL: reads a file
} kinds[] = {
    {"flat", read_flat},
    {"blazed", read_blazed},
    {"cd", read_cd},
    {"lcd", read_lcd},
    {"tv", read_tv},
    {"holographic", read_holographic},
    {"random", read_random},
    {"quasi-periodic", read_quasi_periodic},
    {"quasi-random", read_quasi_random},
    {"height", NULL},
    {"shapes", read_shapes},
};
static const char kind_names[] =
    "flat|blazed|cd|lcd|tv|holographic|random|quasi-periodic|quasi-random|height|shapes";

static bool read_common(struct sample *s, struct ynode *y, struct err *e)
{
    int fresnel = 1, layout = (int)s->layout;
    struct ynode *rough = NULL, *stripes = NULL;
    if (!ymap_num(y, "turn", Y_OPTIONAL, UNIT_RAD, -7, 7, &s->turn_rad, e) ||
        !ymap_num(y, "coherence", Y_OPTIONAL, UNIT_M, 1e-6, 1e-3, &s->coherence_m, e) ||
        !ymap_num(y, "r0", Y_OPTIONAL, UNIT_NONE, 1e-6, 1, &s->r0, e) ||
        !ymap_choice(y, "fresnel", Y_OPTIONAL, "constant|schlick", &fresnel, e) ||
        !ymap_choice(y, "layout", Y_OPTIONAL, "plane|disc|cylinder", &layout, e) ||
        !ymap_map(y, "rough", Y_OPTIONAL, &rough, e) ||
        !ymap_map(y, "stripes", Y_OPTIONAL, &stripes, e))
        return false;
    s->schlick = fresnel == 1;
    s->layout = (enum sample_layout)layout;
    if (rough && (!ymap_num(rough, "rms", Y_NEEDED, UNIT_M, 0, 5e-7, &s->rough_rms_m, e) ||
                  !ymap_num(rough, "length", Y_NEEDED, UNIT_M, 1e-7, 1e-3, &s->rough_length_m, e)))
        return false;
    if (stripes && (!ymap_num(stripes, "period", Y_NEEDED, UNIT_M, 1e-5, 1, &s->stripe_m, e) ||
                    !ymap_num(stripes, "duty", Y_OPTIONAL, UNIT_NONE, 0.01, 1, &s->stripe_duty, e)))
        return false;
    if (s->layout == SAMPLE_DISC && !ymap_num(y, "hub", Y_OPTIONAL, UNIT_M, 0, 1, &s->hub_m, e))
        return false;
    return s->layout != SAMPLE_CYLINDER ||
           ymap_num(y, "bend", Y_NEEDED, UNIT_M, 1e-3, 1e3, &s->bend_radius_m, e);
}

bool sample_read(struct sample *s, struct ynode *y, const char *path, struct err *e)
{
    int kind;
    if (!ymap_choice(y, "kind", Y_NEEDED, kind_names, &kind, e))
        return false;
    struct sample got = {
        .period_y_m = INFINITY,
        .ground = 1,
        .coherence_m = 65e-6,
        .r0 = 0.04,
        .schlick = true,
        .stripe_duty = 0.5,
    };
    strcpy(got.kind, kinds[kind].name);
    const bool read =
        kinds[kind].read ? kinds[kind].read(&got, y, e) : read_height(&got, y, path, e);
    if (!read || !read_common(&got, y, e)) {
        sample_finish(&got);
        return false;
    }
    *s = got;
    return true;
}

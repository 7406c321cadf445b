// env_separable.c - a lat-long map blurred by the factors of a diffraction table.
#define _GNU_SOURCE
#include "process/env_separable.h"
#include "core/mem.h"
#include "process/env_blur.h"
#include "process/env_turn.h"
#include "process/table_cubic.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool env_taps(struct env_taps *t, const struct factors *f, int filter, int rank, int taps,
              struct err *e)
{
    enum { FINE = 16 }; // samples of a filter averaged to a tap
    const struct table nodes = {.n = f->n, .range = f->range, .power = f->power};
    const float *from = f->f[filter] + (size_t)rank * (size_t)f->n * 3;
    *t = (struct env_taps){.h = sample_alloc((size_t)taps, sizeof *t->h, "filter", e),
                           .rgb = sample_alloc((size_t)taps * 3, sizeof *t->rgb, "filter", e)};
    if (!t->h || !t->rgb) {
        env_taps_finish(t);
        return false;
    }
    const double reach = fmin(f->range, 1), step = 2 * reach / taps;
    for (int k = 0; k < taps; k++) {
        const double h = -reach + (k + .5) * step, c = sqrt(1 - h * h);
        double rgb[3] = {0}, w[STENCIL];
        for (int m = 0; m < FINE; m++) {
            int first;
            if (!table_stencil(&nodes, h + step * ((m + .5) / FINE - .5), &first, w))
                continue;
            for (int q = 0; q < STENCIL && first + q < f->n; q++)
                for (int x = 0; x < 3; x++)
                    rgb[x] += w[q] / FINE * (double)from[3 * (first + q) + x];
        }
        if (rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0)
            continue;
        t->h[t->n] = (float)h;
        for (int x = 0; x < 3; x++)
            t->rgb[3 * t->n + x] = (float)(rgb[x] * step * (1 + c) * (1 + c) / (4 * c));
        t->n++;
    }
    return true;
}

void env_taps_finish(struct env_taps *t)
{
    free(t->h);
    free(t->rgb);
    *t = (struct env_taps){0};
}

struct frame separable_turn(const struct frame *f)
{
    return (struct frame){f->t, v3_scale(-1, f->b), v3_scale(-1, f->n)};
}

void separable_axis(const struct factors *f, int filter, const struct frame *frame, bool rotate,
                    double axis[2])
{
    axis[0] = f->axis[filter][0];
    axis[1] = f->axis[filter][1];
    if (rotate)
        return;
    // Columns and rows at the normal; at a pole any direction serves.
    const double r = hypot(frame->n.x, frame->n.z);
    const struct vec3 right = r > 1e-9 ? v3(-frame->n.z / r, 0, frame->n.x / r) : v3(1, 0, 0);
    const struct vec3 down = v3_cross(frame->n, right);
    const struct vec3 a = v3_add(v3_scale(axis[0], frame->t), v3_scale(axis[1], frame->b));
    axis[0] = v3_dot(a, right);
    axis[1] = v3_dot(a, down);
}

static bool filter(const struct factors *f, int which, int rank, const struct separable *how,
                   const struct frame *frame, const struct wide *in, bool add, struct wide *out,
                   struct err *e)
{
    struct env_taps t;
    double axis[2];
    if (!env_taps(&t, f, which, rank, how->taps, e))
        return false;
    separable_axis(f, which, frame, how->rotate, axis);
    const bool ok = env_blur(in, &t, axis, add, out, e);
    env_taps_finish(&t);
    return ok;
}

static bool filters(const struct factors *f, const struct separable *how, const struct frame *frame,
                    const struct wide *in, struct wide *out, struct err *e)
{
    if (f->kind != FACTOR_COMPOSITION)
        return filter(f, 0, 0, how, frame, in, false, out, e) &&
               (f->kind == FACTOR_LINE || filter(f, 1, 0, how, frame, in, true, out, e));
    struct wide mid;
    bool ok = wide_init(&mid, in->w, in->h, e);
    for (int r = 0; r < f->rank && ok; r++) // R17 eq. 10 and 11 as printed would mix the ranks
        ok = filter(f, 1, r, how, frame, in, false, &mid, e) &&
             filter(f, 0, r, how, frame, &mid, r > 0, out, e);
    wide_finish(&mid);
    return ok;
}

bool separable_check(const struct separable *how, struct err *e)
{
    if (how->width < 4 || how->width % 2 || how->width > 32768)
        return err_set(e, ERR_DATA, "bad map width %d: must be even, 4 to 32768", how->width);
    return (how->taps >= 1 && how->taps <= 16384) ||
           err_set(e, ERR_DATA, "bad number of taps %d: must be 1 to 16384", how->taps);
}

bool env_separable(const struct factors *f, const struct environment *env,
                   const struct frame *frame, const struct separable *how, struct image *out,
                   struct err *e)
{
    const int w = how->width, h = w / 2;
    if (!separable_check(how, e))
        return false;
    const struct frame turn =
        how->rotate ? separable_turn(frame) : (struct frame){{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const float scale = (float)(16 * M_PI * M_PI);
    struct wide in = {0}, sum = {0};
    struct environment turned = {0};
    bool ok =
        wide_init(&in, w, h, e) && wide_init(&sum, w, h, e) && image_init(&turned.map, w, h, 3, e);
    if (ok) {
        env_turn(env, &turn, false, &turned.map);
        wide_take(&in, &turned.map);
        ok = filters(f, how, frame, &in, &sum, e) && image_init(out, w, h, 3, e);
    }
    if (ok && how->rotate) {
        wide_give(&sum, scale, &turned.map);
        env_turn(&turned, &turn, true, out);
    } else if (ok) {
        wide_give(&sum, scale, out);
    }
    environment_finish(&turned);
    wide_finish(&in);
    wide_finish(&sum);
    return ok;
}

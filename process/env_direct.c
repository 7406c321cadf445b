// env_direct.c - light off a diffracting plane by full integration over the hemisphere.
#define _GNU_SOURCE
#include "process/env_direct.h"
#include "core/log.h"
#include "core/mem.h"
#include "process/table_cubic.h"
#include <math.h>
#include <stdlib.h>

enum { ROWS = 16 };

// Parts at most a sixth of what the table resolves.
static int cuts(const struct table *t, const struct environment *env)
{
    const double pixel = M_PI / env->map.h, detail = fmax(table_detail(t), 1e-4);
    return (int)fmax(2, fmin(64, ceil(6 * pixel / detail)));
}

static void add_row(const struct table *t, const struct fresnel *f, const struct env_part *part,
                    int count, const double o[2], double sum[3])
{
    const double on = sqrt(1 - o[0] * o[0] - o[1] * o[1]);
    for (int k = 0; k < count; k++) {
        const struct env_part *p = &part[k];
        const double u = p->t + o[0], v = p->b + o[1], w = p->n + on;
        if (fabs(u) > t->range || fabs(v) > t->range)
            continue;
        double s[3];
        table_cubic(t, u, v, w, s);
        double z = zonal_weight(f, p->t * o[0] + p->b * o[1] + p->n * on);
        if (t->basis != TABLE_PLAIN)
            z /= 4 * M_PI * M_PI * w * w;
        for (int c = 0; c < 3; c++)
            sum[c] += z * s[c] * p->power[c];
    }
}

bool env_direct(const struct table *t, const struct fresnel *f, const struct environment *env,
                const struct frame *frame, int n, const double (*o)[2], double (*rgb)[3],
                struct err *e)
{
    const int h = env->map.h;
    struct env_parts light;
    if (!env_parts_init(&light, env, frame, cuts(t, env), e))
        return false;
    const size_t room = env_parts_room(&light);
    struct env_part *part = sample_alloc(room * ROWS, sizeof *part, "light", e);
    if (!part) {
        env_parts_finish(&light);
        return false;
    }
    for (int k = 0; k < n; k++)
        rgb[k][0] = rgb[k][1] = rgb[k][2] = 0;
    struct progress bar;
    progress_start(&bar, "integrating", h);
    for (int row = 0; row < h; row += ROWS) {
        const int rows = h - row < ROWS ? h - row : ROWS;
        int count[ROWS];
#pragma omp parallel for schedule(dynamic)
        for (int r = 0; r < rows; r++)
            count[r] = env_parts_row(&light, row + r, part + room * (size_t)r);
#pragma omp parallel for schedule(dynamic)
        for (int k = 0; k < n; k++)
            for (int r = 0; r < rows && o[k][0] * o[k][0] + o[k][1] * o[k][1] < 1; r++)
                add_row(t, f, part + room * (size_t)r, count[r], o[k], rgb[k]);
        progress_step(&bar, rows);
    }
    progress_end(&bar);
    const bool not_negative = table_not_negative(t);
    for (int k = 0; k < n; k++) {
        const double on2 = 1 - o[k][0] * o[k][0] - o[k][1] * o[k][1];
        for (int c = 0; c < 3 && on2 > 0; c++)
            rgb[k][c] =
                4 * M_PI * M_PI / sqrt(on2) * (not_negative ? fmax(0, rgb[k][c]) : rgb[k][c]);
    }
    free(part);
    env_parts_finish(&light);
    return true;
}

bool env_direct_map(const struct table *t, const struct fresnel *f, const struct environment *env,
                    const struct frame *frame, int n, struct image *out, struct err *e)
{
    const size_t nodes = (size_t)n * (size_t)n;
    double(*o)[2] = sample_alloc(nodes, sizeof *o, "map", e);
    double(*rgb)[3] = sample_alloc(nodes, sizeof *rgb, "map", e);
    bool ok = o && rgb;
    for (size_t k = 0; k < nodes && ok; k++) {
        o[k][0] = 2.0 * (double)(k % (size_t)n) / (n - 1) - 1;
        o[k][1] = 2.0 * (double)(k / (size_t)n) / (n - 1) - 1;
    }
    ok = ok && env_direct(t, f, env, frame, (int)nodes, (const double(*)[2])o, rgb, e) &&
         image_init(out, n, n, 3, e);
    for (size_t k = 0; k < 3 * nodes && ok; k++)
        out->px[k] = (float)rgb[k / 3][k % 3];
    free(o);
    free(rgb);
    return ok;
}

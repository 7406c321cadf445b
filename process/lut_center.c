// lut_center.c - where order 0 is: the centre of the brightest lobe.
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/lut_pattern.h"
#include <math.h>
#include <stdlib.h>

// Brightness around (i, j) without its brightest pixel: what a lobe has and a hot pixel has not.
static double lobe_level(const struct lut_pattern *p, int i, int j)
{
    double sum = 0, top = -INFINITY;
    for (int y = j - 1; y <= j + 1; y++)
        for (int x = i - 1; x <= i + 1; x++) {
            const double v = p->px[y * p->w + x];
            sum += v;
            top = fmax(top, v);
        }
    return (sum - top) / 8;
}

// Centroid of the connected pixels above half the level, weighted by what they rise above it and
// cut at the level: clipping flattens the top alike on all sides, and the weights vanish at the
// edge.
static void centroid(struct lut_pattern *p, int at, double level)
{
    const double foot = 0.5 * level;
    const size_t count = (size_t)p->w * (size_t)p->h;
    uint8_t *in = xcalloc(count, 1);
    int *stack = xcalloc(count, sizeof *stack), n = 0;
    double sum = 0, sum_x = 0, sum_y = 0;
    in[stack[n++] = at] = 1;
    while (n) {
        const int k = stack[--n], x = k % p->w, y = k / p->w;
        const double weight = fmin(p->px[k], level) - foot;
        sum += weight;
        sum_x += weight * x;
        sum_y += weight * y;
        const int next[4] = {x > 0 ? k - 1 : k, x < p->w - 1 ? k + 1 : k, y > 0 ? k - p->w : k,
                             y < p->h - 1 ? k + p->w : k};
        for (int m = 0; m < 4; m++)
            if (!in[next[m]] && p->px[next[m]] > foot)
                in[stack[n++] = next[m]] = 1;
    }
    p->cx = sum_x / sum;
    p->cy = sum_y / sum;
    free(in);
    free(stack);
}

bool lut_pattern_center(struct lut_pattern *p, struct err *e)
{
    double level = 0;
    int at = -1;
    for (int j = 1; j < p->h - 1; j++)
        for (int i = 1; i < p->w - 1; i++) {
            const double l = lobe_level(p, i, j);
            if (l > level) {
                level = l;
                at = j * p->w + i;
            }
        }
    if (at < 0)
        return err_set(e, ERR_DATA, "no lobe to take the centre from: the pattern is dark");
    int brightest = at;
    for (int y = -1; y <= 1; y++)
        for (int x = -1; x <= 1; x++)
            if (p->px[at + y * p->w + x] > p->px[brightest])
                brightest = at + y * p->w + x;
    centroid(p, brightest, level);
    return true;
}

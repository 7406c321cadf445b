// spots.c - an environment's light in far lights, and parted: its brightest spots, and the rest.
#define _GNU_SOURCE
#include "core/mem.h"
#include "render/cut.h"
#include "render/surround.h"
#include <math.h>
#include <stdlib.h>

static const float *pixel(const struct image *im, int i, int j)
{
    return im->px + ((size_t)j * (size_t)im->w + (size_t)i) * 3;
}

static double luminance(const float *px)
{
    return 0.2126 * (double)px[0] + 0.7152 * (double)px[1] + 0.0722 * (double)px[2];
}

static struct surround_light light_of(const struct image *im, const struct cut_part *p)
{
    struct surround_light l = {0};
    struct vec3 to = {0};
    for (int j = p->j; j < p->j + p->h; j++)
        for (int i = p->i; i < p->i + p->w; i++) {
            double sum = 0;
            for (int c = 0; c < 3; c++) {
                const double power =
                    p->share * surround_row_angle(im, j) * (double)pixel(im, i, j)[c];
                l.irradiance[c] += power;
                sum += power;
            }
            to = v3_add(to, v3_scale(sum, latlong_dir(i, j, im->w, im->h)));
        }
    l.to = v3_norm(to) > 0 ? v3_unit(to)
                           : latlong_dir(p->i + p->w / 2.0, p->j + p->h / 2.0, im->w, im->h);
    return l;
}

struct surround_light *surround_cut(const struct image *map, int most, int parts, int *n,
                                    struct err *e)
{
    const size_t w = (size_t)map->w, h = (size_t)map->h, all = (size_t)most * (size_t)parts;
    double *x = xcalloc(w + 1, sizeof *x), *y = xcalloc(h + 1, sizeof *y);
    double *slant = xcalloc(h, sizeof *slant);
    double *power = sample_alloc(w * h, sizeof *power, "lights", e);
    struct cut_part *part = sample_alloc(all, sizeof *part, "lights", e);
    struct surround_light *light = sample_alloc(all, sizeof *light, "lights", e);
    for (size_t i = 0; i <= w; i++)
        x[i] = 2 * M_PI * (double)i / (double)w;
    for (size_t j = 0; j <= h; j++)
        y[j] = M_PI * (double)j / (double)h;
    for (size_t j = 0; j < h; j++)
        slant[j] = sin(M_PI * ((double)j + .5) / (double)h);
    for (size_t k = 0; k < w * h && power; k++)
        power[k] = surround_row_angle(map, (int)(k / w)) * luminance(map->px + 3 * k);
    const struct cut_grid g = {map->w, map->h, power, x, y, slant};
    const int cells = power && part && light ? cut_cells(&g, most, parts, part, e) : -1;
    *n = 0;
    for (int k = 0; k < cells; k++) {
        const struct cut_part *p = part + (size_t)k * (size_t)parts;
        double power_of_cell = 0;
        for (int q = 0; q < parts; q++)
            power_of_cell += p[q].power;
        for (int q = 0; q < parts && power_of_cell > 0; q++) // of a cell that is not dark
            light[(*n)++] = light_of(map, &p[q]);
    }
    if (cells < 0) {
        free(light);
        light = NULL;
    }
    free(x);
    free(y);
    free(slant);
    free(power);
    free(part);
    return light;
}

struct ranked {
    double luminance, angle;
};

static int brighter_first(const void *a, const void *b)
{
    const double x = ((const struct ranked *)a)->luminance,
                 y = ((const struct ranked *)b)->luminance;
    return (x < y) - (x > y);
}

// The luminance above which there is so little of the sphere that the lights of one picture lie
// a degree apart there.
static bool find_limit(const struct image *im, double *limit, struct err *e)
{
    const double spots_sr = SURROUND_SPOTS * 2e-4;
    const size_t n = (size_t)im->w * (size_t)im->h;
    struct ranked *r = sample_alloc(n, sizeof *r, "an environment", e);
    if (!r)
        return false;
    for (size_t k = 0; k < n; k++)
        r[k] = (struct ranked){luminance(im->px + 3 * k), surround_row_angle(im, (int)k / im->w)};
    qsort(r, n, sizeof *r, brighter_first);
    size_t k = 0;
    for (double sum = r[0].angle; k < n - 1 && sum < spots_sr; sum += r[k].angle)
        k++;
    *limit = r[k].luminance;
    free(r);
    return true;
}

// Of every pixel what is above the limit, and what is not.
bool surround_part(const struct image *im, struct image *spots, struct image *rest, struct err *e)
{
    double limit;
    if (!find_limit(im, &limit, e) || !image_init(spots, im->w, im->h, 3, e) ||
        !image_init(rest, im->w, im->h, 3, e))
        return false;
    const size_t n = (size_t)im->w * (size_t)im->h;
    for (size_t k = 0; k < n; k++) {
        const double y = luminance(im->px + 3 * k), keep = y > limit ? limit / y : 1;
        for (size_t c = 3 * k; c < 3 * k + 3; c++) {
            rest->px[c] = (float)(keep * (double)im->px[c]);
            spots->px[c] = im->px[c] - rest->px[c];
        }
    }
    return true;
}

// The mean over the solid angle of what each pixel of the smaller map covers.
static bool shrink(const struct image *im, int w, int h, struct image *out, struct err *e)
{
    if (!image_init(out, w, h, 3, e))
        return false;
    for (int k = 0; k < w * h; k++) {
        const double x0 = (double)(k % w) * im->w / w, x1 = x0 + (double)im->w / w;
        const double y0 = (double)(k / w) * im->h / h, y1 = y0 + (double)im->h / h;
        double sum[3] = {0}, all = 0;
        for (int j = (int)y0; j < y1 - 1e-9; j++)
            for (int i = (int)x0; i < x1 - 1e-9; i++) {
                const double part = (fmin(i + 1, x1) - fmax(i, x0)) *
                                    (fmin(j + 1, y1) - fmax(j, y0)) * surround_row_angle(im, j);
                all += part;
                for (int c = 0; c < 3; c++)
                    sum[c] += part * (double)pixel(im, i, j)[c];
            }
        for (int c = 0; c < 3; c++)
            out->px[3 * k + c] = (float)(sum[c] / all);
    }
    return true;
}

bool surround_levels(struct surround *s, struct image *whole, struct err *e)
{
    int h = 1;
    while (2 * h <= whole->h)
        h *= 2;
    if (h == whole->h && whole->w == 2 * h) {
        s->rest[0] = *whole;
        *whole = (struct image){0};
    } else if (!shrink(whole, 2 * h, h, &s->rest[0], e)) {
        return false;
    }
    for (s->n_levels = 1; h > 2 && s->n_levels < SURROUND_LEVELS; s->n_levels++) {
        h /= 2;
        if (!shrink(&s->rest[s->n_levels - 1], 2 * h, h, &s->rest[s->n_levels], e))
            return false;
    }
    return true;
}

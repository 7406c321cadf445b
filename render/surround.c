// surround.c - environments: bilinear radiance, harmonics, lights, spots and the rest, maps.
#define _GNU_SOURCE
#include "render/surround.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const float *pixel(const struct image *im, int i, int j)
{
    return im->px + ((size_t)j * (size_t)im->w + (size_t)i) * 3;
}

static void turn(struct image *im, int columns)
{
    float *row = malloc((size_t)im->w * 3 * sizeof *row);
    for (int j = 0; j < im->h && row; j++) {
        float *px = im->px + (size_t)j * (size_t)im->w * 3;
        memcpy(row, px, (size_t)im->w * 3 * sizeof *row);
        for (int i = 0; i < im->w; i++)
            memcpy(px + 3 * i, row + 3 * ((i + columns) % im->w), 3 * sizeof *row);
    }
    free(row);
}

double surround_row_angle(const struct image *im, int j)
{
    return 2 * M_PI / im->w * (cos(M_PI * j / im->h) - cos(M_PI * (j + 1) / im->h));
}

static void harmonics(struct vec3 d, double y[SURROUND_TERMS])
{
    const double all[SURROUND_TERMS] = {0.282095,
                                        0.488603 * d.y,
                                        0.488603 * d.z,
                                        0.488603 * d.x,
                                        1.092548 * d.x * d.y,
                                        1.092548 * d.y * d.z,
                                        0.315392 * (3 * d.z * d.z - 1),
                                        1.092548 * d.x * d.z,
                                        0.546274 * (d.x * d.x - d.y * d.y)};
    memcpy(y, all, sizeof all);
}

static void add_harmonics(struct surround *s)
{
    static const double lobe[SURROUND_TERMS] = {M_PI,         M_PI * 2 / 3, M_PI * 2 / 3,
                                                M_PI * 2 / 3, M_PI / 4,     M_PI / 4,
                                                M_PI / 4,     M_PI / 4,     M_PI / 4};
    const struct image *im = &s->env.map;
    for (int j = 0; j < im->h; j++) {
        double row[SURROUND_TERMS][3] = {0};
        for (int i = 0; i < im->w; i++) {
            double y[SURROUND_TERMS];
            harmonics(latlong_dir(i, j, im->w, im->h), y);
            for (int k = 0; k < 3 * SURROUND_TERMS; k++)
                row[k / 3][k % 3] += y[k / 3] * (double)pixel(im, i, j)[k % 3];
        }
        for (int k = 0; k < 3 * SURROUND_TERMS; k++)
            s->irradiance[k / 3][k % 3] +=
                surround_row_angle(im, j) * lobe[k / 3] * row[k / 3][k % 3];
    }
}

static bool cut_into(const struct image *map, int most, struct surround_light *to, int *n,
                     struct err *e)
{
    struct surround_light *light = surround_cut(map, most, 1, n, e);
    if (light)
        memcpy(to, light, (size_t)*n * sizeof *light);
    free(light);
    return light != NULL;
}

bool surround_init(struct surround *s, struct environment *env, double intensity, double turn_rad,
                   struct err *e)
{
    *s = (struct surround){.env = *env, .shown = true};
    *env = (struct environment){0};
    struct image *im = &s->env.map, rest = {0};
    const size_t n = (size_t)im->w * (size_t)im->h * 3;
    for (size_t k = 0; k < n; k++)
        im->px[k] *= (float)intensity;
    const long columns = lround(turn_rad / (2 * M_PI) * im->w) % im->w;
    turn(im, (int)(columns < 0 ? columns + im->w : columns));
    add_harmonics(s);
    const bool ok = cut_into(im, SURROUND_LIGHTS, s->light, &s->n_lights, e) &&
                    surround_part(im, &s->spots, &rest, e) &&
                    cut_into(&s->spots, SURROUND_SPOTS, s->spot, &s->n_spots, e) &&
                    surround_levels(s, &rest, e);
    image_finish(&rest);
    if (!ok)
        surround_finish(s);
    return ok;
}

void surround_finish(struct surround *s)
{
    if (!s)
        return;
    environment_finish(&s->env);
    image_finish(&s->spots);
    for (int k = 0; k < SURROUND_LEVELS; k++)
        image_finish(&s->rest[k]);
}

static void read_map(const struct image *im, struct vec3 dir, double rgb[3])
{
    double x, y;
    latlong_pixel(dir, im->w, im->h, &x, &y);
    y = fmax(0, fmin(im->h - 1, y));
    const int i = (int)floor(x), j = y < im->h - 1 ? (int)y : im->h - 2;
    const double fx = x - i, fy = y - j;
    const int left = (i + im->w) % im->w, right = (i + 1 + im->w) % im->w;
    for (int c = 0; c < 3; c++)
        rgb[c] = (1 - fy) * ((1 - fx) * (double)pixel(im, left, j)[c] +
                             fx * (double)pixel(im, right, j)[c]) +
                 fy * ((1 - fx) * (double)pixel(im, left, j + 1)[c] +
                       fx * (double)pixel(im, right, j + 1)[c]);
}

void surround_radiance(const struct surround *s, struct vec3 dir, double rgb[3])
{
    read_map(&s->env.map, dir, rgb);
}

// Pixels of a level, and linear reading between them, spread a point by half a pixel rms.
void surround_rest(const struct surround *s, struct vec3 dir, double extent_rad, double rgb[3])
{
    const double level = ceil(log2(fmax(1e-9, 2 * extent_rad * s->rest[0].h / M_PI)) - .5);
    read_map(&s->rest[(int)fmax(0, fmin(s->n_levels - 1, level))], dir, rgb);
}

void surround_irradiance(const struct surround *s, struct vec3 normal, double rgb[3])
{
    double y[SURROUND_TERMS];
    harmonics(normal, y);
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int k = 0; k < SURROUND_TERMS; k++)
            sum += y[k] * s->irradiance[k][c];
        rgb[c] = fmax(0, sum);
    }
}

bool surround_prefilter(const struct surround *s, const struct material *m, const struct frame *f,
                        const struct seen_how *how, struct image *map, struct err *e)
{
    const struct fresnel fresnel = {true, m->r0};
    const struct env_how exact = {
        .tolerance = 2e-3, .detail_rad = M_PI / s->env.map.h, .span = how->span};
    const int n = how->n;
    if (!env_keep_map(how->keep, &m->table, &fresnel, &exact, &s->env, f, how->middle, n, map, e))
        return false;
    // env_exact takes F^2 / F0^2, a plain table with its 4 pi^2.
    const double scale = m->gain * m->table_scale * m->r0 / (m->over_w2 ? 1 : 4 * M_PI * M_PI);
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const double t = env_map_cosine(i, n), b = env_map_cosine(j, n);
            const double cos_o = sqrt(fmax(0, 1 - t * t - b * b));
            for (int c = 0; c < 3; c++)
                map->px[((size_t)j * (size_t)n + (size_t)i) * 3 + (size_t)c] *=
                    (float)(scale * cos_o);
        }
    return true;
}

void surround_map_at(const struct image *map, struct vec3 wo, double rgb[3])
{
    const int n = map->w;
    const double x = (wo.x + 1) / 2 * (n - 1), y = (wo.y + 1) / 2 * (n - 1);
    const int i = x < n - 1 ? (int)x : n - 2, j = y < n - 1 ? (int)y : n - 2;
    const double fx = x - i, fy = y - j;
    for (int c = 0; c < 3; c++) {
        const float *a = pixel(map, i, j) + c, *b = pixel(map, i, j + 1) + c;
        rgb[c] = ((1 - fy) * ((1 - fx) * (double)a[0] + fx * (double)a[3]) +
                  fy * ((1 - fx) * (double)b[0] + fx * (double)b[3])) /
                 wo.z;
    }
}

// environment.c - lat-long maps: checks, radiance by direction, parts.
#define _GNU_SOURCE
#include "process/environment.h"
#include "core/imgfile.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool check(const struct image *im, struct err *e)
{
    if (im->w != 2 * im->h || im->h < 2)
        return err_set(e, ERR_DATA,
                       "%d x %d pixels: a lat-long map is twice as wide as high, at least 4 x 2",
                       im->w, im->h);
    if (im->nc != 1 && im->nc < 3)
        return err_set(e, ERR_DATA, "%d channels: must be R,G,B or grey", im->nc);
    const size_t n = (size_t)im->w * (size_t)im->h;
    const int used = im->nc < 3 ? im->nc : 3;
    for (size_t k = 0; k < n; k++)
        for (int c = 0; c < used; c++) {
            const float x = im->px[k * (size_t)im->nc + (size_t)c];
            if (!(x >= 0) || isinf(x))
                return err_set(e, ERR_DATA,
                               "pixel (%zu, %zu) has radiance %g: must be finite and not negative",
                               k % (size_t)im->w, k / (size_t)im->w, (double)x);
        }
    return true;
}

static bool to_rgb(struct image *im, struct err *e)
{
    struct image rgb;
    if (!image_init(&rgb, im->w, im->h, 3, e))
        return false;
    const size_t n = (size_t)im->w * (size_t)im->h, nc = (size_t)im->nc;
    for (size_t k = 0; k < n; k++)
        for (size_t c = 0; c < 3; c++)
            rgb.px[3 * k + c] = im->px[nc * k + (nc == 1 ? 0 : c)];
    image_finish(im);
    *im = rgb;
    return true;
}

bool environment_take(struct environment *env, struct image *map, const char *name, struct err *e)
{
    if (!check(map, e) || (map->nc != 3 && !to_rgb(map, e)))
        return err_in(e, "%s", name);
    env->map = *map;
    *map = (struct image){0};
    return true;
}

bool environment_read(struct environment *env, const char *path, struct err *e)
{
    struct image map = {0};
    const bool ok = image_read(&map, path, e) && environment_take(env, &map, path, e);
    image_finish(&map);
    return ok;
}

void environment_finish(struct environment *env)
{
    if (env)
        image_finish(&env->map);
}

static void catmull_rom(double x, double w[4])
{
    w[0] = x * (-.5 + x * (1 - .5 * x));
    w[1] = 1 + x * x * (-2.5 + 1.5 * x);
    w[2] = x * (.5 + x * (2 - 1.5 * x));
    w[3] = x * x * (-.5 + .5 * x);
}

// A row beyond a pole is the row before it, seen from the other side: half a turn on.
static const float *row_over_pole(const struct image *im, int j, int *turn)
{
    *turn = 0;
    if (j < 0 || j >= im->h) {
        j = j < 0 ? -1 - j : 2 * im->h - 1 - j;
        *turn = im->w / 2;
    }
    return im->px + (size_t)j * (size_t)im->w * 3;
}

void environment_radiance(const struct environment *env, struct vec3 dir, double rgb[3])
{
    const struct image *im = &env->map;
    double col, row, wx[4], wy[4];
    latlong_pixel(dir, im->w, im->h, &col, &row);
    const int i = (int)floor(col), j = (int)floor(row);
    catmull_rom(col - i, wx);
    catmull_rom(row - j, wy);
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int q = 0; q < 4; q++) {
        int turn;
        const float *line = row_over_pole(im, j + q - 1, &turn);
        for (int p = 0; p < 4; p++) {
            const float *px = line + 3 * ((i + p - 1 + turn + im->w) % im->w);
            for (int c = 0; c < 3; c++)
                rgb[c] += wx[p] * wy[q] * px[c];
        }
    }
    for (int c = 0; c < 3; c++)
        rgb[c] = fmax(rgb[c], 0);
}

size_t env_parts_room(const struct environment *env, int cut)
{
    return (size_t)env->map.w * (size_t)cut * (size_t)cut;
}

// A line of the map between its rows, with two pixels of the other end on either side.
static void blend_rows(const struct image *im, double row, float *line /* [w + 4][3] */)
{
    double wy[4];
    const int j = (int)floor(row), w = im->w;
    catmull_rom(row - j, wy);
    memset(line, 0, ((size_t)w + 4) * 3 * sizeof *line);
    for (int q = 0; q < 4; q++) {
        int turn;
        const float *from = row_over_pole(im, j + q - 1, &turn), weight = (float)wy[q];
        for (int i = 0; i < w; i++)
            for (int c = 0; c < 3; c++)
                line[3 * (i + 2) + c] += weight * from[3 * ((i + turn) % w) + c];
    }
    memcpy(line, line + 3 * w, 6 * sizeof *line);
    memcpy(line + 3 * (w + 2), line + 6, 6 * sizeof *line);
}

int env_parts(const struct environment *env, const struct frame *f, int row, int cut,
              struct env_part *out)
{
    const struct image *im = &env->map;
    float *line = xcalloc((size_t)im->w + 4, 3 * sizeof *line);
    const double step_phi = 2 * M_PI / (im->w * cut), step_th = M_PI / (im->h * cut);
    int n = 0;
    for (int y = 0; y < cut; y++) {
        const double th0 = (row * cut + y) * step_th, th = th0 + .5 * step_th;
        const double sr = step_phi * (cos(th0) - cos(th0 + step_th)), s = sin(th), cy = cos(th);
        blend_rows(im, row + (y + .5) / cut - .5, line);
        for (int x = 0; x < cut; x++) {
            const double at = (x + .5) / cut - .5;
            const int shift = (int)floor(at);
            double wx[4];
            catmull_rom(at - shift, wx);
            for (int i = 0; i < im->w; i++) {
                const float *px = line + 3 * (i + shift + 1);
                double rgb[3];
                for (int c = 0; c < 3; c++)
                    rgb[c] = fmax(0, wx[0] * px[c] + wx[1] * px[c + 3] + wx[2] * px[c + 6] +
                                         wx[3] * px[c + 9]);
                if (!(rgb[0] + rgb[1] + rgb[2] > 0))
                    continue;
                const double phi = (i + at + .5) / im->w * 2 * M_PI - M_PI;
                const double sp = sin(phi), cp = -cos(phi);
                const struct vec3 d = frame_local(f, v3(s * sp, cy, s * cp));
                // How far n changes from the middle of the part to its edge: the horizon may cross
                // it.
                const double edge =
                    .5 * (fabs(f->n.x * cy * sp - f->n.y * s + f->n.z * cy * cp) * step_th +
                          fabs(f->n.z * sp - f->n.x * cp) * s * step_phi);
                if (d.z <= -edge)
                    continue;
                const bool whole = d.z >= edge;
                const double above = whole ? sr : sr * .5 * (1 + d.z / edge);
                out[n++] = (struct env_part){d.x,
                                             d.y,
                                             whole ? d.z : .5 * (d.z + edge),
                                             {above * rgb[0], above * rgb[1], above * rgb[2]}};
            }
        }
    }
    free(line);
    return n;
}

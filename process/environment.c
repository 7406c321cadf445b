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
    double sum[3] = {0};
    for (int q = 0; q < 4; q++) {
        int turn;
        const float *line = row_over_pole(im, j + q - 1, &turn);
        int x = i - 1 + turn; // -2 to 1.5 w
        x += x < 0 ? im->w : x >= im->w ? -im->w : 0;
        for (int p = 0; p < 4; p++) {
            const double weight = wx[p] * wy[q];
            for (int c = 0; c < 3; c++)
                sum[c] += weight * (double)line[3 * x + c];
            x = x + 1 < im->w ? x + 1 : 0;
        }
    }
    for (int c = 0; c < 3; c++)
        rgb[c] = fmax(sum[c], 0);
}

bool env_parts_init(struct env_parts *p, const struct environment *env, const struct frame *f,
                    int cut, struct err *e)
{
    const int columns = env->map.w * cut;
    *p = (struct env_parts){env, *f, cut, NULL};
    p->azimuth = sample_alloc((size_t)columns, sizeof *p->azimuth, "light", e);
    if (!p->azimuth)
        return false;
    for (int k = 0; k < columns; k++) {
        const double phi = (k + .5) / columns * 2 * M_PI - M_PI, s = sin(phi), c = cos(phi);
        p->azimuth[k][0] = s * f->t.x - c * f->t.z;
        p->azimuth[k][1] = s * f->b.x - c * f->b.z;
        p->azimuth[k][2] = s * f->n.x - c * f->n.z;
        p->azimuth[k][3] = c * f->n.x + s * f->n.z;
    }
    return true;
}

void env_parts_finish(struct env_parts *p)
{
    free(p->azimuth);
    *p = (struct env_parts){0};
}

size_t env_parts_room(const struct env_parts *p)
{
    return (size_t)p->env->map.w * (size_t)p->cut * (size_t)p->cut;
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

// What one line of parts has in common.
struct ring {
    double sine, cosine;   // of the polar angle
    double step_th, width; // angular height and width of a part
    double sr;             // solid angle
};

// One part from four neighbours in its line; false when it is dark or below the horizon.
static bool make_part(const struct env_parts *p, const struct ring *r, const double *azimuth,
                      const float *px, const double wx[4], struct env_part *out)
{
    double rgb[3];
    for (int c = 0; c < 3; c++)
        rgb[c] = fmax(0, wx[0] * (double)px[c] + wx[1] * (double)px[c + 3] +
                             wx[2] * (double)px[c + 6] + wx[3] * (double)px[c + 9]);
    if (!(rgb[0] + rgb[1] + rgb[2] > 0))
        return false;
    const struct frame *f = &p->frame;
    const double n = r->sine * azimuth[2] + r->cosine * f->n.y;
    // How far n changes from the middle of the part to its edge: the horizon may cross it.
    const double edge = .5 * (fabs(r->cosine * azimuth[2] - r->sine * f->n.y) * r->step_th +
                              fabs(azimuth[3]) * r->width);
    if (n <= -edge)
        return false;
    const double sr = n >= edge ? r->sr : r->sr * .5 * (1 + n / edge);
    *out = (struct env_part){r->sine * azimuth[0] + r->cosine * f->t.y,
                             r->sine * azimuth[1] + r->cosine * f->b.y,
                             n >= edge ? n : .5 * (n + edge),
                             {sr * rgb[0], sr * rgb[1], sr * rgb[2]}};
    return true;
}

int env_parts_row(const struct env_parts *p, int row, struct env_part *out)
{
    const struct image *im = &p->env->map;
    const int cut = p->cut;
    const double step_th = M_PI / (im->h * cut), step_phi = 2 * M_PI / (im->w * cut);
    float *line = xcalloc((size_t)im->w + 4, 3 * sizeof *line);
    int n = 0;
    for (int y = 0; y < cut; y++) {
        const double th0 = (row * cut + y) * step_th, th = th0 + .5 * step_th;
        const struct ring ring = {sin(th), cos(th), step_th, sin(th) * step_phi,
                                  step_phi * (cos(th0) - cos(th0 + step_th))};
        blend_rows(im, row + (y + .5) / cut - .5, line);
        for (int x = 0; x < cut; x++) {
            const double at = (x + .5) / cut - .5;
            const int shift = (int)floor(at);
            double wx[4];
            catmull_rom(at - shift, wx);
            for (int i = 0; i < im->w; i++)
                n += make_part(p, &ring, p->azimuth[i * cut + x], line + 3 * (i + shift + 1), wx,
                               &out[n]);
        }
    }
    free(line);
    return n;
}

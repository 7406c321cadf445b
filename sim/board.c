// board.c - a flat target through the simulated lens, every pixel the mean of many points.
#define _GNU_SOURCE
#include "sim/board.h"
#include "core/imgfile.h"
#include "core/mem.h"
#include "core/spectrum.h"
#include "core/yaml.h"
#include <libgen.h>
#include <math.h>
#include <stdlib.h>

static const double black = 0.04, white = 0.8, grey = 0.3;

bool board_read(struct sim_board *b, struct ynode *root, const char *path, struct err *e)
{
    struct ynode *y = NULL, *list = NULL;
    const char *picture = NULL;
    *b = (struct sim_board){0};
    if (!ymap_map(root, "board", Y_OPTIONAL, &y, e))
        return false;
    if (!y)
        return true;
    if (!ymap_text(y, "picture", Y_OPTIONAL, &picture, e) ||
        !ymap_list(y, picture ? "size" : "squares", Y_NEEDED, &list, e))
        return false;
    if (ylist_count(list) != 2)
        return yaml_bad(list, e, "%d values, needs 2", ylist_count(list));
    double n[2];
    for (int k = 0; k < 2; k++)
        if (!ynode_num(ylist_at(list, k), picture ? UNIT_M : UNIT_NONE, picture ? 1e-6 : 2,
                       picture ? 100 : 1000, picture ? &b->size_m[k] : &n[k], e))
            return false;
    if (!picture) {
        b->squares[0] = (int)n[0];
        b->squares[1] = (int)n[1];
        return ymap_num(y, "square", Y_NEEDED, UNIT_M, 1e-6, 10, &b->square_m, e);
    }
    char *copy = xstrdup(path);
    char *full = *picture == '/' ? xstrdup(picture) : xasprintf("%s/%s", dirname(copy), picture);
    double encoded = 0;
    const bool ok = image_read(&b->picture, full, e);
    if (ok && meta_num(&b->picture.meta, "nacre.encoded", &encoded) && encoded > 0)
        for (int k = 0; k < b->picture.w * b->picture.h * b->picture.nc; k++)
            b->picture.px[k] = (float)srgb_decode((double)b->picture.px[k]);
    free(full);
    free(copy);
    return ok;
}

// Brightness at (x, y) metres from the middle, x along t, y against b.
static double shade(const struct sim_board *b, double x, double y)
{
    if (b->picture.px) {
        const double i = (x / b->size_m[0] + 0.5) * b->picture.w;
        const double j = (y / b->size_m[1] + 0.5) * b->picture.h;
        if (!(i >= 0 && j >= 0 && i < b->picture.w && j < b->picture.h))
            return grey;
        const size_t k = (size_t)j * (size_t)b->picture.w + (size_t)i;
        return black + (white - black) * (double)b->picture.px[k * (size_t)b->picture.nc];
    }
    const double i = x / b->square_m + 0.5 * b->squares[0];
    const double j = y / b->square_m + 0.5 * b->squares[1];
    if (i < -1 || j < -1 || i > b->squares[0] + 1 || j > b->squares[1] + 1)
        return grey;
    if (i < 0 || j < 0 || i >= b->squares[0] || j >= b->squares[1])
        return white;
    return ((int)i + (int)j) % 2 ? white : black;
}

// Where the plane of the sample is hit, along t and against b; false: nowhere.
static bool hit(const struct sim_view *v, double i, double j, double out[2])
{
    const struct vec3 ray = view_ray(v, i, j);
    const double towards = v3_dot(ray, v->sample.n);
    const double far = v3_dot(v3_sub(v->sample_m, v->camera_m), v->sample.n) / towards;
    if (!(towards < 0) || !(far > 0))
        return false;
    const struct vec3 x = v3_add(v->camera_m, v3_scale(far, ray));
    const struct vec3 at = frame_local(&v->sample, v3_sub(x, v->sample_m));
    out[0] = at.x;
    out[1] = -at.y;
    return true;
}

// Points over a pixel blurred by the lens, box plus Gaussian, from Roberts' sequence in the plane,
// which leaves no gaps along edges of any direction. (Blurring the pixels instead would shift edges
// by hundredths of a pixel; so would the same points in every pixel along an edge.)
enum { POINTS = 1536, SETS = 61, RING = 24 };
typedef double points[POINTS][2];

// The share of box plus Gaussian below x, and the x below which there is a share.
static double share_below(double x, double sigma_px)
{
    if (!(sigma_px > 0))
        return fmin(1, fmax(0, x + 0.5));
    double at[2];
    for (int k = 0; k < 2; k++) { // the integral of the normal distribution's share
        const double t = (x + (k ? -0.5 : 0.5)) / sigma_px;
        at[k] = sigma_px * (0.5 * t * erfc(-t / M_SQRT2) + exp(-0.5 * t * t) / sqrt(2 * M_PI));
    }
    return at[0] - at[1];
}

static double place_of(double share, double sigma_px)
{
    double lo = -0.5 - 8 * sigma_px, hi = -lo;
    for (int turn = 0; turn < 60; turn++) {
        const double x = 0.5 * (lo + hi);
        *(share_below(x, sigma_px) < share ? &lo : &hi) = x;
    }
    return 0.5 * (lo + hi);
}

static void spread(double sigma_px, points at[SETS])
{
    const double g = 1.32471795724474602596; // g^3 = g + 1
#pragma omp parallel for schedule(static)
    for (int set = 0; set < SETS; set++)
        for (int k = 0; k < POINTS; k++)
            for (int d = 0; d < 2; d++) {
                const double x = 0.5 + (k + 1) / pow(g, d + 1) + set * sqrt(d + 2.);
                at[set][k][d] = place_of(x - floor(x), sigma_px);
            }
}

// The mean over the points; near a pixel the map to the board is linear to 1e-6. Where two rings
// about it, of four and two standard deviations, are of one shade, so is the pixel.
static double pixel(const struct sim_board *b, const struct sim_view *v, const points at, int i,
                    int j)
{
    double here[2], right[2], left[2], down[2], up[2], sum = 0;
    if (!hit(v, i, j, here) || !hit(v, i + 0.5, j, right) || !hit(v, i, j + 0.5, down) ||
        !hit(v, i - 0.5, j, left) || !hit(v, i, j - 0.5, up))
        return grey;
    const double across[2] = {right[0] - left[0], right[1] - left[1]};
    const double along[2] = {down[0] - up[0], down[1] - up[1]};
    const double middle = shade(b, here[0], here[1]), reach = 0.71 + 4 * v->defocus_px;
    bool even = true;
    for (int k = 0; even && k < RING; k++) {
        const double r = (k % 2 ? 0.5 : 1) * reach;
        const double f = r * cos(2 * M_PI * k / RING), g = r * sin(2 * M_PI * k / RING);
        even = shade(b, here[0] + f * across[0] + g * along[0],
                     here[1] + f * across[1] + g * along[1]) == middle;
    }
    if (even)
        return middle;
    for (int k = 0; k < POINTS; k++) {
        const double f = at[k][0], g = at[k][1];
        sum += shade(b, here[0] + f * across[0] + g * along[0],
                     here[1] + f * across[1] + g * along[1]);
    }
    return sum / POINTS;
}

bool board_photo(const struct sim_board *b, const struct sim_view *v, struct image *out,
                 struct err *e)
{
    struct image im;
    if (v->fourier || (!b->squares[0] && !b->picture.px))
        return err_set(e, ERR_DATA,
                       "no board to photograph: the scene needs 'board:' and a view of 'kind: "
                       "camera'");
    if (!image_init(&im, v->w, v->h, 1, e))
        return false;
    points *at = xcalloc(SETS, sizeof *at);
    spread(v->defocus_px, at);
#pragma omp parallel for schedule(dynamic, 4)
    for (int j = 0; j < v->h; j++)
        for (int i = 0; i < v->w; i++)
            im.px[(size_t)j * (size_t)v->w + (size_t)i] =
                (float)pixel(b, v, (const double(*)[2])at[(7 * i + 19 * j) % SETS], i, j);
    free(at);
    *out = im;
    return true;
}

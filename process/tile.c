// tile.c - windows and seamless tiles of height fields.
#define _GNU_SOURCE // M_PI
#include "process/tile.h"
#include <math.h>
#include <stdlib.h>

// 0 at 0, 1 at 1, without corners.
static double smooth(double t)
{
    return t >= 1 ? 1 : 0.5 - 0.5 * cos(M_PI * t);
}

static double mean_of(const struct hfield *hf)
{
    const int n = hf->nx * hf->ny;
    double sum = 0;
    for (int k = 0; k < n; k++)
        sum += (double)hf->z[k];
    return sum / n;
}

static double fade(int i, int n)
{
    const int from_border = i < n - 1 - i ? i : n - 1 - i;
    return smooth(8 * (from_border + 0.5) / n);
}

void hfield_window(struct hfield *hf)
{
    const double mean = mean_of(hf);
    for (int j = 0; j < hf->ny; j++)
        for (int i = 0; i < hf->nx; i++) {
            float *z = hf->z + (size_t)j * (size_t)hf->nx + (size_t)i;
            *z = (float)(mean + fade(i, hf->nx) * fade(j, hf->ny) * ((double)*z - mean));
        }
}

// A direction of the field: n nodes `step` apart, in `lines` lines `apart`.
struct way {
    int n, lines;
    size_t step, apart;
};

// Mean square difference of the first `margin` nodes and those `length` further.
static double mismatch(const float *z, const struct way *w, int margin, int length)
{
    double sum = 0;
    for (int l = 0; l < w->lines; l++)
        for (int i = 0; i < margin; i++) {
            const float *at = z + (size_t)l * w->apart + (size_t)i * w->step;
            const double d = (double)at[(size_t)length * w->step] - (double)*at;
            sum += d * d;
        }
    return sum / margin / w->lines;
}

// The best length; the first nodes become what leads over to them from the copy before.
static int close_way(float *z, const struct way *w, double *off)
{
    const int margin = w->n / 8;
    int length = w->n - margin;
    *off = INFINITY;
    for (int at = w->n - margin; at > w->n / 2; at--) {
        const double here = mismatch(z, w, margin, at);
        if (here < *off) {
            *off = here;
            length = at;
        }
    }
    for (int l = 0; l < w->lines; l++)
        for (int i = 0; i < margin; i++) {
            float *at = z + (size_t)l * w->apart + (size_t)i * w->step;
            const double own = smooth((i + 0.5) / margin);
            *at = (float)(own * (double)*at + (1 - own) * (double)at[(size_t)length * w->step]);
        }
    return length;
}

bool hfield_tile(struct hfield *hf, double *seam, struct err *e)
{
    if (hf->nx < 32 || hf->ny < 32)
        return err_set(e, ERR_DATA, "%d x %d nodes are too few for a tile: needs 32 x 32", hf->nx,
                       hf->ny);
    if (hfield_missing(hf))
        return err_set(e, ERR_DATA, "%ld heights are missing: fill them first", hfield_missing(hf));
    const double mean = mean_of(hf);
    double square = 0, off_x, off_y;
    for (int k = 0; k < hf->nx * hf->ny; k++)
        square += pow((double)hf->z[k] - mean, 2);
    square /= (double)hf->nx * hf->ny;
    const size_t row = (size_t)hf->nx;
    const int nx = close_way(hf->z, &(struct way){hf->nx, hf->ny, 1, row}, &off_x),
              ny = close_way(hf->z, &(struct way){hf->ny, nx, row, 1}, &off_y);
    for (int j = 0; j < ny; j++)
        for (int i = 0; i < nx; i++)
            hf->z[(size_t)j * (size_t)nx + (size_t)i] = hf->z[(size_t)j * row + (size_t)i];
    hf->nx = nx;
    hf->ny = ny;
    *seam = square > 0 ? sqrt(fmax(off_x, off_y) / square) : 0;
    return true;
}

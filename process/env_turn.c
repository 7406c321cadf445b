// env_turn.c - where each pixel of a row looks, in one go; then Catmull-Rom (environment.h).
#define _GNU_SOURCE
#include "process/env_turn.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

// atan2 without branches or calls, for loops that the compiler turns into vectors: the series on
// |t| < tan(pi / 8), off by less than 2e-8.
static inline double arc(double y, double x)
{
    const double a = fabs(x), b = fabs(y), most = a > b ? a : b, least = a > b ? b : a;
    const bool high = least > .41421356237309503 * most;
    const double t = (high ? least - most : least) / (high ? least + most : most + 1e-300);
    const double s = t * t;
    double sum =
        t * (1 + s * (-1. / 3 +
                      s * (1. / 5 +
                           s * (-1. / 7 +
                                s * (1. / 9 + s * (-1. / 11 + s * (1. / 13 + s * (-1. / 15))))))));
    sum = high ? M_PI / 4 + sum : sum;
    sum = b > a ? M_PI / 2 - sum : sum;
    sum = x < 0 ? M_PI - sum : sum;
    return y < 0 ? -sum : sum;
}

// Columns and rows (pixel centres at whole numbers) of n directions on a circle of latitude.
__attribute__((target_clones("avx512f", "avx2", "default"))) static void
row_places(const struct frame *to, double y, double s, const double *sine, const double *cosine,
           int n, const struct image *im, double *col, double *row)
{
    const double per_turn = im->w / (2 * M_PI), per_half = im->h / M_PI;
    for (int i = 0; i < n; i++) {
        const double dx = s * sine[i], dz = -s * cosine[i];
        const double tx = to->t.x * dx + to->b.x * y + to->n.x * dz;
        const double ty = to->t.y * dx + to->b.y * y + to->n.y * dz;
        const double tz = to->t.z * dx + to->b.z * y + to->n.z * dz;
        row[i] = arc(sqrt(tx * tx + tz * tz), ty) * per_half - .5;
        col[i] = (arc(tx, -tz) + M_PI) * per_turn - .5;
    }
}

static void catmull_rom(float x, float w[4])
{
    w[0] = x * (-.5f + x * (1 - .5f * x));
    w[1] = 1 + x * x * (-2.5f + 1.5f * x);
    w[2] = x * (.5f + x * (2 - 1.5f * x));
    w[3] = x * x * (-.5f + .5f * x);
}

// Away from the map's ends, where four neighbours of a row are a run.
static void inside(const struct image *im, int i, int j, float fx, float fy, float *out)
{
    const size_t line = (size_t)im->w * 3;
    const float *px = im->px + (size_t)(j - 1) * line + 3 * (size_t)(i - 1);
    float wx[4], wy[4], mid[12];
    catmull_rom(fx, wx);
    catmull_rom(fy, wy);
    for (int k = 0; k < 12; k++)
        mid[k] = wy[0] * px[k] + wy[1] * px[(size_t)k + line] + wy[2] * px[(size_t)k + 2 * line] +
                 wy[3] * px[(size_t)k + 3 * line];
    for (int c = 0; c < 3; c++) {
        const float sum =
            wx[0] * mid[c] + wx[1] * mid[c + 3] + wx[2] * mid[c + 6] + wx[3] * mid[c + 9];
        out[c] = sum > 0 ? sum : 0;
    }
}

static void turn_row(const struct environment *env, const struct frame *to, int j,
                     const double *sine, const double *cosine, double *places, struct image *out)
{
    const double th = M_PI * (j + .5) / out->h, y = cos(th), s = sin(th);
    const struct image *im = &env->map;
    double *col = places, *row = places + out->w;
    row_places(to, y, s, sine, cosine, out->w, im, col, row);
    for (int i = 0; i < out->w; i++) {
        float *px = out->px + ((size_t)j * (size_t)out->w + (size_t)i) * 3;
        const int x = (int)floor(col[i]), k = (int)floor(row[i]);
        if (x >= 1 && x + 2 < im->w && k >= 1 && k + 2 < im->h) {
            inside(im, x, k, (float)(col[i] - x), (float)(row[i] - k), px);
            continue;
        }
        const struct vec3 d = v3(s * sine[i], y, -s * cosine[i]);
        double rgb[3];
        environment_radiance(env, frame_world(to, d), rgb);
        for (int c = 0; c < 3; c++)
            px[c] = (float)rgb[c];
    }
}

void env_turn(const struct environment *env, const struct frame *turn, bool back, struct image *out)
{
    const struct frame *f = turn;
    const struct frame to =
        back ? (struct frame){v3(f->t.x, f->b.x, f->n.x), v3(f->t.y, f->b.y, f->n.y),
                              v3(f->t.z, f->b.z, f->n.z)}
             : *f;
    const size_t w = (size_t)out->w;
    double *sine = xcalloc(2 * w, sizeof *sine), *cosine = sine + w;
    for (int i = 0; i < out->w; i++) {
        const double ph = 2 * M_PI * (i + .5) / out->w - M_PI;
        sine[i] = sin(ph);
        cosine[i] = cos(ph);
    }
#pragma omp parallel
    {
        double *places = xcalloc(2 * w, sizeof *places);
#pragma omp for schedule(static)
        for (int j = 0; j < out->h; j++)
            turn_row(env, &to, j, sine, cosine, places, out);
        free(places);
    }
    free(sine);
}

// mosaic.c - a merged mosaic, spread to three channels.
#include "process/mosaic.h"
#include <math.h>
#include <string.h>

static bool is_site(const char *cell, int i, int j, char letter)
{
    return cell[j % 2 * 2 + i % 2] == letter;
}

static const float *at(const struct image *im, int i, int j)
{
    return im->px + ((size_t)j * (size_t)im->w + (size_t)i) * (size_t)im->nc;
}

// Value and variance of one channel at a place; false when no own site near by was measured. Sites
// at distance 1 first (all that a 2 x 2 cell needs), then 2.
static bool spread(const struct image *m, const char *cell, char letter, int i, int j, float v[2])
{
    for (int reach = is_site(cell, i, j, letter) ? 0 : 1; reach <= 2; reach++) {
        double sum = 0, variance = 0, weights = 0;
        for (int y = j - reach; y <= j + reach; y++)
            for (int x = i - reach; x <= i + reach; x++) {
                if (x < 0 || y < 0 || x >= m->w || y >= m->h || !is_site(cell, x, y, letter) ||
                    !(at(m, x, y)[2] > 0))
                    continue;
                const double w = 1.0 / (1 + (x - i) * (x - i) + (y - j) * (y - j));
                sum += w * (double)at(m, x, y)[0];
                variance += w * (double)at(m, x, y)[1];
                weights += w;
            }
        if (weights > 0) {
            v[0] = (float)(sum / weights);
            v[1] = (float)(variance / weights); // of one site: neighbours share theirs
            return true;
        }
    }
    v[0] = at(m, i, j)[0]; // the bound that is known there
    v[1] = v[0] * v[0];
    return false;
}

bool mosaic_spread(const struct image *m, const char *cell, struct image *out, struct err *e)
{
    static const char letters[] = "RGB";
    if (strlen(cell) != 4 || strspn(cell, letters) != 4)
        return err_set(e, ERR_DATA, "a mosaic of '%s': must be R, G and B in a 2 x 2 cell", cell);
    struct image im;
    if (!image_init(&im, m->w, m->h, 7, e))
        return false;
#pragma omp parallel for schedule(static)
    for (int j = 0; j < im.h; j++)
        for (int i = 0; i < im.w; i++) {
            float *p = im.px + ((size_t)j * (size_t)im.w + (size_t)i) * 7, v[2];
            p[6] = 1;
            for (int c = 0; c < 3; c++) {
                if (!spread(m, cell, letters[c], i, j, v))
                    p[6] = 0;
                p[c] = v[0];
                p[3 + c] = v[1];
            }
        }
    meta_copy(&im.meta, &m->meta);
    meta_set_text(&im.meta, "channels", "R,G,B,var.R,var.G,var.B,mask");
    *out = im;
    return true;
}

void mosaic_fill_hot(struct image *m, const unsigned char *hot)
{
    const int step = m->nc, nc = step / 2;
    for (int j = 0; j < m->h; j++)
        for (int i = 0; i < m->w; i++) {
            float *p = m->px + ((size_t)j * (size_t)m->w + (size_t)i) * (size_t)step;
            if (!hot[(size_t)j * (size_t)m->w + (size_t)i])
                continue;
            for (int c = 0; c < nc; c++) {
                static const int near[4][2] = {{-2, 0}, {2, 0}, {0, -2}, {0, 2}};
                double sum = 0;
                int n = 0;
                for (int k = 0; k < 4; k++) {
                    const int x = i + near[k][0], y = j + near[k][1];
                    if (x < 0 || y < 0 || x >= m->w || y >= m->h ||
                        hot[(size_t)y * (size_t)m->w + (size_t)x])
                        continue;
                    sum += (double)at(m, x, y)[c];
                    n++;
                }
                p[c] = n ? (float)(sum / n) : 0;
                p[nc + c] = p[c] * p[c];
            }
            p[step - 1] = 0;
        }
}

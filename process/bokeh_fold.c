// bokeh_fold.c - lines and lattices of a bokeh's disc.
#define _GNU_SOURCE // M_PI
#include "process/bokeh_fold.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>

// Variance that lines, or a lattice, may leave to be taken for all there is: what Richardson-Lucy
// would lose.
static const double MOST_BESIDE_LINES = 0.05, MOST_BESIDE_CELL = 0.01;

bool fold_lines(struct fold *fold, const struct flat *f, double sigma_px, bool always)
{
    struct err none;
    if (!lines_find(&fold->lines, &f->disc, f->px, f->w, f->h, sigma_px, &none) ||
        !(always || fold->lines.unexplained < MOST_BESIDE_LINES))
        return false;
    fold->kind = FOLD_LINES;
    return true;
}

// Folds over the lattice. Light and pattern are told apart in turns: each hides some of the other
// where few cells fill the disc.
static bool find_cell(struct cell *c, struct flat *f, double sigma_px, struct err *e)
{
    enum { TURNS = 4 };
    struct lattice l;
    struct err none;
    const size_t n = (size_t)f->w * (size_t)f->h;
    float *pattern = sample_alloc(n, sizeof *pattern, "pattern", e);
    bool ok = pattern != NULL;
    for (int turn = 0; ok && turn < TURNS; turn++) {
        if (!lattice_find(&l, &f->disc, f->px, f->w, f->h, &none))
            break; // then what was found before stays
        cell_finish(c);
        ok = cell_fold(c, &l, &f->disc, f->px, f->w, f->h, e);
        if (ok && turn < TURNS - 1) {
            cell_picture(c, f->w, f->h, pattern);
            ok = flat_divide(f, pattern, e);
        }
    }
    free(pattern);
    if (ok && c->mean) {
        ok = cell_sharpen(c, sigma_px, e) && cell_refold(c, &f->disc, f->px, f->w, f->h, e) &&
             cell_sharpen(c, sigma_px, e);
        if (ok)
            cell_judge(c, &f->disc, f->px, f->w, f->h);
    }
    return ok;
}

bool fold_lattice(struct fold *fold, struct flat *f, double sigma_px, struct err *e)
{
    if (!find_cell(&fold->cell, f, sigma_px, e))
        return false;
    if (!fold->cell.mean)
        return true;
    if (fold->cell.unexplained >= MOST_BESIDE_CELL)
        return flat_divide(f, NULL, e);
    fold->kind = FOLD_LATTICE;
    return true;
}

void fold_finish(struct fold *fold)
{
    cell_finish(&fold->cell);
}

double fold_at(const struct fold *fold, double i, double j)
{
    return fold->kind == FOLD_LINES ? lines_at(&fold->lines, i, j)
                                    : cell_at(&fold->cell, fold->cell.sharp, i, j);
}

void fold_snap(const struct fold *fold, double turn_rad, double m_per_px, struct period *p)
{
    // (x, y) of the sample lies at (c x + s y, c y - s x) of the picture, and so do wave vectors
    const double c = cos(turn_rad), s = sin(turn_rad), k = m_per_px / p->period_m,
                 x = k * cos(p->direction_rad), y = k * sin(p->direction_rad), i = c * x + s * y,
                 j = c * y - s * x;
    double ki, kj;
    if (fold->kind == FOLD_LINES) {
        const struct lines *l = &fold->lines;
        const double times = round((i * l->kx + j * l->ky) / (l->kx * l->kx + l->ky * l->ky));
        ki = times * l->kx;
        kj = times * l->ky;
    } else {
        lattice_nearest(&fold->cell.lattice, i, j, &ki, &kj);
    }
    if (hypot(ki - i, kj - j) > 0.05 * hypot(i, j))
        return; // nothing of the fold's
    const double kx = c * ki - s * kj, ky = s * ki + c * kj, angle = atan2(ky, kx);
    p->period_m = m_per_px / hypot(kx, ky);
    p->direction_rad = angle - M_PI * (ceil(angle / M_PI + 0.5) - 1); // in (-pi/2, pi/2]
}

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

// The length over half of n that fits both components of wave vectors best: relative to their
// sizes.
static int best_length(const double k[2], const double size[2], int n, double *strain)
{
    int best = n;
    *strain = INFINITY;
    for (int at = n; at > n / 2; at--) {
        double here = 0;
        for (int m = 0; m < 2; m++)
            here = fmax(here, fabs(k[m] - round(k[m] * at) / at) / size[m]);
        if (here < *strain) {
            *strain = here;
            best = at;
        }
    }
    return best;
}

static double fit(struct fold *fold, double turn_rad, int *nx, int *ny)
{
    struct lines *l = &fold->lines;
    struct lattice *grid = &fold->cell.lattice;
    const bool lines = fold->kind == FOLD_LINES;
    double *const ki[] = {lines ? &l->kx : &grid->kx[0], lines ? &l->kx : &grid->kx[1]},
                  *const kj[] = {lines ? &l->ky : &grid->ky[0], lines ? &l->ky : &grid->ky[1]};
    const double c = cos(turn_rad), s = sin(turn_rad);
    double x[2], y[2], size[2], along_x, along_y;
    for (int m = 0; m < 2; m++) { // on the sample
        x[m] = c * *ki[m] - s * *kj[m];
        y[m] = s * *ki[m] + c * *kj[m];
        size[m] = hypot(x[m], y[m]);
    }
    *nx = best_length(x, size, *nx, &along_x);
    *ny = best_length(y, size, *ny, &along_y);
    for (int m = 0; m < 2; m++) {
        x[m] = round(x[m] * *nx) / *nx;
        y[m] = round(y[m] * *ny) / *ny;
        *ki[m] = c * x[m] + s * y[m];
        *kj[m] = c * y[m] - s * x[m];
    }
    return hypot(along_x, along_y);
}

// Direction on the sample of the cell's side that is nearest to x, in (-pi/4, pi/4].
static double side_direction(const struct lattice *l, double turn_rad)
{
    double best = INFINITY;
    for (int m = 0; m < 2; m++) {
        const double angle = remainder(atan2(l->ay[m], l->ax[m]) + turn_rad, M_PI);
        best = fabs(angle) < fabs(best) ? angle : best;
    }
    return best;
}

double fold_fit(struct fold *fold, double turn_rad, int *nx, int *ny, double *turned)
{
    const double most = 0.01;
    const struct fold before = *fold;
    const int nx0 = *nx, ny0 = *ny;
    double strain = fit(fold, turn_rad, nx, ny);
    *turned = 0;
    if (strain > most) {
        *fold = before;
        *nx = nx0;
        *ny = ny0;
        if (fold->kind == FOLD_LATTICE)
            *turned = side_direction(&fold->cell.lattice, turn_rad);
        else
            *turned = remainder(atan2(fold->lines.ky, fold->lines.kx) + turn_rad, M_PI / 2);
        strain = fit(fold, turn_rad - *turned, nx, ny);
    }
    return strain;
}

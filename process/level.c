// level.c - polynomials through height fields, and medians of rows.
#include "process/level.h"
#include "calib/normal.h"
#include "core/mem.h"
#include "core/sort.h"
#include <math.h>
#include <stdlib.h>

static const int terms_of_degree[] = {1, 3, 6};

static void monomials(const struct form *f, double i, double j, double m[6])
{
    const double x = 2 * i / (f->nx - 1) - 1, y = 2 * j / (f->ny - 1) - 1;
    m[0] = 1;
    m[1] = x;
    m[2] = y;
    m[3] = x * x;
    m[4] = x * y;
    m[5] = y * y;
}

bool form_fit(struct form *out, const struct hfield *hf, int degree, struct err *e)
{
    struct form f = {.nx = hf->nx, .ny = hf->ny};
    static const int at[6] = {0, 1, 2, 3, 4, 5};
    const int n = terms_of_degree[degree];
    struct normal s;
    double m[6];
    normal_init(&s, n);
    for (int j = 0; j < hf->ny; j++)
        for (int i = 0; i < hf->nx; i++) {
            const float z = hf->z[(size_t)j * (size_t)hf->nx + (size_t)i];
            if (isnan(z))
                continue;
            monomials(&f, i, j, m);
            normal_add(&s, n, at, m, (double)z, 1);
        }
    const long count = s.count;
    const bool ok = count >= n && normal_solve(&s, f.term, NULL, e);
    normal_finish(&s);
    if (!ok)
        return err_set(e, ERR_DATA, "%ld measured nodes do not determine a form of %d terms", count,
                       n);
    *out = f;
    return true;
}

double form_at(const struct form *f, double i, double j)
{
    double m[6], z = 0;
    monomials(f, i, j, m);
    for (int k = 0; k < 6; k++)
        z += f->term[k] * m[k];
    return z;
}

static void level_rows(struct hfield *hf)
{
    float *sorted = xcalloc((size_t)hf->nx, sizeof *sorted);
    for (int j = 0; j < hf->ny; j++) {
        float *z = hf->z + (size_t)j * (size_t)hf->nx;
        size_t n = 0;
        for (int i = 0; i < hf->nx; i++)
            if (!isnan(z[i]))
                sorted[n++] = z[i];
        sort_floats(sorted, n);
        const float median = n ? 0.5f * (sorted[(n - 1) / 2] + sorted[n / 2]) : 0;
        for (int i = 0; i < hf->nx; i++)
            z[i] -= median;
    }
    free(sorted);
}

bool hfield_level(struct hfield *hf, enum level how, struct err *e)
{
    struct form f;
    if (how == LEVEL_ROWS) {
        level_rows(hf);
        return true;
    }
    if (!form_fit(&f, hf, how == LEVEL_MEAN ? 0 : how == LEVEL_PLANE ? 1 : 2, e))
        return false;
    for (int j = 0; j < hf->ny; j++)
        for (int i = 0; i < hf->nx; i++) {
            float *z = hf->z + (size_t)j * (size_t)hf->nx + (size_t)i;
            *z = (float)((double)*z - form_at(&f, i, j));
        }
    return true;
}

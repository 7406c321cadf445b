// at_w.c - |S|^2 at many w at once, from the transforms of the Chebyshev polynomials.
//
// S = sum a_k(z) i^k M_k with z = 2 pi (w / lambda) half. With E the sum over even k and O over odd
// k (the signs of i^k put into a_k), S(u, v) = E + i O and conj S(-u, -v) = E - i O: two points for
// one sum.
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/bessel.h"
#include "process/diffraction.h"
#include <math.h>
#include <stdlib.h>

enum { LANES = 16 }; // w samples done together

struct at_w {
    struct diffraction_use base;
    int nw, stride, evens;
    float *coef; // [wavelengths][count][stride] a_k, even k first
};

int at_w_stride(int nw)
{
    return (nw + LANES - 1) / LANES * LANES;
}

// exp(i z x) to 1e-7 with |x| <= 1: J_k(z) falls faster than geometrically once k > z.
static int polynomials_for(double z)
{
    int k = 1;
    while (k < z || fabs(jn(k, z)) > 2e-8)
        k++;
    return k;
}

// GCC's and clang's vectors: sixteen lanes whatever the machine has, the same bytes everywhere.
typedef float lanes __attribute__((vector_size(LANES * sizeof(float))));

__attribute__((target_clones("avx512f", "avx2", "default"))) static void
add(const struct diffraction_use *use, int l, int nv, const float *moment, const float *weight,
    void *plus, void *minus)
{
    const struct at_w *a = (const struct at_w *)use;
    const int tiles = a->stride / LANES, count = use->count, evens = a->evens;
    const lanes *coef = (const lanes *)a->coef + (size_t)l * (size_t)(count * tiles);
    lanes *to = plus, *back = minus;
    for (int j = 0; j < nv; j++, to += 3 * tiles, back += 3 * tiles) {
        const float *re = moment + (size_t)j * 2 * (size_t)count, *im = re + count;
        const float *xyz = weight + 3 * (size_t)j;
        for (int t = 0; t < tiles; t++) {
            lanes e_re = {0}, e_im = {0}, o_re = {0}, o_im = {0};
            for (int k = 0; k < evens; k++) {
                e_re += coef[k * tiles + t] * re[k];
                e_im += coef[k * tiles + t] * im[k];
            }
            for (int k = evens; k < count; k++) {
                o_re += coef[k * tiles + t] * re[k];
                o_im += coef[k * tiles + t] * im[k];
            }
            const lanes a_re = e_re - o_im, a_im = e_im + o_re;
            const lanes b_re = e_re + o_im, b_im = e_im - o_re;
            const lanes power = a_re * a_re + a_im * a_im, other = b_re * b_re + b_im * b_im;
            for (int c = 0; c < 3; c++) {
                to[c * tiles + t] += xyz[c] * power;
                back[c * tiles + t] += xyz[c] * other;
            }
        }
    }
}

struct diffraction_use *at_w_new(const struct patch *p, const struct spectral *light,
                                 const double *w, int nw, struct err *e)
{
    double w_max = 0;
    for (int k = 0; k < nw; k++)
        w_max = fmax(w_max, w[k]);
    const double z_per_q = 2 * 3.14159265358979323846 * p->half_m;
    const int count = polynomials_for(z_per_q * w_max / light->lambda_m[0]);
    struct at_w *a = xcalloc(1, sizeof *a);
    a->base = (struct diffraction_use){.count = count, .add = add};
    a->nw = nw;
    a->stride = at_w_stride(nw);
    a->evens = (count + 1) / 2;
    a->base.cell = 3 * (size_t)a->stride * sizeof(float);
    const size_t stride = (size_t)a->stride;
    a->coef = sample_alloc((size_t)light->n * (size_t)count * stride, sizeof *a->coef,
                           "weights of the transforms", e);
    if (!a->coef) {
        free(a);
        return NULL;
    }
    double *j = xcalloc((size_t)count, sizeof *j);
    for (size_t l = 0; l < (size_t)light->n; l++)
        for (int m = 0; m < nw; m++) {
            bessel_j(z_per_q * w[m] / light->lambda_m[l], count, j);
            for (int k = 0; k < count; k++) {
                const int slot = k % 2 ? a->evens + k / 2 : k / 2;
                a->coef[(l * (size_t)count + (size_t)slot) * stride + (size_t)m] =
                    (float)((k ? 2 : 1) * (k / 2 % 2 ? -j[k] : j[k]));
            }
        }
    free(j);
    return &a->base;
}

void at_w_free(struct diffraction_use *use)
{
    if (!use)
        return;
    free(((struct at_w *)use)->coef);
    free(use);
}

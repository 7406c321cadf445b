// cell_sharpen.c - a folded cell freed of blur: least total variation by ADMM.
#define _GNU_SOURCE // M_PI
#include "core/mem.h"
#include "process/cell.h"
#include "process/fft.h"
#include <complex.h>
#include <math.h>
#include <stdlib.h>

enum { ROUNDS = 100 };
// A sharpened step is about 0.7 px wide (as measured on simulated phones): a box of this width more
// makes it the mean over a pixel.
static const double BOX_PX = 0.7;

// min over u of sum w (K u - d)^2 / 2 + lambda sum (|D_s u| + |D_t u|), split as v = K u, z = D u
// (ADMM, Boyd et al. 2011, section 3.1). K is blur and pixel, D the differences along the cell's
// sides per px. The cell is periodic: u comes from v and z by transforms.
struct split {
    int ns, nt, half; // half = ns / 2 + 1
    size_t n;
    const double *data;
    double *weight;            // [nt][ns], mean 1
    double *transfer, *box;    // [nt][half] of K, of the box of BOX_PX
    double complex *ds, *dt;   // [half], [nt]: transfer of D
    double complex *sum, *z;   // [nt][half]
    double *u, *v, *v_off;     // [nt][ns]; v_off, off: scaled duals
    double *slope[2], *off[2]; // [nt][ns] D u, then z
    struct fft *forward, *backward;
};

static double sinc(double x)
{
    return fabs(x) < 1e-8 ? 1 : sin(M_PI * x) / (M_PI * x);
}

static void split_finish(struct split *s)
{
    void *const owned[] = {s->weight,   s->transfer, s->box,    s->ds,    s->dt,
                           s->sum,      s->z,        s->u,      s->v,     s->v_off,
                           s->slope[0], s->slope[1], s->off[0], s->off[1]};
    for (size_t k = 0; k < sizeof owned / sizeof *owned; k++)
        free(owned[k]);
    fft_free(s->forward);
    fft_free(s->backward);
}

static void fill_transfer(struct split *s, const struct cell *c, double sigma_px)
{
    const struct lattice *l = &c->lattice;
    for (int q = 0; q < s->nt; q++)
        for (int p = 0; p < s->half; p++) {
            const size_t k = (size_t)q * (size_t)s->half + (size_t)p;
            const int m = q <= s->nt / 2 ? q : q - s->nt;
            const double kx = p * l->kx[0] + m * l->kx[1], ky = p * l->ky[0] + m * l->ky[1];
            s->box[k] = sinc(BOX_PX * kx) * sinc(BOX_PX * ky);
            s->transfer[k] = exp(-2 * M_PI * M_PI * sigma_px * sigma_px * (kx * kx + ky * ky)) *
                             sinc(kx) * sinc(ky) *
                             (c->centred ? 1 : sinc((double)p / s->ns) * sinc((double)m / s->nt));
        }
    for (int p = 0; p < s->half; p++)
        s->ds[p] = (cexp(2 * M_PI * I * p / s->ns) - 1) * s->ns / hypot(l->ax[0], l->ay[0]);
    for (int q = 0; q < s->nt; q++)
        s->dt[q] = (cexp(2 * M_PI * I * q / s->nt) - 1) * s->nt / hypot(l->ax[1], l->ay[1]);
}

static bool split_init(struct split *out, const struct cell *c, double sigma_px, struct err *e)
{
    struct split s = {.ns = c->ns, .nt = c->nt, .half = c->ns / 2 + 1, .data = c->mean};
    const size_t n = s.n = (size_t)s.ns * (size_t)s.nt, m = (size_t)s.half * (size_t)s.nt;
    double **const real[] = {&s.weight,   &s.u,        &s.v,      &s.v_off,
                             &s.slope[0], &s.slope[1], &s.off[0], &s.off[1]};
    bool ok = (s.forward = fft_new(FFT_R2C, FFT_DOUBLE, s.nt, s.ns, 1, false, e)) &&
              (s.backward = fft_new(FFT_C2R, FFT_DOUBLE, s.nt, s.ns, 1, false, e));
    for (size_t k = 0; k < sizeof real / sizeof *real; k++)
        ok = ok && (*real[k] = sample_alloc(n, sizeof(double), "cell", e));
    ok = ok && (s.transfer = sample_alloc(m, sizeof(double), "cell", e)) &&
         (s.box = sample_alloc(m, sizeof(double), "cell", e)) &&
         (s.sum = sample_alloc(m, sizeof *s.sum, "cell", e)) &&
         (s.z = sample_alloc(m, sizeof *s.z, "cell", e));
    if (!ok) {
        split_finish(&s);
        return false;
    }
    s.ds = xcalloc((size_t)s.half, sizeof *s.ds);
    s.dt = xcalloc((size_t)s.nt, sizeof *s.dt);
    fill_transfer(&s, c, sigma_px);
    double all = 0, mean = 0;
    for (size_t k = 0; k < n; k++) {
        all += c->count[k];
        mean += c->count[k] * c->mean[k];
    }
    for (size_t k = 0; k < n; k++) {
        s.weight[k] = c->count[k] * (double)n / all;
        s.u[k] = s.v[k] = mean / all;
    }
    *out = s;
    return true;
}

// out = transform back of what stands in s->z.
static void back(const struct split *s, double *out)
{
    for (size_t k = 0; k < (size_t)s->half * (size_t)s->nt; k++)
        s->z[k] /= (double)s->n;
    fft_run(s->backward, s->z, out);
}

// One round at the weights rho_v and rho of both splits; s->v becomes K u.
static void round_of(struct split *s, double lambda, double rho_v, double rho)
{
    double *const work = s->u;
    for (size_t k = 0; k < s->n; k++) { // v from K u, which stands in v
        const double blurred = s->v[k];
        const double v =
            (s->weight[k] * s->data[k] + rho_v * (blurred + s->v_off[k])) / (s->weight[k] + rho_v);
        s->v_off[k] += blurred - v;
        work[k] = v - s->v_off[k];
    }
    fft_run(s->forward, work, s->sum);
    for (size_t k = 0; k < (size_t)s->half * (size_t)s->nt; k++)
        s->sum[k] *= rho_v * s->transfer[k];
    for (int side = 0; side < 2; side++) { // shrinking
        const double cut = lambda / rho;
        for (size_t k = 0; k < s->n; k++) {
            const double t = s->slope[side][k] + s->off[side][k], z = t > cut    ? t - cut
                                                                      : t < -cut ? t + cut
                                                                                 : 0;
            s->off[side][k] = t - z;
            work[k] = z - s->off[side][k];
        }
        fft_run(s->forward, work, s->z);
        for (int q = 0; q < s->nt; q++)
            for (int p = 0; p < s->half; p++) {
                const size_t k = (size_t)q * (size_t)s->half + (size_t)p;
                s->sum[k] += rho * conj(side ? s->dt[q] : s->ds[p]) * s->z[k];
            }
    }
    for (int q = 0; q < s->nt; q++)
        for (int p = 0; p < s->half; p++) {
            const size_t k = (size_t)q * (size_t)s->half + (size_t)p;
            s->sum[k] /=
                rho_v * s->transfer[k] * s->transfer[k] +
                rho * (creal(s->ds[p] * conj(s->ds[p])) + creal(s->dt[q] * conj(s->dt[q])));
        }
    for (int what = 0; what < 3; what++) {
        for (int q = 0; q < s->nt; q++)
            for (int p = 0; p < s->half; p++) {
                const size_t k = (size_t)q * (size_t)s->half + (size_t)p;
                s->z[k] = s->sum[k] * (what == 0   ? s->transfer[k]
                                       : what == 1 ? s->ds[p]
                                                   : s->dt[q]);
            }
        back(s, what == 0 ? s->v : s->slope[what - 1]);
    }
}

bool cell_sharpen(struct cell *c, double sigma_px, struct err *e)
{
    struct split s;
    if (!split_init(&s, c, sigma_px, e))
        return false;
    double square = 0, mean = s.u[0], bins = 0;
    for (size_t k = 0; k < s.n; k++) {
        square += s.weight[k] * (c->mean[k] - mean) * (c->mean[k] - mean);
        bins += c->count[k] > 0;
    }
    const double contrast = sqrt(square / (double)s.n);
    // From a strong prior to a weak one, until the mean is explained to its
    // noise.
    double last = 0;
    for (double part = 3e-2; part > 5e-5; part /= 3) {
        const double lambda = part * contrast,
                     rho = 30 * lambda; // steps settle at 1/30 of a slope
        for (int side = 0; side < 2; side++)
            for (size_t k = 0; k < s.n; k++)
                s.off[side][k] *= last > 0 ? last / rho : 0;
        last = rho;
        for (int r = 0; r < ROUNDS; r++)
            round_of(&s, lambda, 1, rho);
        double chi2 = 0;
        for (size_t k = 0; k < s.n; k++)
            chi2 += c->count[k] * (s.v[k] - c->mean[k]) * (s.v[k] - c->mean[k]);
        if (chi2 < 1.01 * bins * c->noise * c->noise)
            break;
    }
    for (size_t k = 0; k < s.n; k++)
        c->blurred[k] = s.v[k];
    for (size_t k = 0; k < (size_t)s.half * (size_t)s.nt; k++)
        s.z[k] = s.sum[k] * s.box[k];
    back(&s, c->sharp);
    split_finish(&s);
    return true;
}

// farfield.c - orders and their lobes, summed.
//
// Mean over the places of a Gaussian window g: the product of two periodic factors exp(2 pi i k_mn
// x) averages to zero unless the orders are the same, so orders add as powers, and each has the
// lobe |g^|^2. Normal roughness of rms s multiplies the window's autocorrelation exp(-r^2 / 4
// sigma^2) by exp(-g (1 - exp(-r^2 / l^2))), g = (2 pi q s)^2; expanded in powers of g every term
// is a Gaussian (P. Beckmann, "The scattering of electromagnetic waves from rough surfaces", 1963,
// ch. 5).
#define _GNU_SOURCE
#include "sim/farfield.h"
#include "core/mem.h"
#include <assert.h>
#include <math.h>
#include <stdlib.h>

enum { REACH = 1024, MAX_NODES = 400 };
static const double DROP = 30; // exp(-30) of a lobe's top is left out

// The lobes of one order: weight[k] * (1 / integral) exp(-f^2 / width2[k]), f in 1/m.
struct lobes {
    int n;
    double weight[256], width2[256];
};

static void lobes_at(const struct sample *s, double q, struct lobes *l)
{
    const double sigma = s->coherence_m / 4, window = 1 / (4 * sigma * sigma);
    const double g = pow(2 * M_PI * q * s->rough_rms_m, 2);
    double strength = exp(-g);
    l->n = 0;
    for (int k = 0; k < 256; k++) {
        const double b = window + (k ? k / (s->rough_length_m * s->rough_length_m) : 0);
        l->weight[l->n] = strength * M_PI / b;
        l->width2[l->n++] = b / (M_PI * M_PI);
        strength *= g / (k + 1);
        if (k >= g && strength < 1e-13)
            break;
    }
}

static double reach(const struct sample *s, double q)
{
    struct lobes l;
    lobes_at(s, q, &l);
    return sqrt(DROP * l.width2[l.n - 1]);
}

// Frequencies (f_x, f_y) along the lattice, which is turned against the sample's frame.
static void to_lattice(const struct sample *s, double u, double v, double lambda_m, double f[2])
{
    const double c = cos(s->turn_rad), i = sin(s->turn_rad);
    f[0] = (c * u + i * v) / lambda_m;
    f[1] = (c * v - i * u) / lambda_m;
}

double farfield_ref(const struct sample *s, double u, double v, double w, double lambda_m)
{
    const double q = w / lambda_m, far = reach(s, q);
    const double pitch[2] = {s->period_x_m, isinf(s->period_y_m) ? 0 : s->period_y_m};
    struct lobes l;
    double f[2], sum = 0;
    lobes_at(s, q, &l);
    to_lattice(s, u, v, lambda_m, f);
    const int m0 = (int)ceil((f[0] - far) * pitch[0]), m1 = (int)floor((f[0] + far) * pitch[0]);
    const int n0 = (int)ceil((f[1] - far) * pitch[1]), n1 = (int)floor((f[1] + far) * pitch[1]);
    for (int n = pitch[1] > 0 ? n0 : 0; n <= (pitch[1] > 0 ? n1 : 0); n++)
        for (int m = m0; m <= m1; m++) {
            const double complex c = sample_order(s, m, n, q);
            const double dx = f[0] - m / pitch[0], dy = f[1] - (pitch[1] > 0 ? n / pitch[1] : 0);
            double lobe = 0;
            for (int k = 0; k < l.n; k++)
                lobe += l.weight[k] * exp(-(dx * dx + dy * dy) / l.width2[k]);
            sum += (creal(c) * creal(c) + cimag(c) * cimag(c)) * lobe;
        }
    return sum / (lambda_m * lambda_m);
}

void farfield_finish(struct farfield *p)
{
    if (!p)
        return;
    free(p->node);
    free(p->power);
    *p = (struct farfield){0};
}

static bool tabulate(struct farfield *p, struct err *e)
{
    const size_t n_m = (size_t)(2 * p->m_max + 1), n_n = (size_t)(2 * p->n_max + 1);
    double complex *c = sample_alloc(n_m * n_n, sizeof *c, "orders", e);
    p->power = c ? sample_alloc(n_m * n_n * (size_t)p->n_q, sizeof *p->power, "orders", e) : NULL;
    for (int k = 0; p->power && k < p->n_q; k++) {
        sample_orders(p->sample, p->q_mid + p->q_half * p->node[k], p->m_max, p->n_max, c);
        for (size_t a = 0; a < n_m * n_n; a++)
            p->power[a * (size_t)p->n_q + (size_t)k] =
                creal(c[a]) * creal(c[a]) + cimag(c[a]) * cimag(c[a]);
    }
    free(c);
    return p->power != NULL;
}

bool farfield_init(struct farfield *p, const struct sample *s, const struct farfield_range *r,
                   struct err *e)
{
    const double q0 = r->w_min / r->lambda_max_m, q1 = r->w_max / r->lambda_min_m;
    const double far = r->h_max / r->lambda_min_m + reach(s, q1);
    double low_m, high_m;
    sample_height_range(s, &low_m, &high_m);
    const double span = high_m - low_m;
    struct farfield got = {.sample = s, .q_mid = 0.5 * (q0 + q1), .q_half = 0.5 * (q1 - q0)};
    if (far * s->period_x_m > REACH || (!isinf(s->period_y_m) && far * s->period_y_m > REACH))
        return err_set(e, ERR_DATA, "more than %d orders: the period is too long for these angles",
                       REACH);
    got.m_max = (int)ceil(far * s->period_x_m);
    got.n_max = isinf(s->period_y_m) ? 0 : (int)ceil(far * s->period_y_m);
    // exp(2 pi i q h) over q: its Chebyshev coefficients are Bessel functions of this argument and
    // fall faster than any power past it.
    const double argument = 2 * M_PI * span * got.q_half;
    if (argument > MAX_NODES - 40)
        return err_set(e, ERR_DATA, "heights span %g m: too much for this range of wavelengths",
                       span);
    got.n_q = span > 0 ? (int)ceil(argument + 4 * cbrt(argument)) + 12 : 1;
    got.node = xcalloc(2 * (size_t)got.n_q, sizeof *got.node);
    got.weight = got.node + got.n_q;
    for (int k = 0; k < got.n_q; k++) {
        const double angle = M_PI * (k + 0.5) / got.n_q;
        got.node[k] = cos(angle);
        got.weight[k] = (k % 2 ? -1 : 1) * sin(angle);
    }
    if (!tabulate(&got, e)) {
        farfield_finish(&got);
        return false;
    }
    *p = got;
    return true;
}

// Barycentric weights of the polynomial through the nodes (Berrut and Trefethen 2004, eq. 4.2).
static void weights_at(const struct farfield *p, double q, double *out)
{
    const double x = p->n_q > 1 ? (q - p->q_mid) / p->q_half : 0;
    double sum = 0;
    for (int k = 0; k < p->n_q; k++) {
        const double d = x - p->node[k];
        if (fabs(d) < 1e-15) {
            for (int j = 0; j < p->n_q; j++)
                out[j] = j == k;
            return;
        }
        sum += out[k] = p->weight[k] / d;
    }
    for (int k = 0; k < p->n_q; k++)
        out[k] /= sum;
}

// Gaussians of the orders first..last along one axis; false when none is near.
static bool gaussians(double f, double period_m, int most, double width2, int *first, int *last,
                      double *out)
{
    if (isinf(period_m)) {
        *first = *last = 0;
        out[0] = exp(-f * f / width2);
        return f * f < DROP * width2;
    }
    const double far = sqrt(DROP * width2);
    const int a = (int)ceil((f - far) * period_m), b = (int)floor((f + far) * period_m);
    *first = a < -most ? -most : a;
    *last = b > most ? most : b;
    for (int m = *first; m <= *last; m++) {
        const double d = f - m / period_m;
        out[m - *first] = exp(-d * d / width2);
    }
    return *first <= *last;
}

static double order_at(const struct farfield *f, int m, int n, const double *at_q)
{
    const size_t row = (size_t)(2 * f->m_max + 1);
    const double *power =
        f->power + ((size_t)(n + f->n_max) * row + (size_t)(m + f->m_max)) * (size_t)f->n_q;
    double sum = 0;
    for (int j = 0; j < f->n_q; j++)
        sum += at_q[j] * power[j];
    return sum;
}

double farfield_order(const struct farfield *f, int m, int n, double q)
{
    double at_q[MAX_NODES];
    weights_at(f, q, at_q);
    return order_at(f, m, n, at_q);
}

// |c|^2 of the orders near (f_x, f_y), summed once for all lobes; none when there are too many.
enum { KEPT = 256 };
struct near {
    int m0, m1, n0, n1; // within reach of the widest lobe
    bool kept;
    double power[KEPT]; // [n1 - n0 + 1][m1 - m0 + 1]
};

static void near_init(struct near *a, const struct farfield *p, const double *at_q)
{
    const int row = a->m1 - a->m0 + 1;
    a->kept = row * (a->n1 - a->n0 + 1) <= KEPT;
    for (int n = a->n0; a->kept && n <= a->n1; n++)
        for (int m = a->m0; m <= a->m1; m++)
            a->power[(n - a->n0) * row + m - a->m0] = order_at(p, m, n, at_q);
}

double farfield_at(const struct farfield *p, double u, double v, double w, double lambda_m)
{
    const struct sample *s = p->sample;
    const double q = w / lambda_m;
    double f[2], gx[2 * REACH + 1], gy[2 * REACH + 1], at_q[MAX_NODES], sum = 0;
    struct lobes l;
    struct near a;
    to_lattice(s, u, v, lambda_m, f);
    lobes_at(s, q, &l);
    const double widest = l.width2[l.n - 1];
    if (!gaussians(f[0], s->period_x_m, p->m_max, widest, &a.m0, &a.m1, gx) ||
        !gaussians(f[1], s->period_y_m, p->n_max, widest, &a.n0, &a.n1, gy))
        return 0;
    weights_at(p, q, at_q);
    near_init(&a, p, at_q);
    for (int k = 0; k < l.n; k++) {
        int m0, m1, n0, n1;
        if (!gaussians(f[0], s->period_x_m, p->m_max, l.width2[k], &m0, &m1, gx) ||
            !gaussians(f[1], s->period_y_m, p->n_max, l.width2[k], &n0, &n1, gy))
            continue;
        double lobe = 0;
        for (int n = n0; n <= n1; n++) {
            const int at = (n - a.n0) * (a.m1 - a.m0 + 1) - a.m0;
            double row = 0;
            for (int m = m0; m <= m1; m++)
                row += gx[m - m0] * (a.kept ? a.power[at + m] : order_at(p, m, n, at_q));
            lobe += gy[n - n0] * row;
        }
        sum += l.weight[k] * lobe;
    }
    return sum / (lambda_m * lambda_m);
}

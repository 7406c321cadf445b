// env_products.c - the zonal weight as the best sum of so many products f(wi) g(wo).
//
// Z depends on the angle between wi and wo alone, so its singular functions over the hemisphere are
// f_mj(n) cos m phi and f_mj(n) sin m phi, and stay so when only pairs count whose half vector is
// short enough for the table (the disk around it, to keep the symmetry). Then they are no longer
// singular vectors of a matrix; alternating least squares finds the ones that are best on the
// pairs that count, as (1 - n^2)^(m/2) times polynomials in n.
#define _GNU_SOURCE
#include "core/mem.h"
#include "process/env_terms.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FUNCTIONS = 10, COEFS = 8, ORDERS = 5, UNKNOWN = FUNCTIONS * COEFS };
enum { RINGS = 28, ANGLES = 14, ROUNDS = 30 };

// By rising m + 2 j as for spherical harmonics: 1, 3, 4, 6, 8, 9, 11, 12, 14, 16 products.
static const int order_of[FUNCTIONS] = {0, 1, 0, 2, 1, 0, 3, 0, 2, 1};

struct fit {
    int n;                             // functions
    double f[FUNCTIONS][COEFS];        // of wi: coefficients of Chebyshev polynomials in 2 n - 1
    double g[FUNCTIONS][COEFS];        // of wo
    double ring[RINGS][ORDERS][COEFS]; // rho^m T_p(2 n - 1) at n = (k + .5) / RINGS
    double turn[ANGLES][ORDERS];       // cos m (phi_o - phi_i)
};

// How many pairs a sample stands for: none when the table does not reach the half vector.
static bool pair(const struct fresnel *f, double range, int i, int o, double cosine, double *z)
{
    const double a = (i + .5) / RINGS, c = (o + .5) / RINGS;
    const double both = sqrt((1 - a * a) * (1 - c * c)) * cosine; // wi mirrored: 0 is straight on
    *z = zonal_weight(f, a * c - both);
    return 2 - a * a - c * c - 2 * both <= 2 * range * range;
}

static void prepare(struct fit *k)
{
    for (int i = 0; i < RINGS; i++) {
        const double n = (i + .5) / RINGS, rho = sqrt(1 - n * n);
        for (int m = 0; m < ORDERS; m++)
            for (int p = 0; p < COEFS; p++)
                k->ring[i][m][p] = pow(rho, m) * cos(p * acos(2 * n - 1));
    }
    for (int a = 0; a < ANGLES; a++)
        for (int m = 0; m < ORDERS; m++)
            k->turn[a][m] = cos(m * M_PI * (a + .5) / ANGLES);
    for (int q = 0; q < k->n; q++) // rising powers to begin with
        for (int before = q - 1; before >= -1; before--)
            if (before < 0 || order_of[before] == order_of[q]) {
                int j = 0;
                for (int p = 0; p < q; p++)
                    j += order_of[p] == order_of[q];
                k->f[q][j] = 1;
                break;
            }
}

// Solves a x = b by Cholesky; symmetric, positive but for rounding; both are destroyed.
static void solve(int n, double *a, double *b)
{
    double trace = 0;
    for (int i = 0; i < n; i++)
        trace += a[i * n + i];
    for (int i = 0; i < n; i++)
        a[i * n + i] += 1e-12 * trace / n;
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            double sum = a[i * n + j];
            for (int k = 0; k < j; k++)
                sum -= a[i * n + k] * a[j * n + k];
            a[i * n + j] = i == j ? sqrt(fmax(sum, 1e-300)) : sum / a[j * n + j];
        }
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++)
            b[i] -= a[i * n + k] * b[k];
        b[i] /= a[i * n + i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            b[i] -= a[k * n + i] * b[k];
        b[i] /= a[i * n + i];
    }
}

static double at_ring(const struct fit *k, const double coef[COEFS], int ring, int q)
{
    double sum = 0;
    for (int p = 0; p < COEFS; p++)
        sum += coef[p] * k->ring[ring][order_of[q]][p];
    return sum;
}

// Best `to` for given `from`; the two sides may be swapped, for Z is symmetric.
static void fit_side(const struct fit *k, const struct fresnel *fresnel, double range,
                     double (*from)[COEFS], double (*to)[COEFS])
{
    const int n = k->n * COEFS;
    double *a = xcalloc(UNKNOWN * UNKNOWN, sizeof *a), b[UNKNOWN] = {0}, row[UNKNOWN], z;
    for (int i = 0; i < RINGS; i++) {
        double value[FUNCTIONS];
        for (int q = 0; q < k->n; q++)
            value[q] = at_ring(k, from[q], i, q);
        for (int o = 0; o < RINGS; o++)
            for (int t = 0; t < ANGLES; t++) {
                if (!pair(fresnel, range, i, o, k->turn[t][1], &z))
                    continue;
                for (int q = 0; q < k->n; q++)
                    for (int p = 0; p < COEFS; p++)
                        row[q * COEFS + p] =
                            value[q] * k->turn[t][order_of[q]] * k->ring[o][order_of[q]][p];
                for (int x = 0; x < n; x++) {
                    b[x] += row[x] * z;
                    for (int y = 0; y <= x; y++)
                        a[x * n + y] += row[x] * row[y];
                }
            }
    }
    solve(n, a, b);
    memcpy(to, b, (size_t)n * sizeof *b);
    free(a);
}

static void normalise(const struct fit *k, double (*f)[COEFS])
{
    for (int q = 0; q < k->n; q++) {
        double most = 0;
        for (int i = 0; i < RINGS; i++)
            most = fmax(most, fabs(at_ring(k, f[q], i, q)));
        for (int p = 0; p < COEFS && most > 0; p++)
            f[q][p] /= most;
    }
}

// Root mean square over the pairs that count, relative to Z(1).
static double rms(const struct fit *k, const struct fresnel *fresnel, double range)
{
    double sum = 0, n = 0, z;
    for (int i = 0; i < RINGS; i++)
        for (int o = 0; o < RINGS; o++)
            for (int t = 0; t < ANGLES; t++) {
                if (!pair(fresnel, range, i, o, k->turn[t][1], &z))
                    continue;
                for (int q = 0; q < k->n; q++)
                    z -= at_ring(k, k->f[q], i, q) * at_ring(k, k->g[q], o, q) *
                         k->turn[t][order_of[q]];
                sum += z * z;
                n++;
            }
    return sqrt(sum / n) / zonal_weight(fresnel, 1);
}

// f as powers of n, from Chebyshev polynomials in 2 n - 1.
static void powers(const double coef[COEFS], double out[COEFS])
{
    double t[COEFS][COEFS] = {{1}, {-1, 2}};
    for (int p = 2; p < COEFS; p++)
        for (int k = 0; k < COEFS; k++)
            t[p][k] = -2 * t[p - 1][k] + (k ? 4 * t[p - 1][k - 1] : 0) - t[p - 2][k];
    for (int k = 0; k < COEFS; k++) {
        out[k] = 0;
        for (int p = 0; p < COEFS; p++)
            out[k] += coef[p] * t[p][k];
    }
}

// rho^m cos m phi (or sin) times a polynomial in n.
static struct direction_poly harmonic(int m, bool sine, const double coef[COEFS])
{
    struct direction_poly out = {.degree = m + COEFS - 1};
    double n_power[COEFS];
    powers(coef, n_power);
    for (int k = 0; k < COEFS; k++) {
        const struct direction_poly p = direction_poly_power(k);
        double term = n_power[k]; // times (m over s) t^(m-s) (i b)^s
        for (int s = 0; s <= m; term *= (double)(m - s) / (s + 1), s++) {
            if (s % 2 != sine)
                continue;
            const double sign = s / 2 % 2 ? -1 : 1;
            for (int i = 0; i <= p.degree; i++)
                for (int j = 0; i + j <= p.degree; j++) {
                    out.even[i + m - s][j + s] += sign * term * p.even[i][j];
                    out.odd[i + m - s][j + s] += sign * term * p.odd[i][j];
                }
        }
    }
    return out;
}

static void write_terms(struct env_terms *t, const struct fit *k)
{
    t->pre = xcalloc(TERMS_MOST, sizeof *t->pre);
    t->post = xcalloc(TERMS_MOST, sizeof *t->post);
    t->term = xcalloc(TERMS_MOST, sizeof *t->term);
    for (int q = 0; q < k->n; q++)
        for (int sine = 0; sine <= (order_of[q] > 0); sine++, t->n++) {
            const int m = order_of[q];
            t->pre[t->n] = harmonic(m, sine, k->f[q]);
            t->post[t->n] = harmonic(m, sine, k->g[q]);
            t->term[t->n] = (struct env_term){t->n, 0, t->n, m % 2 ? -1 : 1}; // wi was mirrored
        }
    t->n_pre = t->n_post = t->n;
    t->n_kernel = 1;
    zonal_one(&t->zonal);
}

bool env_terms_products(struct env_terms *t, const struct table *table, const struct fresnel *f,
                        int products, struct err *e)
{
    if (table->basis != TABLE_PLAIN)
        return err_set(e, ERR_DATA, "%d tables over w: products need a plain table", table->count);
    if (products < 1 || products > TERMS_MOST)
        return err_set(e, ERR_DATA, "bad number of products %d: must be 1 to %d", products,
                       TERMS_MOST);
    *t = (struct env_terms){0};
    struct fit *k = xcalloc(1, sizeof *k);
    for (int sum = 0; k->n < FUNCTIONS; k->n++) {
        sum += order_of[k->n] ? 2 : 1;
        if (sum > products)
            break;
    }
    prepare(k);
    for (int round = 0; round < ROUNDS; round++) {
        fit_side(k, f, table->range, k->f, k->g);
        if (round == ROUNDS - 1)
            break;
        normalise(k, k->g);
        fit_side(k, f, table->range, k->g, k->f);
        normalise(k, k->f);
    }
    t->error = rms(k, f, table->range);
    write_terms(t, k);
    free(k);
    return true;
}

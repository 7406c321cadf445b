// response_prior.c - smoothness of a tone curve as rows of a least-squares problem.
#include "calib/response_prior.h"
#include <math.h>
#include <stddef.h>

enum { N = RESPONSE_CODES };
static const double CURVATURE = 0.2; // rms of delta'' along s
static const double SAMENESS = 0.1;  // the same for the difference of two channels: a camera gives
                                     // all of them nearly one tone curve

static double logit(int z)
{
    return log((z + 0.5) / (N - 0.5 - z));
}

// d^2/ds^2 of a curve along s = logit(code) at code z, as factors of its values at z-1, z, z+1;
// returns the length of s that it stands for.
static double second_difference(int z, double x[3])
{
    const double before = logit(z) - logit(z - 1), behind = logit(z + 1) - logit(z);
    x[0] = 2 / (before * (before + behind));
    x[2] = 2 / (behind * (before + behind));
    x[1] = -x[0] - x[2];
    return (before + behind) / 2;
}

void response_prior(struct normal *s, int nc)
{
    for (int c = 0; c < nc; c++) {
        const int middle = c * N + RESPONSE_MIDDLE;
        normal_add(s, 1, &middle, (double[]){1}, 0, 1e12); // delta = 0 there: fixes the scale
        for (int z = 1; z < N - 1; z++) {
            double x[6];
            const double length = second_difference(z, x);
            const int k = c * N + z, other = (c ? c - 1 : nc - 1) * N + z;
            const int at[6] = {k - 1, k, k + 1, other - 1, other, other + 1};
            normal_add(s, 3, at, x, 0, length / (CURVATURE * CURVATURE));
            for (int m = 0; m < 3; m++)
                x[3 + m] = -x[m];
            if (nc > 1)
                normal_add(s, 6, at, x, 0, length / (SAMENESS * SAMENESS));
        }
    }
}

bool response_smooth(double log_x[RESPONSE_CODES], const double weight[RESPONSE_CODES],
                     struct err *e)
{
    struct normal s;
    struct response base;
    double delta[N];
    response_srgb(&base, 1);
    normal_init(&s, N);
    for (int z = 0; z < N; z++)
        normal_add(&s, 1, &z, (double[]){1}, log_x[z] - log_x[RESPONSE_MIDDLE] - base.log_x[0][z],
                   weight[z]);
    response_prior(&s, 1);
    const bool ok = normal_solve(&s, delta, NULL, e);
    for (int z = 0; ok && z < N; z++)
        log_x[z] = base.log_x[0][z] + delta[z];
    normal_finish(&s);
    return ok;
}

// bench_env_svd.c - leading singular triplets of a table of 2048 x 2048 nodes: ours, numpy, LAPACK.
#define _GNU_SOURCE
#include "core/log.h"
#include "core/mem.h"
#include "process/factor_lines.h"
#include "process/svd.h"
#include "process/table_cubic.h"
#include "tests/bench/bench_environment.h"
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SIDE = 2048, RANK = 10 };

struct job {
    float *a, *u, *s, *vt; // [SIDE][SIDE], [SIDE][RANK], [RANK], [RANK][SIDE]
    double error;
};

// Green of the table along axes 30 degrees off its own, so that no rank is the last; and grain, as
// measured tables have it.
static bool fill(struct job *j, const struct table *t, struct err *e)
{
    struct aligned al;
    if (!aligned_init(&al, t, (const double[]){M_PI / 6, M_PI / 6 + M_PI / 2}, 0, e))
        return false;
#pragma omp parallel for
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            const double step = 2 * al.t.range / (SIDE - 1);
            double rgb[3];
            table_cubic(&al.t, x * step - al.t.range, y * step - al.t.range, 1, rgb);
            const uint32_t hash = (uint32_t)(y * SIDE + x) * 2654435761u;
            j->a[(size_t)y * SIDE + (size_t)x] =
                (float)(rgb[1] + 1e-5 * ((hash >> 8) / 16777216. - .5));
        }
    aligned_finish(&al);
    return true;
}

static bool leading(void *ctx, struct err *e)
{
    struct job *j = ctx;
    return svd_leading(SIDE, SIDE, j->a, RANK, j->u, j->s, j->vt, NULL, e);
}

// All of LAPACK's singular values and vectors, once: seconds, and the least error of this rank.
static bool lapack(const struct job *j, double *wall_s, double *least, struct err *e)
{
    const size_t n = (size_t)SIDE * SIDE;
    float *a = sample_alloc(n, sizeof *a, "SVD", e), *u = sample_alloc(n, sizeof *u, "SVD", e);
    float *vt = sample_alloc(n, sizeof *vt, "SVD", e), *s = xcalloc(SIDE, sizeof *s);
    bool ok = a && u && vt;
    if (ok) {
        memcpy(a, j->a, n * sizeof *a);
        const double start = now_s();
        ok = svdf(SIDE, SIDE, a, u, s, vt, e);
        *wall_s = now_s() - start;
    }
    double sum = 0;
    for (int k = SIDE - 1; k >= RANK && ok; k--)
        sum += (double)s[k] * (double)s[k];
    *least = sqrt(sum);
    free(a);
    free(u);
    free(vt);
    free(s);
    return ok;
}

// Halko, Martinsson, Tropp 2011 as commonly written: oversampled by 10, two power iterations.
static const char python[] =
    "import time,numpy as np\n"
    "a=np.fromfile('%s',np.float32).reshape(%d,%d);k=%d\n"
    "def f():\n"
    " r=np.random.default_rng(1);q=a@r.standard_normal((a.shape[1],k+10),dtype=np.float32)\n"
    " for _ in range(2):\n"
    "  q=np.linalg.qr(q)[0];q=np.linalg.qr(a.T@q)[0];q=a@q\n"
    " q=np.linalg.qr(q)[0];u,s,v=np.linalg.svd(q.T@a,full_matrices=False)\n"
    " return (q@u[:,:k])*s[:k],v[:k]\n"
    "f();t=[];p=[]\n"
    "for _ in range(9):\n"
    " b=time.perf_counter();c=time.process_time();u,v=f()\n"
    " t.append(time.perf_counter()-b);p.append(time.process_time()-c)\n"
    "print(sorted(t)[4],sorted(p)[4],np.linalg.norm(a-u.astype(float)@v))\n";

static bool numpy(const struct job *j, struct bench_time *t, double *error)
{
    char data[] = "/tmp/nacre-bench-XXXXXX";
    const int fd = mkstemp(data);
    if (fd < 0)
        return false;
    const size_t bytes = (size_t)SIDE * SIDE * sizeof(float);
    bool ok = write(fd, j->a, bytes) == (ssize_t)bytes;
    close(fd);
    char *script = xasprintf(python, data, SIDE, SIDE, RANK);
    char *command = xasprintf("/usr/bin/python3 -c \"%s\" 2>/dev/null", script);
    FILE *p = ok ? popen(command, "r") : NULL;
    ok = p && fscanf(p, "%lf %lf %lf", &t->wall_s, &t->cpu_s, error) == 3;
    if (p)
        pclose(p);
    unlink(data);
    free(script);
    free(command);
    return ok;
}

static bool rows(struct bench_report *r, struct job *j, struct err *e)
{
    static const char kind[] = "over the least of rank 10, less 1";
    struct bench_time ours, peer = {.runs = 9}, all = {.runs = 1};
    double least = 0, error = 0;
    if (!bench_measure(leading, j, &ours, e) || !lapack(j, &all.wall_s, &least, e) ||
        !svd_leading(SIDE, SIDE, j->a, RANK, j->u, j->s, j->vt, &j->error, e))
        return false;
    bench_row(r, "SVD leading", "2048^2, rank 10", ours, j->error / least - 1, kind);
    if (numpy(j, &peer, &error)) {
        bench_row(r, "SVD numpy", "randomised, 2 iterations", peer, error / least - 1, kind);
        bench_figure(r, "numpy's randomised SVD / ours", peer.wall_s / ours.wall_s, "times");
        bench_figure(r, "the same, processor time", peer.cpu_s / ours.cpu_s, "times");
    } else {
        bench_note(r, "numpy is not installed (python3-numpy): no randomised SVD to compare with");
    }
    bench_row(r, "SVD whole", "LAPACK sgesdd, one thread", all, 0, kind);
    bench_figure(r, "LAPACK's whole SVD / ours", all.wall_s / ours.wall_s, "times");
    return true;
}

bool bench_leading(struct bench_report *r, const struct table *t, struct err *e)
{
    struct job j = {.a = sample_alloc((size_t)SIDE * SIDE, sizeof *j.a, "matrix", e),
                    .u = sample_alloc((size_t)SIDE * RANK, sizeof *j.u, "matrix", e),
                    .s = xcalloc(RANK, sizeof *j.s),
                    .vt = sample_alloc((size_t)SIDE * RANK, sizeof *j.vt, "matrix", e)};
    const bool ok = j.a && j.u && j.vt && fill(&j, t, e) && rows(r, &j, e);
    free(j.a);
    free(j.u);
    free(j.s);
    free(j.vt);
    return ok;
}

// bench_env_core.c - R17's filters on one core: the processor's passes and the shader on llvmpipe.
//
// llvmpipe takes all cores that it finds when it starts, so each measurement is a program of its
// own, `nacre prefilter` tied to one processor.
#define _GNU_SOURCE
#include "core/mem.h"
#include "core/sort.h"
#include "process/factor.h"
#include "tests/bench/bench_environment.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MOST = 5 };

static bool seconds(const char *before, const char *backend, const char *factors, double *s)
{
    char self[4000] = "", line[400], *out = xasprintf("/tmp/nacre-bench-%d.pfm", (int)getpid());
    if (readlink("/proc/self/exe", self, sizeof self - 1) < 0)
        return false;
    char *command =
        xasprintf("%s '%s' prefilter '%s' --lut '%s' --method separable --backend %s --size 1536 "
                  "--tangent 0,1,0 --normal 1,0,0 --quiet -o %s 2>&1",
                  before, self, bench_shared("reference/env/env.pfm"), factors, backend, out);
    FILE *p = popen(command, "r");
    *s = 0;
    while (p && fgets(line, sizeof line, p))
        sscanf(line, "blur_s %lf", s);
    const bool ok = p && pclose(p) == 0 && *s > 0;
    unlink(out);
    free(out);
    free(command);
    return ok;
}

static bool median(const char *before, const char *backend, const char *factors, int runs,
                   double *s)
{
    double all[MOST];
    for (int k = 0; k < runs; k++)
        if (!seconds(before, backend, factors, &all[k]))
            return false;
    sort_doubles(all, (size_t)runs);
    *s = all[runs / 2];
    return true;
}

bool bench_one_core(struct bench_report *r, struct err *e)
{
    static const char one[] = "OMP_NUM_THREADS=1 LP_NUM_THREADS=1 taskset -c 0";
    char *factors = xasprintf("/tmp/nacre-bench-%d.exr", (int)getpid());
    double cpu, one_core, all_cores;
    struct table t = {0};
    struct factors f = {0};
    const struct table_nodes nodes = {.6, 1};
    const bool ok = table_read(&t, bench_shared("reference/env/lut.pfm"), &nodes, e) &&
                    factor(&f, &t, 1, false, false, e) && factors_write(&f, factors, e);
    if (ok && median(one, "cpu", factors, MOST, &cpu) && median(one, "gl", factors, 1, &one_core) &&
        median("", "gl", factors, 1, &all_cores)) {
        bench_figure(r, "separable rank 1, 256 taps, 1536 x 768, one core", cpu, "s");
        bench_figure(r, "the same shader on llvmpipe, one core", one_core / cpu, "times");
        bench_figure(r, "the same shader on llvmpipe, all cores", all_cores / cpu, "times");
    } else if (ok) {
        bench_note(r, "no OpenGL here: nothing to compare the passes of one core with");
    }
    unlink(factors);
    free(factors);
    factors_finish(&f);
    table_finish(&t);
    return ok;
}

// blur_passes.c - the inner loops of the direct blurs; most of the time of a deconvolution is spent
// here.
//
// Cost of a vector at radius r, AVX-512 on a core with two units each for FMAs and for sums:
// row_pass() has 2 r + 1 loads, nearly all across a border of cache lines (one a cycle); the other
// two pass each sample once into BLUR_ROWS results and add what has the same tap before they
// multiply: r + 1 FMAs, r sums and (2 r + BLUR_ROWS) / BLUR_ROWS loads, two of each a cycle. At
// r = 12 that is 6.5 cycles where plain FMAs took 12.5 (measured: 6.8 and 12.9).
#include "process/blur_passes.h"
#include <string.h>

#if defined __x86_64__
#define NAME(x) x##_512
#define TARGET __attribute__((target("avx512f")))
#define BYTES 64
#include "process/blur_passes_of.h"
#undef NAME
#undef TARGET
#undef BYTES
#define NAME(x) x##_256
#define TARGET __attribute__((target("arch=haswell")))
#define BYTES 32
#include "process/blur_passes_of.h"
#undef NAME
#undef TARGET
#undef BYTES
#endif
#define NAME(x) x##_128
#define TARGET
#define BYTES 16
#include "process/blur_passes_of.h"

#if defined __x86_64__
#define BEST(pass, ...)                                                                            \
    (__builtin_cpu_supports("avx512f")                                 ? pass##_512(__VA_ARGS__)   \
     : __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? pass##_256(__VA_ARGS__)   \
                                                                       : pass##_128(__VA_ARGS__))
#else
#define BEST(pass, ...) pass##_128(__VA_ARGS__)
#endif

void row_pass(const float *in, float *out, size_t n, const float *k, int radius)
{
    BEST(row_pass, in, out, n, k, radius);
}

void column_pass(const float *const *row, float *out, size_t stride, size_t n, const float *k,
                 int radius)
{
    BEST(column_pass, row, out, stride, n, k, radius);
}

void lanes_pass(const float *in, float *out, int n, const float *k, int radius)
{
    BEST(lanes_pass, in, out, n, k, radius);
}

void copy_ahead(float *to, const float *from, int n, size_t ahead)
{
    int i = 0;
    for (; i + BLUR_VEC <= n; i += BLUR_VEC) {
        __builtin_prefetch(from + (size_t)i + ahead);
        memcpy(to + i, from + i, BLUR_VEC * sizeof *to);
    }
    for (; i < n; i++)
        to[i] = from[i];
}

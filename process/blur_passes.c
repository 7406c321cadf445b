// blur_passes.c - the inner loops of the direct blurs; most of the time of a deconvolution is spent
// here.
//
// Cost of a vector at radius r, AVX-512: row_pass() has 2 r + 1 loads, nearly all across a border
// of cache lines (one a cycle), and as many FMAs (two a cycle); the other two pass each sample once
// into BLUR_ROWS results, so they have (2 r + BLUR_ROWS) / BLUR_ROWS loads and the same FMAs.
#include "process/blur_passes.h"

// Sixteen samples, loaded from anywhere. Without AVX-512 the compiler takes two or four registers
// for it. Macros: a function that returns a vec would have another ABI in each clone.
typedef float vec __attribute__((vector_size(64), aligned(4), may_alias));
#define load(p) (*(const vec *)(p))
#define store(p, v) (*(vec *)(p) = (v))

#define CLONES __attribute__((target_clones("avx512f", "arch=haswell", "default")))

CLONES void row_pass(const float *in, float *out, size_t n, const float *k, int radius)
{
    for (size_t i = 0; i < n; i += BLUR_LANES) {
        const float *at = in + i;
        vec a = {0}, b = {0}, c = {0}, d = {0};
        for (int m = 0; m <= 2 * radius; m++, at++) {
            a += k[m] * load(at);
            b += k[m] * load(at + BLUR_VEC);
            c += k[m] * load(at + 2 * BLUR_VEC);
            d += k[m] * load(at + 3 * BLUR_VEC);
        }
        store(out + i, a);
        store(out + i + BLUR_VEC, b);
        store(out + i + 2 * BLUR_VEC, c);
        store(out + i + 3 * BLUR_VEC, d);
    }
}

// Four sums s0 .. s3 of v, the sample before their window's last: k[m] goes to the first.
#define ALL(s, m, v)                                                                               \
    (s##0 += k[m] * (v), s##1 += k[(m)-1] * (v), s##2 += k[(m)-2] * (v), s##3 += k[(m)-3] * (v))
#define FIRST(s, v0, v1, v2)                                                                       \
    (s##0 += k[0] * (v0) + k[1] * (v1) + k[2] * (v2), s##1 += k[0] * (v1) + k[1] * (v2),           \
     s##2 += k[0] * (v2))
#define LAST(s, n, v0, v1, v2)                                                                     \
    (s##1 += k[n] * (v0), s##2 += k[(n)-1] * (v0) + k[n] * (v1),                                   \
     s##3 += k[(n)-2] * (v0) + k[(n)-1] * (v1) + k[n] * (v2))

CLONES void column_pass(const float *const *row, float *out, size_t stride, size_t n,
                        const float *k, int radius)
{
    const int last = 2 * radius;
    for (size_t i = 0; i < n; i += 2 * BLUR_VEC) {
        vec a0 = {0}, a1 = {0}, a2 = {0}, a3 = {0}, b0 = {0}, b1 = {0}, b2 = {0}, b3 = {0};
        FIRST(a, load(row[0] + i), load(row[1] + i), load(row[2] + i));
        FIRST(b, load(row[0] + i + BLUR_VEC), load(row[1] + i + BLUR_VEC),
              load(row[2] + i + BLUR_VEC));
        for (int m = 3; m <= last; m++) {
            ALL(a, m, load(row[m] + i));
            ALL(b, m, load(row[m] + i + BLUR_VEC));
        }
        LAST(a, last, load(row[last + 1] + i), load(row[last + 2] + i), load(row[last + 3] + i));
        LAST(b, last, load(row[last + 1] + i + BLUR_VEC), load(row[last + 2] + i + BLUR_VEC),
             load(row[last + 3] + i + BLUR_VEC));
        float *to = out + i;
        store(to, a0);
        store(to + BLUR_VEC, b0);
        store(to + stride, a1);
        store(to + stride + BLUR_VEC, b1);
        store(to + 2 * stride, a2);
        store(to + 2 * stride + BLUR_VEC, b2);
        store(to + 3 * stride, a3);
        store(to + 3 * stride + BLUR_VEC, b3);
    }
}

CLONES void lanes_pass(const float *in, float *out, int n, const float *k, int radius)
{
    const int last = 2 * radius;
    for (int t = 0; t < n;
         t += BLUR_ROWS, in += BLUR_ROWS * BLUR_VEC, out += BLUR_ROWS * BLUR_VEC) {
        vec a0 = {0}, a1 = {0}, a2 = {0}, a3 = {0};
        FIRST(a, load(in), load(in + BLUR_VEC), load(in + 2 * BLUR_VEC));
        const float *at = in + 3 * BLUR_VEC;
        for (int m = 3; m <= last; m++, at += BLUR_VEC)
            ALL(a, m, load(at));
        LAST(a, last, load(at), load(at + BLUR_VEC), load(at + 2 * BLUR_VEC));
        store(out, a0);
        store(out + BLUR_VEC, a1);
        store(out + 2 * BLUR_VEC, a2);
        store(out + 3 * BLUR_VEC, a3);
    }
}

CLONES void copy_ahead(float *to, const float *from, int n, size_t ahead)
{
    int i = 0;
    for (; i + BLUR_VEC <= n; i += BLUR_VEC) {
        __builtin_prefetch(from + (size_t)i + ahead);
        store(to + i, load(from + i));
    }
    for (; i < n; i++)
        to[i] = from[i];
}

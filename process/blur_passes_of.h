// blur_passes_of.h - the passes at one width of vectors; blur_passes.c includes this once for each,
// with NAME(x), TARGET and BYTES. Vectors wider than the machine's would be taken apart in memory.
typedef float NAME(vec) __attribute__((vector_size(BYTES), aligned(4), may_alias));
#define load(p) (*(const NAME(vec) *)(p))
#define store(p, v) (*(NAME(vec) *)(p) = (v))
#define WIDE (BYTES / (int)sizeof(float))

TARGET static void NAME(row_pass)(const float *in, float *out, size_t n, const float *k, int radius)
{
    for (size_t i = 0; i < n; i += 4 * WIDE) {
        const float *at = in + i;
        NAME(vec) a = {0}, b = {0}, c = {0}, d = {0};
        for (int m = 0; m <= 2 * radius; m++, at++) {
            a += k[m] * load(at);
            b += k[m] * load(at + WIDE);
            c += k[m] * load(at + 2 * WIDE);
            d += k[m] * load(at + 3 * WIDE);
        }
        store(out + i, a);
        store(out + i + WIDE, b);
        store(out + i + 2 * WIDE, c);
        store(out + i + 3 * WIDE, d);
    }
}

// Four sums, BLUR_ROWS, take tap m of what is m from the first (l) and from the last (r) sample.
#define STEP(m, l0, l1, l2, l3, r0, r1, r2, r3)                                                    \
    (a0 += k[m] * (l0 + r0), a1 += k[m] * (l1 + r1), a2 += k[m] * (l2 + r2), a3 += k[m] * (l3 + r3))

// The four sums over samples IN(0) .. IN(2 radius + 3): the eight that a step needs stay in
// registers, one more from either end comes with each.
#define FOUR_SUMS(IN)                                                                              \
    NAME(vec)                                                                                      \
    a0 = {0},                                                                                      \
    a1 = {0}, a2 = {0}, a3 = {0}, l0 = IN(0), l1 = IN(1), l2 = IN(2), l3, r0, r1 = IN(end - 2),    \
    r2 = IN(end - 1), r3 = IN(end);                                                                \
    int m = 0;                                                                                     \
    for (; m + 4 <= radius; m += 4) {                                                              \
        l3 = IN(m + 3), r0 = IN(end - 3 - m);                                                      \
        STEP(m, l0, l1, l2, l3, r0, r1, r2, r3);                                                   \
        l0 = IN(m + 4), r3 = IN(end - 4 - m);                                                      \
        STEP(m + 1, l1, l2, l3, l0, r3, r0, r1, r2);                                               \
        l1 = IN(m + 5), r2 = IN(end - 5 - m);                                                      \
        STEP(m + 2, l2, l3, l0, l1, r2, r3, r0, r1);                                               \
        l2 = IN(m + 6), r1 = IN(end - 6 - m);                                                      \
        STEP(m + 3, l3, l0, l1, l2, r1, r2, r3, r0);                                               \
    }                                                                                              \
    for (; m < radius; m++) {                                                                      \
        l3 = IN(m + 3), r0 = IN(end - 3 - m);                                                      \
        STEP(m, l0, l1, l2, l3, r0, r1, r2, r3);                                                   \
        l0 = l1, l1 = l2, l2 = l3, r3 = r2, r2 = r1, r1 = r0;                                      \
    }                                                                                              \
    l3 = IN(m + 3);                                                                                \
    a0 += k[m] * l0, a1 += k[m] * l1, a2 += k[m] * l2, a3 += k[m] * l3

TARGET static void NAME(column_pass)(const float *const *row, float *out, size_t stride, size_t n,
                                     const float *k, int radius)
{
    const int end = 2 * radius + 3;
    for (size_t i = 0; i < n; i += WIDE) {
#define IN(q) load(row[q] + i)
        FOUR_SUMS(IN);
#undef IN
        store(out + i, a0);
        store(out + stride + i, a1);
        store(out + 2 * stride + i, a2);
        store(out + 3 * stride + i, a3);
    }
}

TARGET static void NAME(lanes_pass)(const float *in, float *out, int n, const float *k, int radius)
{
    const int end = 2 * radius + 3;
    for (int t = 0; t < n; t += BLUR_ROWS, in += BLUR_ROWS * BLUR_VEC, out += BLUR_ROWS * BLUR_VEC)
        for (int part = 0; part < BLUR_VEC; part += WIDE) {
#define IN(q) load(in + (q)*BLUR_VEC + part)
            FOUR_SUMS(IN);
#undef IN
            store(out + part, a0);
            store(out + BLUR_VEC + part, a1);
            store(out + 2 * BLUR_VEC + part, a2);
            store(out + 3 * BLUR_VEC + part, a3);
        }
}

#undef FOUR_SUMS
#undef STEP
#undef WIDE
#undef store
#undef load

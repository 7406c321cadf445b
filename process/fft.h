// fft.h - FFTW behind one file: plans that give the same bytes on every run.
//
// Plans are ESTIMATE and one-thread (docs/numerics.md): run many side by side with OpenMP instead.
// fft_run() may be called from any number of threads on one plan; making and freeing plans is
// locked. Transforms are not scaled: backward after forward multiplies by the number of samples.
#pragma once
#include "core/err.h"
#include <stdbool.h>

enum fft_kind { FFT_FORWARD, FFT_BACKWARD, FFT_R2C, FFT_C2R }; // forward: exp(-i 2 pi k x / n)
enum fft_type { FFT_FLOAT, FFT_DOUBLE };

struct fft;

// 1-D (ny = 1) or 2-D, `many` transforms behind each other in memory. Real side [ny][nx],
// half-complex side [ny][nx/2+1]. In place or not is chosen at fft_run(), with the same choice made
// here.
struct fft *fft_new(enum fft_kind kind, enum fft_type type, int ny, int nx, int many, bool in_place,
                    struct err *e);
// Arrays from sample_alloc() (64-byte aligned). A 2-D FFT_C2R destroys its input.
void fft_run(const struct fft *f, void *in, void *out);
void fft_free(struct fft *f);

int fft_good_size(int n); // the least 2^a 3^b 5^c 7^d >= n

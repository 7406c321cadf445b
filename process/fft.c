// fft.c - the one file that knows FFTW.
#include "process/fft.h"
#include "core/mem.h"
#include <fftw3.h>
#include <pthread.h>
#include <stdlib.h>

struct fft {
    enum fft_kind kind;
    enum fft_type type;
    fftw_plan d;
    fftwf_plan f;
};

static pthread_mutex_t planner = PTHREAD_MUTEX_INITIALIZER; // FFTW's planner is not thread-safe

static void plan_double(struct fft *p, const int n[2], int many, int real, int half, double *in,
                        double *out)
{
    fftw_complex *ci = (fftw_complex *)in, *co = (fftw_complex *)out;
    const int rank = n[0] == 1 ? 1 : 2, *size = n[0] == 1 ? n + 1 : n;
    if (p->kind == FFT_R2C)
        p->d = fftw_plan_many_dft_r2c(rank, size, many, in, NULL, 1, real, co, NULL, 1, half,
                                      FFTW_ESTIMATE);
    else if (p->kind == FFT_C2R)
        p->d = fftw_plan_many_dft_c2r(rank, size, many, ci, NULL, 1, half, out, NULL, 1, real,
                                      FFTW_ESTIMATE);
    else
        p->d = fftw_plan_many_dft(rank, size, many, ci, NULL, 1, real, co, NULL, 1, real,
                                  p->kind == FFT_FORWARD ? FFTW_FORWARD : FFTW_BACKWARD,
                                  FFTW_ESTIMATE);
}

static void plan_float(struct fft *p, const int n[2], int many, int real, int half, float *in,
                       float *out)
{
    fftwf_complex *ci = (fftwf_complex *)in, *co = (fftwf_complex *)out;
    const int rank = n[0] == 1 ? 1 : 2, *size = n[0] == 1 ? n + 1 : n;
    if (p->kind == FFT_R2C)
        p->f = fftwf_plan_many_dft_r2c(rank, size, many, in, NULL, 1, real, co, NULL, 1, half,
                                       FFTW_ESTIMATE);
    else if (p->kind == FFT_C2R)
        p->f = fftwf_plan_many_dft_c2r(rank, size, many, ci, NULL, 1, half, out, NULL, 1, real,
                                       FFTW_ESTIMATE);
    else
        p->f = fftwf_plan_many_dft(rank, size, many, ci, NULL, 1, real, co, NULL, 1, real,
                                   p->kind == FFT_FORWARD ? FFTW_FORWARD : FFTW_BACKWARD,
                                   FFTW_ESTIMATE);
}

struct fft *fft_new(enum fft_kind kind, enum fft_type type, int ny, int nx, int many, bool in_place,
                    struct err *e)
{
    // ESTIMATE never touches the arrays, it only wants to know their alignment and whether they
    // differ.
    const size_t bytes = type == FFT_FLOAT ? sizeof(float) : sizeof(double);
    const int half = ny * (nx / 2 + 1);
    const int real = in_place && (kind == FFT_R2C || kind == FFT_C2R) ? 2 * half : ny * nx;
    void *in = sample_alloc((size_t)half * 4 * (size_t)many, bytes, "FFT", e);
    void *out = in_place ? in : sample_alloc((size_t)half * 4 * (size_t)many, bytes, "FFT", e);
    struct fft *p = NULL;
    if (in && out) {
        p = xcalloc(1, sizeof *p);
        *p = (struct fft){.kind = kind, .type = type};
        const int n[2] = {ny, nx};
        pthread_mutex_lock(&planner);
        if (type == FFT_FLOAT)
            plan_float(p, n, many, real, half, in, out);
        else
            plan_double(p, n, many, real, half, in, out);
        pthread_mutex_unlock(&planner);
        if (!p->d && !p->f) {
            err_set(e, ERR_DATA, "no FFT of size %d x %d", nx, ny);
            free(p);
            p = NULL;
        }
    }
    if (out != in)
        free(out);
    free(in);
    return p;
}

void fft_run(const struct fft *p, void *in, void *out)
{
    if (p->type == FFT_FLOAT) {
        if (p->kind == FFT_R2C)
            fftwf_execute_dft_r2c(p->f, in, out);
        else if (p->kind == FFT_C2R)
            fftwf_execute_dft_c2r(p->f, in, out);
        else
            fftwf_execute_dft(p->f, in, out);
    } else {
        if (p->kind == FFT_R2C)
            fftw_execute_dft_r2c(p->d, in, out);
        else if (p->kind == FFT_C2R)
            fftw_execute_dft_c2r(p->d, in, out);
        else
            fftw_execute_dft(p->d, in, out);
    }
}

void fft_free(struct fft *p)
{
    if (!p)
        return;
    pthread_mutex_lock(&planner);
    if (p->d)
        fftw_destroy_plan(p->d);
    if (p->f)
        fftwf_destroy_plan(p->f);
    pthread_mutex_unlock(&planner);
    free(p);
}

int fft_good_size(int n)
{
    for (int m = n > 1 ? n : 1;; m++) {
        int rest = m;
        for (int p = 2; p <= 7; p += p == 2 ? 1 : 2)
            while (rest % p == 0)
                rest /= p;
        if (rest == 1)
            return m;
    }
}

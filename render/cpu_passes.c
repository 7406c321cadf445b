// cpu_passes.c - the passes of sampling.h by the CPU.
#include "core/mem.h"
#include "render/cpu.h"
#include "render/sampling.h"
#include <stdlib.h>

bool cpu_render_passes(const struct scene *s, int side, struct image *out, struct err *e)
{
    struct sampling p;
    const size_t n = (size_t)s->w * (size_t)s->h * 3;
    double *sum = sample_alloc(n, sizeof *sum, "a picture", e);
    if (!sum || !sampling_init(&p, s, side, e)) {
        free(sum);
        return false;
    }
    bool ok = true;
    for (int k = 0; ok && k < side * side; k++) {
        struct image one = {0};
        ok = sampling_pass(&p, k, e) && cpu_render(&p.pass, false, &one, e);
        for (size_t q = 0; ok && q < n; q++)
            sum[q] += (double)one.px[q];
        image_finish(&one);
    }
    ok = ok && image_init(out, s->w, s->h, 3, e);
    for (size_t q = 0; ok && q < n; q++)
        out->px[q] = (float)(sum[q] / (side * side));
    sampling_finish(&p);
    free(sum);
    return ok;
}

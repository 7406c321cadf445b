// coil.c - a spiral that a tube of varying width follows.
#define _GNU_SOURCE
#include "ui/coil.h"
#include "core/geom.h"
#include "core/outfile.h"
#include <stdio.h>
#include <stdlib.h>

enum { ALONG = 360, AROUND = 40 };

// The middle of the body at s = 0 (tail) to 1 (head), metres.
static struct vec3 middle(double s)
{
    const double angle = 4.6 * M_PI * s, r = 0.025 + 0.055 * s;
    return v3(r * cos(angle), r * sin(angle), 0.012 * s);
}

static double thickness(double s)
{
    return 0.0105 * sqrt(fmin(1, 4 * s)) * (s > 0.97 ? sqrt(fmax(0, (1 - s) / 0.03)) : 1) + 1e-5;
}

bool coil_write(const char *path, struct err *e)
{
    char *text = NULL;
    size_t size = 0;
    FILE *f = open_memstream(&text, &size);
    fputs("# a coiled body; s along it, v around it\n", f);
    for (int i = 0; i <= ALONG; i++) {
        const double s = (double)i / ALONG, h = 1e-4;
        struct frame b; // t along the body, n up
        frame_from(v3_sub(middle(s + h), middle(s - h)), v3(0, 0, 1), &b);
        for (int j = 0; j <= AROUND; j++) {
            const double a = 2 * M_PI * j / AROUND, r = thickness(s);
            const struct vec3 out = v3_add(v3_scale(cos(a), b.n), v3_scale(-sin(a), b.b));
            const struct vec3 p = v3_add(middle(s), v3_scale(r, out));
            fprintf(f, "v %.6f %.6f %.6f\nvt %.5f %.5f\nvn %.5f %.5f %.5f\n", p.x, p.y, p.z, s,
                    (double)j / AROUND, out.x, out.y, out.z);
        }
    }
    for (int i = 0; i < ALONG; i++)
        for (int j = 0; j < AROUND; j++) {
            const int a = i * (AROUND + 1) + j + 1, d = a + AROUND + 1;
            fprintf(f, "f %d/%d/%d %d/%d/%d %d/%d/%d %d/%d/%d\n", a, a, a, a + 1, a + 1, a + 1,
                    d + 1, d + 1, d + 1, d, d, d);
        }
    fclose(f);
    const bool ok = outfile_write(path, text, size, e);
    free(text);
    return ok;
}

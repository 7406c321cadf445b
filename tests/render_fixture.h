// render_fixture.h - tables and scenes in memory for the tests of render/.
#pragma once
#include "render/cpu.h"
#include "render/gl_render.h"

// S_d (XYZ) of a crossed grating that reflects: lobes of width sigma at multiples of lambda /
// pitch, with the envelopes of slits, under illuminant E (T17 eq. 15 on a sum of Gaussian lobes).
static inline bool fixture_lcd(struct table *t, int n, double range, int power, struct err *e)
{
    const double pitch_m = 25e-6, sigma = 0.0025, lambda_m = 520e-9;
    if (!table_init(t, n, range, power, 1, e))
        return false;
    enum { ORDERS = 8 };
    const double norm = 1 / (106.857e-9 * 2 * M_PI * sigma * sigma * 4 * M_PI * M_PI);
#pragma omp parallel for schedule(dynamic, 8)
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            double sum[3] = {0}, cmf[3];
            for (double l = 380e-9; l <= 780.1e-9; l += 2e-9) {
                const double k = lambda_m / l;
                double x = 0, y = 0;
                for (int m = -ORDERS; m <= ORDERS; m++) {
                    const double h = m * lambda_m / pitch_m;
                    const double ax = m ? sin(M_PI * m * 0.4) / (M_PI * m * 0.4) : 1;
                    const double ay = m ? sin(M_PI * m * 0.55) / (M_PI * m * 0.55) : 1;
                    const double dx = table_node(t, i) * k - h, dy = table_node(t, j) * k - h;
                    x += ax * ax * exp(-dx * dx / (2 * sigma * sigma));
                    y += ay * ay * exp(-dy * dy / (2 * sigma * sigma));
                }
                cie_xyz(l, cmf);
                for (int c = 0; c < 3; c++)
                    sum[c] += k * k * x * y * cmf[c] * 2e-9;
            }
            for (int c = 0; c < 3; c++)
                t->tab[((size_t)j * (size_t)n + (size_t)i) * 3 + (size_t)c] =
                    (float)(sum[c] * norm);
        }
    return true;
}

static const double white[3] __attribute__((unused)) = {1, 1, 1};

static inline struct scene fixture_scene(struct object *o, struct light *l, int n_lights)
{
    return (struct scene){
        .camera = {.eye_m = {0.02, -0.03, 0.5}, .up = {0, 1, 0}, .fov_rad = 0.4},
        .w = 160,
        .h = 120,
        .light_color = {1, 1, 1},
        .light = l,
        .n_lights = n_lights,
        .object = o,
        .n_objects = 1,
    };
}

static inline struct object fixture_object(enum shape_kind kind)
{
    struct object o = {.name = "fixture",
                       .shape = {.kind = kind,
                                 .width_m = 0.16,
                                 .height_m = 0.12,
                                 .radius_m = 0.06,
                                 .inner_m = kind == SHAPE_DISC ? 0.012 : 0,
                                 .span_rad = 3}};
    frame_from(v3(1, 0.1, 0), v3(0.05, 0, 1), &o.shape.frame);
    material_init(&o.material);
    return o;
}

// Root mean square of a - b over that of b.
static inline double rel_rmse(const struct image *a, const struct image *b)
{
    double err = 0, all = 0;
    for (size_t k = 0; k < (size_t)a->w * (size_t)a->h * 3; k++) {
        const double d = (double)a->px[k] - (double)b->px[k];
        err += d * d;
        all += (double)b->px[k] * (double)b->px[k];
    }
    return sqrt(err / all);
}

static inline void compare_backends(const struct scene *s)
{
    struct image gl, cpu;
    struct err e;
    if (!gl_render(s, &gl, NULL, &e)) {
        assert_int_equal(e.code, ERR_DEVICE);
        print_message("skipped: %s\n", e.msg);
        skip();
    }
    assert_true(cpu_render(s, false, &cpu, &e));
    const double difference = rel_rmse(&gl, &cpu);
    assert_near(difference, 0, 1e-3);
    image_finish(&gl);
    image_finish(&cpu);
}

// test_grating.c - slits against the sum of their waves, Stam's shader against its listing.
#include "tests/test.h"

#include "tests/render_fixture.h"
#include <complex.h>

// The wave that `n` slits of width a and pitch d send to u, by adding up points.
static double row_by_waves(int n, double d_m, double a_m, double u, double lambda_m)
{
    enum { POINTS = 400 };
    double complex sum = 0;
    for (int slit = 0; slit < n; slit++)
        for (int k = 0; k < POINTS; k++)
            sum += cexp(-2 * M_PI * I * u / lambda_m * (slit * d_m + a_m * (k + .5) / POINTS)) *
                   a_m / POINTS;
    return cabs(sum) * cabs(sum) / (lambda_m * n * d_m); // |P|^2 / (lambda A)
}

static struct slits cd(struct err *e)
{
    struct slits s = {.row = {{.pitch_m = 2e-6, .width_m = 0.5e-6, .count = 21}}, .across = 0.02};
    struct spectrum p;
    assert_true(illuminant_get(&p, "E", e) && slits_light(&s, &p, 401, e));
    spectrum_finish(&p);
    return s;
}

TEST(slits_are_the_sum_of_their_waves)
{
    struct err e;
    struct slits s = cd(&e);
    for (double u = -0.9; u < 0.91; u += 0.0713) {
        double out[3], sum[3] = {0};
        slits_eval(&s, u, 0.01, out);
        for (int k = 0; k < s.n; k++)
            for (int c = 0; c < 3; c++)
                sum[c] += s.weight[k][c] * row_by_waves(21, 2e-6, 0.5e-6, u, s.lambda_m + k * 1e-9);
        for (int c = 0; c < 3; c++)
            assert_near(out[c] * 16 * M_PI * M_PI, sum[c] * exp(-0.125) / (sqrt(2 * M_PI) * 0.02),
                        0.02); // of some 40
    }
    slits_finish(&s);
}

TEST(a_row_sends_out_the_light_that_it_holds)
{
    struct err e;
    struct slits s = cd(&e); // all orders: the integral of |P|^2 / (lambda A) over u is a / d
    double sum = 0;
    enum { N = 20000 };
    for (int k = 0; k < N; k++) {
        double out[3];
        slits_eval(&s, 40 * ((k + .5) / N - .5), 0, out);
        sum += out[1] * 40 / N;
    }
    double light = 0;
    for (int k = 0; k < s.n; k++)
        light += s.weight[k][1];
    assert_near(sum * 16 * M_PI * M_PI * sqrt(2 * M_PI) * 0.02 / light, 0.25, 0.25 * 0.02);
    slits_finish(&s);
}

// G04's vertex program, word for word in C: what the shader must give at a point.
static void listing(struct vec3 P, struct vec3 N, struct vec3 T, struct vec3 lightPosition,
                    struct vec3 eyePosition, double r, double d, const double hiliteColor[3],
                    double colorO[3])
{
    const struct vec3 L = v3_unit(v3_sub(lightPosition, P)), V = v3_unit(v3_sub(eyePosition, P));
    const struct vec3 H = v3_add(L, V);
    double u = v3_dot(T, H) * d;
    const double w = v3_dot(N, H), e = r * u / w, c = exp(-e * e);
    for (int k = 0; k < 3; k++)
        colorO[k] = hiliteColor[k] * c;
    if (u < 0)
        u = -u;
    for (int n = 1; n < 8; n++) {
        const double y = 2 * u / n - 1;
        const double x[3] = {4 * (y - 0.75), 4 * (y - 0.5), 4 * (y - 0.25)};
        for (int k = 0; k < 3; k++)
            colorO[k] += fmax(0, 1 - x[k] * x[k]);
    }
}

TEST(stams_shader_is_its_listing_pixel_by_pixel)
{
    struct light light = {.at = {0.2, 0.3, 0.6}, .power = 1, .tint = {1, 1, 1}};
    struct object o = fixture_object(SHAPE_DISC);
    o.material.diffraction = DIFFRACTION_STAM;
    o.material.rainbow = (struct rainbow){2e-6, 3, {0.9, 0.8, 0.7}};
    struct scene s = fixture_scene(&o, &light, 1);
    struct image im;
    struct err e;
    const bool gl = gl_render(&s, &im, NULL, &e);
    if (!gl) {
        print_message("the CPU alone: %s\n", e.msg);
        assert_true(cpu_render(&s, false, &im, &e));
    }
    int seen = 0;
    for (int j = 0; j < s.h; j++)
        for (int i = 0; i < s.w; i++) {
            struct vec3 dir, wi;
            struct hit hit;
            camera_ray(&s.camera, i, j, s.w, s.h, &dir);
            if (!shape_hit(&o.shape, s.camera.eye_m, dir, &hit))
                continue;
            double want[3];
            listing(hit.at_m, hit.frame.n, hit.frame.t, light.at, s.camera.eye_m, 3, 2,
                    o.material.rainbow.highlight, want);
            const double irradiance = light_at(&light, hit.at_m, &wi);
            for (int c = 0; c < 3; c++)
                assert_near(im.px[((size_t)j * (size_t)s.w + (size_t)i) * 3 + (size_t)c],
                            irradiance * want[c], 2e-4 * irradiance);
            seen++;
        }
    assert_true(seen > 3000);
    image_finish(&im);
}

TEST(gl_draws_gratings_and_masks_as_the_cpu_does)
{
    struct light light = {.at = {0.03, 0.05, 0.45}, .power = 1, .tint = {1, 0.5, 0.25}};
    struct err e;
    for (int k = 0; k < 3; k++) {
        struct object o = fixture_object(k ? SHAPE_PLANE : SHAPE_DISC);
        o.material.diffraction = DIFFRACTION_SLITS;
        o.material.slits = cd(&e);
        o.material.slits.row[0].radial = k == 1;
        o.material.mask.stripes = k == 1 ? 7 : 0;
        o.material.mask.duty = 0.4;
        if (k == 2) {
            o.material.slits.row[1] =
                (struct multislit){.pitch_m = 3e-6, .width_m = 1e-6, .count = 5};
            assert_true(image_init(&o.material.mask.picture, 5, 3, 1, &e));
            for (int p = 0; p < 15; p++)
                o.material.mask.picture.px[p] = (float)(p % 4) / 3;
        }
        struct scene s = fixture_scene(&o, &light, 1);
        compare_backends(&s);
        material_finish(&o.material);
    }
}

TEST_MAIN(cmocka_unit_test(slits_are_the_sum_of_their_waves),
          cmocka_unit_test(a_row_sends_out_the_light_that_it_holds),
          cmocka_unit_test(stams_shader_is_its_listing_pixel_by_pixel),
          cmocka_unit_test(gl_draws_gratings_and_masks_as_the_cpu_does))

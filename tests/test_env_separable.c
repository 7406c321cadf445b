// test_env_separable.c - R17's passes against the algorithm as printed, pixel by pixel.
#include "tests/env_case.h"

#include "process/env_exact.h"
#include "process/env_separable.h"

// Bilinear in a lat-long map, wrapped at the seam, over the pole to the other side.
static double map_at(const struct image *im, struct vec3 d, int c)
{
    double col, row, sum = 0;
    latlong_pixel(d, im->w, im->h, &col, &row);
    const int i = (int)floor(col), j = (int)floor(row);
    for (int q = 0; q < 4; q++) {
        int x = i + q % 2, y = j + q / 2;
        const double w = (q % 2 ? col - i : 1 - col + i) * (q / 2 ? row - j : 1 - row + j);
        if (y < 0 || y >= im->h) {
            y = y < 0 ? 0 : im->h - 1;
            x += im->w / 2;
        }
        sum += w * (double)im->px[(y * im->w + (x + im->w) % im->w) * 3 + c];
    }
    return sum;
}

// Algorithms 1 and 2 of R17, one pass: a half vector and a light direction at every tap.
static void pass(const struct image *in, const struct env_taps *t, const double axis[2], bool add,
                 struct image *out)
{
    for (int j = 0; j < in->h; j++)
        for (int i = 0; i < in->w; i++) {
            const struct vec3 r = latlong_dir(i, j, in->w, in->h);
            const struct vec3 right = v3_unit(v3(-r.z, 0, r.x)), down = v3_cross(r, right);
            double sum[3] = {0};
            for (int k = 0; k < t->n; k++) {
                const double h = (double)t->h[k], w = 1 + sqrt(1 - h * h);
                const struct vec3 half =
                    v3_add(v3_scale(h, v3_add(v3_scale(axis[0], right), v3_scale(axis[1], down))),
                           v3_scale(w, r));
                const struct vec3 unit = v3_unit(half);
                const struct vec3 wi = v3_sub(v3_scale(2 * v3_dot(r, unit), unit), r);
                for (int c = 0; c < 3; c++)
                    sum[c] += (double)t->rgb[3 * k + c] * map_at(in, wi, c);
            }
            float *px = out->px + (j * in->w + i) * 3;
            for (int c = 0; c < 3; c++)
                px[c] = (float)sum[c] + (add ? px[c] : 0);
        }
}

static struct factors factors_of(const struct table *t, int rank, bool align)
{
    struct factors f;
    struct err e = {0};
    assert_true(factor(&f, t, rank, align, false, &e));
    return f;
}

TEST(both_passes_are_the_printed_algorithm)
{
    enum { H = 48, TAPS = 40 };
    struct environment env = case_environment(H, &case_axes);
    struct table t = case_table(81, .4, 1);
    for (int q = 0; q < 3; q++) {
        const int rank = q ? 2 : 1;
        struct factors f = factors_of(&t, rank, q == 2);
        const struct frame frame = case_frame(.3, .8, -.2, -.1, .4, .9);
        struct image sum, mid, got;
        struct err e = {0};
        const struct separable how = {2 * H, TAPS, false};
        assert_true(image_init(&sum, 2 * H, H, 3, &e) && image_init(&mid, 2 * H, H, 3, &e));
        for (int r = 0; r < rank; r++)
            for (int k = 1; k >= 0; k--) {
                struct env_taps taps;
                double axis[2];
                assert_true(env_taps(&taps, &f, k, r, TAPS, &e));
                separable_axis(&f, k, &frame, false, axis);
                pass(k ? &env.map : &mid, &taps, axis, !k && r, k ? &mid : &sum);
                env_taps_finish(&taps);
            }
        assert_true(env_separable(&f, &env, &frame, &how, &got, &e));
        double worst = 0, peak = 0;
        for (int k = 0; k < 6 * H * H; k++) {
            const double want = fmax(0, 16 * M_PI * M_PI * (double)sum.px[k]);
            worst = fmax(worst, fabs((double)got.px[k] - want));
            peak = fmax(peak, want);
        }
        assert_true(worst < 2e-5 * peak);
        image_finish(&sum);
        image_finish(&mid);
        image_finish(&got);
        factors_finish(&f);
    }
    table_finish(&t);
    environment_finish(&env);
}

TEST(four_passes_meet_the_exact_method_near_the_normal_whatever_the_sample_s_turn)
{
    struct environment env = case_environment(128, &case_axes);
    struct table t = case_table(161, .3, 1);
    const struct fresnel constant = {false, 1};
    const struct env_how how = {.tolerance = 1e-3, .detail_rad = M_PI / 128};
    struct env_kernel k;
    struct err e = {0};
    struct factors f = factors_of(&t, 5, false);
    assert_true(env_kernel_init(&k, &t, &constant, &how, &e));
    for (int q = 0; q < 4; q++) {
        // The third sample faces a pole, the lights are in sight of all.
        static const double normal[4][3] = {
            {.3, .5, .81}, {-.6, .2, .77}, {0, 1, 0}, {.1, -.9, -.5}};
        const struct frame frame =
            case_frame(.1 + q, .8, .4 * q, normal[q][0], normal[q][1], normal[q][2]);
        struct image exact, map;
        const struct separable four = {512, 256, true};
        assert_true(env_exact(&k, &env, &frame, 129, &exact, &e));
        assert_true(env_separable(&f, &env, &frame, &four, &map, &e));
        double wrong = 0, all = 0;
        for (int j = 48; j <= 80; j++)
            for (int i = 48; i <= 80; i++) { // within 15 degrees along the axes
                const double o_t = env_map_cosine(i, 129), o_b = env_map_cosine(j, 129);
                const struct vec3 mirror =
                    frame_world(&frame, v3(-o_t, -o_b, sqrt(1 - o_t * o_t - o_b * o_b)));
                for (int c = 0; c < 3; c++) {
                    const double want = (double)exact.px[(j * 129 + i) * 3 + c];
                    const double d = map_at(&map, mirror, c) - want;
                    wrong += d * d;
                    all += want * want;
                }
            }
        print_message("frame %d: relative L2 %.3f\n", q, sqrt(wrong / all));
        assert_true(sqrt(wrong / all) < .076); // T17's own error of preconvolution
        image_finish(&exact);
        image_finish(&map);
    }
    env_kernel_finish(&k);
    factors_finish(&f);
    table_finish(&t);
    environment_finish(&env);
}

TEST(impossible_maps_and_filters_are_refused)
{
    struct environment env = case_environment(8, &case_axes);
    struct table t = case_table(21, .4, 1);
    struct factors f = factors_of(&t, 1, false);
    struct image out;
    struct err e = {0};
    assert_false(env_separable(&f, &env, &case_axes, &(struct separable){33, 9, true}, &out, &e));
    assert_string_equal(e.msg, "bad map width 33: must be even, 4 to 32768");
    assert_false(env_separable(&f, &env, &case_axes, &(struct separable){32, 0, true}, &out, &e));
    assert_int_equal(e.code, ERR_DATA);
    factors_finish(&f);
    table_finish(&t);
    environment_finish(&env);
}

TEST_MAIN(
    cmocka_unit_test(both_passes_are_the_printed_algorithm),
    cmocka_unit_test(four_passes_meet_the_exact_method_near_the_normal_whatever_the_sample_s_turn),
    cmocka_unit_test(impossible_maps_and_filters_are_refused))

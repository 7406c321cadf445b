// test_lobes.c - cells of a pattern hold all of it, and light from everywhere on them is an
// integral.
#include "tests/test.h"

#include "render/cut.h"
#include "tests/render_fixture.h"

static double noise(int k)
{
    return 0.5 + 0.5 * sin(12.9898 * k + 78.233 * (k % 7));
}

TEST(cells_cover_the_grid_once_and_share_its_power)
{
    enum { W = 37, H = 23, N = 20, PARTS = 6 };
    double power[W * H], x[W + 1], y[H + 1], all = 0, sum = 0;
    struct cut_part part[N * PARTS];
    int covered[W * H] = {0};
    struct err e;
    for (int k = 0; k < W * H; k++)
        all += power[k] = k % 5 ? noise(k) : 0;
    for (int k = 0; k <= W; k++)
        x[k] = k * k;
    for (int k = 0; k <= H; k++)
        y[k] = 3 * k;
    const struct cut_grid g = {.w = W, .h = H, .power = power, .x = x, .y = y};
    assert_int_equal(cut_cells(&g, N, PARTS, part, &e), N);
    for (int k = 0; k < N * PARTS; k++) {
        sum += part[k].power * part[k].share;
        for (int q = 0; q < part[k].w * part[k].h && part[k].share == 1; q++)
            covered[(part[k].j + q / part[k].w) * W + part[k].i + q % part[k].w]++;
    }
    assert_near(sum, all, 1e-9 * all);
    for (int k = 0; k < W * H; k++)
        assert_int_equal(covered[k], 1);
}

TEST(a_single_node_is_shared_by_all_parts_and_darkness_is_one_cell)
{
    double power[4] = {0, 0, 7, 0}, none[4] = {0};
    const double edge[3] = {0, 1, 2};
    struct cut_part part[4 * 3];
    struct err e;
    const struct cut_grid g = {2, 2, power, edge, edge, NULL},
                          dark = {2, 2, none, edge, edge, NULL};
    const int cells = cut_cells(&g, 4, 3, part, &e);
    double sum = 0;
    for (int k = 0; k < 3 * cells; k++)
        sum += part[k].power * part[k].share;
    assert_near(sum, 7, 1e-12);
    assert_int_equal(cut_cells(&dark, 4, 3, part, &e), 1);
}

static void narrow_lobes(struct material *m)
{
    struct table t;
    struct err e;
    assert_true(table_init(&t, 129, 0.8, 3, 1, &e));
    t.is_rgb = true;
    for (int k = 0; k < 129 * 129; k++) {
        const double u = table_node(&t, k % 129), v = table_node(&t, k / 129);
        for (int c = 0; c < 3; c++)
            for (int order = -1; order < 2; order++) {
                const double x = u - order * (0.3 + 0.1 * c);
                t.tab[3 * k + c] += (float)exp(-(x * x + v * v) / (2 * 0.02 * 0.02));
            }
    }
    material_take_table(m, &t, 0.3);
}

TEST(the_cells_integral_is_the_table_s)
{
    struct material m;
    struct lobes l;
    struct err e;
    material_init(&m);
    narrow_lobes(&m);
    for (int parts = 1; parts < 10; parts += 8) {
        double sum[3] = {0}, direct[3] = {0};
        assert_true(lobes_init(&l, &m, DIFFRACTION_TABLE, LOBES_CELLS, parts, &e));
        for (int k = 0; k < l.n; k++)
            for (int c = 0; c < 3; c++)
                sum[c] += (double)lobes_cell(&l, k)[3 + c];
        enum { FINE = 1600 }; // of the table as it is read between its nodes
        for (int k = 0; k < FINE * FINE; k++) {
            double rgb[3];
            table_eval(&m.table, ((k % FINE + .5) / FINE * 2 - 1) * 0.8,
                       ((k / FINE + .5) / FINE * 2 - 1) * 0.8, 2, 0, rgb);
            for (int c = 0; c < 3; c++)
                direct[c] += rgb[c] * (1.6 / FINE) * (1.6 / FINE);
        }
        for (int c = 0; c < 3; c++)
            assert_near(sum[c] / direct[c], 1, 1e-3);
        lobes_finish(&l);
    }
    material_finish(&m);
}

// A soft room and, in that direction, a lamp of a degree.
static void room(struct surround *s, struct vec3 to)
{
    struct environment env = {0};
    struct err e;
    assert_true(image_init(&env.map, 1024, 512, 3, &e));
    for (int k = 0; k < 1024 * 512; k++) {
        const struct vec3 d = latlong_dir(k % 1024, k / 1024, 1024, 512);
        const double lamp = 500 * exp(2 * (v3_dot(d, to) - 1) / (0.015 * 0.015));
        for (int c = 0; c < 3; c++)
            env.map.px[3 * k + c] = (float)(1 + 0.5 * sin(3 * d.x + c) * d.y + lamp);
    }
    assert_true(surround_init(s, &env, 1, 0, &e));
}

// The same by brute force: all directions of a fine grid over (u, v), the room read as
// environment.h defines it between its pixels.
static void brute(const struct surround *s, const struct material *m, const struct frame *f,
                  struct vec3 wo, double out[3])
{
    enum { N = 2400 };
    const double step = 2 * m->table.range / N;
    double sum[3] = {0};
    for (int k = 0; k < N * N; k++) {
        const double u = (k % N + .5) * step - m->table.range;
        const double v = (k / N + .5) * step - m->table.range;
        const double x = u - wo.x, y = v - wo.y, square = 1 - x * x - y * y;
        if (square <= 0)
            continue;
        const struct vec3 wi = v3(x, y, sqrt(square));
        double pattern[3], light[3];
        material_diffraction(m, wi, wo, pattern);
        environment_radiance(&s->env, frame_world(f, wi), light);
        for (int c = 0; c < 3; c++)
            sum[c] += pattern[c] * light[c] * step * step / wi.z;
    }
    for (int c = 0; c < 3; c++)
        out[c] = sum[c];
}

// What one ray to a place of the disc meets.
static struct vec3 look(struct scene *s, double angle, struct hit *hit)
{
    const struct shape *shape = &s->object[0].shape;
    struct vec3 dir;
    s->camera.target_m = frame_world(&shape->frame, v3(0.04 * cos(angle), 0.04 * sin(angle), 0));
    camera_ray(&s->camera, 0, 0, 1, 1, &dir);
    assert_true(shape_hit(shape, s->camera.eye_m, dir, hit));
    return frame_local(&hit->frame, v3_scale(-1, v3_unit(dir)));
}

TEST(the_reference_under_an_environment_is_the_integral_over_all_directions)
{
    // Of the lamp's half vector: on the middle lobe, beside it, on a first order, on none.
    static const double u[] = {0, 0.02, 0.4, 0.2};
    struct object o = fixture_object(SHAPE_DISC); // its tangents turn: no map holds for all of it
    struct scene s = fixture_scene(&o, NULL, 0);
    narrow_lobes(&o.material);
    s.camera.fov_rad = 1e-6; // one point
    s.w = s.h = 1;
    for (int k = 0; k < 4; k++) {
        struct surround around;
        struct image im;
        struct hit hit;
        struct err e;
        double truth[3];
        const struct vec3 wo = look(&s, 0.4 + 1.7 * k, &hit);
        struct vec3 lamp = v3(u[k] - wo.x, -wo.y, 0);
        lamp.z = sqrt(1 - lamp.x * lamp.x - lamp.y * lamp.y);
        room(&around, frame_world(&hit.frame, lamp));
        s.surround = &around;
        assert_true(cpu_render(&s, true, &im, &e));
        brute(&around, &o.material, &hit.frame, wo, truth);
        print_message("place %d: %g of %g\n", k, (double)im.px[1], truth[1]);
        for (int c = 0; c < 3; c++)
            if (!(fabs((double)im.px[c] / truth[c] - 1) < 0.01))
                fail_msg("place %d, channel %d: %g, not %g", k, c, (double)im.px[c], truth[c]);
        image_finish(&im);
        surround_finish(&around);
    }
    material_finish(&o.material);
}

TEST_MAIN(cmocka_unit_test(cells_cover_the_grid_once_and_share_its_power),
          cmocka_unit_test(a_single_node_is_shared_by_all_parts_and_darkness_is_one_cell),
          cmocka_unit_test(the_cells_integral_is_the_table_s),
          cmocka_unit_test(the_reference_under_an_environment_is_the_integral_over_all_directions))

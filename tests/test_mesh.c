// test_mesh.c - OBJ files, tangents, rays against triangles, both renderers.
#include "tests/test.h"

#include "tests/render_fixture.h"

static const char quad[] = "# two triangles as one face\nv -0.08 -0.06 0\nv 0.08 -0.06 0\n"
                           "v 0.08 0.06 0\nv -0.08 0.06 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
                           "f 1/1 2/2 3/3 4/4\n";

// Reads OBJ text; the file's random name is cut from the message.
static bool read_obj(struct mesh *m, const char *text, const struct vec3 *tangent, struct err *e)
{
    char path[] = "/tmp/nacre_mesh_XXXXXX";
    const int fd = mkstemp(path);
    assert_true(fd >= 0 && write(fd, text, strlen(text)) == (ssize_t)strlen(text));
    close(fd);
    const bool ok = mesh_read_obj(m, path, 1, tangent, e);
    unlink(path);
    if (!ok)
        memmove(e->msg, e->msg + strlen(path), strlen(e->msg + strlen(path)) + 1);
    return ok;
}

TEST(a_quad_is_a_plane)
{
    struct light light = {.at = {0.03, 0.05, 0.45}, .power = 1, .tint = {1, 1, 1}};
    struct object plane = fixture_object(SHAPE_PLANE), mesh = fixture_object(SHAPE_MESH);
    struct err e;
    assert_true(read_obj(&mesh.shape.mesh, quad, NULL, &e));
    assert_int_equal(mesh.shape.mesh.n_triangles, 2);
    assert_int_equal(mesh.shape.mesh.n_vertices, 4);
    struct image im[2];
    struct object *both[2] = {&plane, &mesh};
    for (int k = 0; k < 2; k++) {
        struct table t;
        assert_true(fixture_lcd(&t, 33, 0.35, 3, &e));
        material_take_table(&both[k]->material, &t, 0.04);
        struct scene s = fixture_scene(both[k], &light, 1);
        if (k)
            compare_backends(&s);
        assert_true(cpu_render(&s, false, &im[k], &e));
        material_finish(&both[k]->material);
    }
    assert_near(rel_rmse(&im[1], &im[0]), 0, 1e-6);
    image_finish(&im[0]);
    image_finish(&im[1]);
    mesh_finish(&mesh.shape.mesh);
}

// A ball of n x 2n quads with texture coordinates and no normals.
static char *ball(int n, double radius)
{
    char *text = NULL;
    size_t size = 0;
    FILE *f = open_memstream(&text, &size);
    for (int j = 0; j <= n; j++)
        for (int i = 0; i <= 2 * n; i++) {
            const double th = M_PI * j / n, ph = M_PI * i / n - M_PI;
            fprintf(f, "v %.9g %.9g %.9g\nvt %g %g\nvn %.9g %.9g %.9g\n",
                    radius * sin(th) * sin(ph), radius * cos(th), radius * sin(th) * cos(ph),
                    i / (2.0 * n), 1 - j / (double)n, sin(th) * sin(ph), cos(th),
                    sin(th) * cos(ph));
        }
    for (int j = 0; j < n; j++)
        for (int i = 0; i < 2 * n; i++) {
            const int a = j * (2 * n + 1) + i + 1, b = a + 2 * n + 1;
            fprintf(f, "f %d/%d/%d %d/%d/%d %d/%d/%d %d/%d/%d\n", a, a, a, b, b, b, b + 1, b + 1,
                    b + 1, a + 1, a + 1, a + 1);
        }
    fclose(f);
    return text;
}

TEST(a_fine_ball_of_triangles_is_a_sphere)
{
    struct light light = {.at = {0.1, 0.2, 0.45}, .power = 1, .tint = {1, 1, 1}};
    struct object sphere = fixture_object(SHAPE_SPHERE), mesh = fixture_object(SHAPE_MESH);
    struct err e;
    char *text = ball(90, sphere.shape.radius_m);
    assert_true(read_obj(&mesh.shape.mesh, text, NULL, &e));
    free(text);
    struct image im[2];
    struct object *both[2] = {&sphere, &mesh};
    for (int k = 0; k < 2; k++) {
        both[k]->material.diffuse[0] = 0.5;
        both[k]->material.diffraction = DIFFRACTION_STAM;
        both[k]->material.rainbow = (struct rainbow){1e-6, 1, {1, 1, 1}};
        struct scene s = fixture_scene(both[k], &light, 1);
        if (k)
            compare_backends(&s);
        assert_true(cpu_render(&s, false, &im[k], &e));
    }
    assert_near(rel_rmse(&im[1], &im[0]), 0, 0.05); // the silhouette is a polygon's
    image_finish(&im[0]);
    image_finish(&im[1]);
    mesh_finish(&mesh.shape.mesh);
}

TEST(a_tree_finds_what_trying_all_triangles_finds)
{
    struct mesh m;
    struct err e;
    char *text = ball(20, 1);
    assert_true(read_obj(&m, text, NULL, &e));
    free(text);
    unsigned seed = 7;
    for (int k = 0; k < 500; k++) {
        double x[6];
        for (int c = 0; c < 6; c++)
            x[c] = 3 * (rand_r(&seed) / (double)RAND_MAX - .5);
        const struct vec3 from = v3(x[0], x[1], x[2] + 2), dir = v3_unit(v3(x[3], x[4], x[5] - 1));
        struct mesh_hit by_tree, one;
        struct mesh all = m;
        struct mesh_node flat = m.node[0];
        flat.first = 0;
        flat.count = m.n_triangles;
        all.node = &flat;
        const bool hit = mesh_hit(&m, from, dir, &by_tree);
        assert_int_equal(hit, mesh_hit(&all, from, dir, &one));
        if (hit)
            assert_near(by_tree.distance, one.distance, 1e-14);
    }
    mesh_finish(&m);
}

TEST(tangents_follow_the_texture_or_the_scene)
{
    struct mesh m;
    struct err e;
    assert_true(read_obj(&m, quad, NULL, &e));
    assert_near(m.vertex[0].t.x, 1, 1e-12);
    assert_near(m.vertex[0].n.z, 1, 1e-12);
    mesh_finish(&m);
    const struct vec3 up = v3(0, 1, 0.5);
    assert_true(read_obj(&m, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", &up, &e));
    assert_near(m.vertex[0].t.y, 1, 1e-12);
    mesh_finish(&m);
}

TEST(bad_meshes_name_the_line)
{
    static const struct {
        const char *text, *says;
    } bad[] = {
        {"v 0 0 0\n", ": holds no triangles"},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
         ": has no texture coordinates to take tangents from: give the mesh some, or 'tangents: "
         "fixed' in the scene"},
        {"v 0 0 nan\n", ":1: holds NaN or infinity"},
        {"v 0 0\n", ":1: expected numbers"},
        {"v 0 0 0\nf 1 2 3\n", ":2: a corner that does not exist"},
        {"v 0 0 0\nf 1 0 1\n", ":2: a corner that does not exist"},
        {"v 0 0 0\nv 1 0 0\nf 1 2\n", ":3: a face needs 3 corners"},
        {"v 0 0 0\nv 1 0 0\nf 1 x 2\n", ":3: a corner that does not exist"},
    };
    struct mesh m;
    struct err e;
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        assert_false(read_obj(&m, bad[k].text, NULL, &e));
        assert_string_equal(e.msg, bad[k].says);
        assert_int_equal(e.code, ERR_DATA);
    }
    assert_false(mesh_read(&m, "/nowhere.obj", 1, NULL, &e));
    assert_int_equal(e.code, ERR_FILE);
}

TEST_MAIN(cmocka_unit_test(a_quad_is_a_plane),
          cmocka_unit_test(a_fine_ball_of_triangles_is_a_sphere),
          cmocka_unit_test(a_tree_finds_what_trying_all_triangles_finds),
          cmocka_unit_test(tangents_follow_the_texture_or_the_scene),
          cmocka_unit_test(bad_meshes_name_the_line))

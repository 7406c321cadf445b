// test_gltf.c - glTF meshes: as the same triangles in OBJ, placed by nodes, and files that are
// wrong.
#include "tests/run.h"
#include "tests/test.h"

#include "render/mesh.h"
#include <stdarg.h>

// A quad of two triangles: positions, normals, tangents, texture coordinates, indices.
static const float corners[4][3] = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}};
static const float normals[4][3] = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
static const float tangents[4][4] = {{0, 1, 0, 1}, {0, 1, 0, 1}, {0, 1, 0, 1}, {0, 1, 0, 1}};
static const float st[4][2] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
static const uint16_t indices[6] = {0, 1, 2, 0, 2, 3};

struct quad {
    unsigned char bytes[256];
    size_t size;
};

static struct quad quad(void)
{
    struct quad q = {0};
    const struct {
        const void *at;
        size_t size;
    } part[] = {{corners, sizeof corners},
                {normals, sizeof normals},
                {tangents, sizeof tangents},
                {st, sizeof st},
                {indices, sizeof indices}}; // at 0, 48, 96, 160, 192
    for (int k = 0; k < 5; k++) {
        memcpy(q.bytes + q.size, part[k].at, part[k].size);
        q.size += part[k].size;
    }
    return q;
}

static char *base64(const unsigned char *p, size_t n)
{
    static const char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    char *text = malloc(n / 3 * 4 + 5), *to = text;
    assert_non_null(text);
    for (size_t k = 0; k < n; k += 3) {
        const unsigned bits = (unsigned)p[k] << 16 | (k + 1 < n ? (unsigned)p[k + 1] << 8 : 0) |
                              (k + 2 < n ? p[k + 2] : 0);
        for (int c = 0; c < 4; c++)
            *to++ = k + (size_t)c > n ? '=' : digit[bits >> (18 - 6 * c) & 63];
    }
    *to = 0;
    return text;
}

// The quad's glTF with `attributes` beside POSITION and `node` beside the mesh.
__attribute__((noinline)) static char *text_of(const char *buffer, const char *attributes,
                                               const char *node)
{
    char *text = NULL;
    size_t size = 0;
    FILE *f = open_memstream(&text, &size);
    fprintf(
        f,
        "{\"asset\": {\"version\": \"2.0\"}, \"scenes\": [{\"nodes\": [0]}],\n"
        "\"nodes\": [{\"children\": [1]}, {\"mesh\": 0%s}],\n"
        "\"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0%s}, \"indices\": 4}]}],\n"
        "\"accessors\": ["
        "{\"bufferView\": 0, \"componentType\": 5126, \"count\": 4, \"type\": \"VEC3\"},\n"
        "{\"bufferView\": 0, \"byteOffset\": 48, \"componentType\": 5126, \"count\": 4, "
        "\"type\": \"VEC3\"},\n"
        "{\"bufferView\": 0, \"byteOffset\": 96, \"componentType\": 5126, \"count\": 4, "
        "\"type\": \"VEC4\"},\n"
        "{\"bufferView\": 0, \"byteOffset\": 160, \"componentType\": 5126, \"count\": 4, "
        "\"type\": \"VEC2\"},\n"
        "{\"bufferView\": 0, \"byteOffset\": 192, \"componentType\": 5123, \"count\": 6, "
        "\"type\": \"SCALAR\"}],\n"
        "\"bufferViews\": [{\"buffer\": 0, \"byteLength\": 204}], \"buffers\": [{%s}]}",
        node, attributes, buffer);
    fclose(f);
    return text;
}

static void write_file(const char *path, const void *data, size_t size)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(data, 1, size, f), size);
    assert_int_equal(fclose(f), 0);
}

static const char path[] = "mesh.gltf", glb[] = "mesh.glb";

static bool read_text(const char *text, const struct vec3 *tangent, struct mesh *m, struct err *e)
{
    write_file(path, text, strlen(text));
    const bool ok = mesh_read(m, path, 1, tangent, e);
    return ok;
}

// The quad with its data in the text.
static bool read_quad(const char *attributes, const char *node, const struct vec3 *tangent,
                      struct mesh *m, struct err *e)
{
    const struct quad q = quad();
    char *data = base64(q.bytes, q.size), *buffer = malloc(strlen(data) + 80);
    assert_non_null(buffer);
    sprintf(buffer, "\"uri\": \"data:application/octet-stream;base64,%s\"", data);
    char *text = text_of(buffer, attributes, node);
    const bool ok = read_text(text, tangent, m, e);
    free(text);
    free(buffer);
    free(data);
    return ok;
}

#define ALL ", \"NORMAL\": 1, \"TANGENT\": 2, \"TEXCOORD_0\": 3"

TEST(a_quad_has_its_vertices_normals_and_tangents)
{
    enter_scratch("gltf");
    struct mesh m;
    struct err e;
    if (!read_quad(ALL, "", NULL, &m, &e))
        fail_msg("%s", e.msg);
    assert_int_equal(m.n_vertices, 4);
    assert_int_equal(m.n_triangles, 2);
    assert_near(m.vertex[2].at_m.x, 2, 0);
    assert_near(m.vertex[2].at_m.y, 1, 0);
    assert_near(m.vertex[1].n.z, 1, 0);
    assert_near(m.vertex[1].t.y, 1, 0); // the file's, not those of its texture coordinates
    assert_near(m.vertex[2].s, 1, 0);
    assert_near(m.vertex[2].v, 1, 0); // upwards
    mesh_finish(&m);
}

TEST(tangents_that_are_missing_follow_the_texture_or_the_scene)
{
    enter_scratch("gltf");
    struct mesh m;
    struct err e;
    const struct vec3 up = v3(0, 3, 1);
    assert_true(read_quad(", \"TEXCOORD_0\": 3", "", NULL, &m, &e));
    assert_near(m.vertex[0].n.z, 1, 1e-12);
    assert_near(m.vertex[0].t.x, 1, 1e-12);
    mesh_finish(&m);
    assert_true(read_quad("", "", &up, &m, &e));
    assert_near(m.vertex[0].t.y, 1, 1e-12);
    mesh_finish(&m);
    assert_false(read_quad("", "", NULL, &m, &e));
    assert_string_equal(e.msg, "mesh.gltf: has no texture coordinates to take "
                               "tangents from: give the mesh some, or 'tangents: fixed' in the "
                               "scene");
    assert_int_equal(e.code, ERR_DATA);
}

TEST(nodes_place_a_mesh)
{
    enter_scratch("gltf");
    struct mesh m;
    struct err e;
    // A quarter turn about y takes x to -z; scaled before it, moved after.
    assert_true(read_quad(ALL,
                          ", \"rotation\": [0, 0.7071067811865476, 0, 0.7071067811865476], "
                          "\"scale\": [3, 1, 1], \"translation\": [0, 0, 7]",
                          NULL, &m, &e));
    assert_near(m.vertex[1].at_m.z, 1, 1e-12);
    assert_near(m.vertex[1].at_m.x, 0, 1e-12);
    assert_near(m.vertex[1].n.x, 1, 1e-12);
    mesh_finish(&m);
    // A mirror image keeps its front: corners go round the other way.
    assert_true(
        read_quad(ALL, ", \"matrix\": [-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]", NULL, &m, &e));
    const int *k = m.triangle[0];
    const struct vec3 a = v3_sub(m.vertex[k[1]].at_m, m.vertex[k[0]].at_m);
    const struct vec3 b = v3_sub(m.vertex[k[2]].at_m, m.vertex[k[0]].at_m);
    assert_true(v3_cross(a, b).z > 0);
    assert_near(m.vertex[0].n.z, 1, 1e-12);
    mesh_finish(&m);
}

TEST(a_binary_file_and_one_beside_hold_the_same)
{
    enter_scratch("gltf");
    const struct quad q = quad();
    struct mesh m;
    struct err e;
    unsigned char file[4096] = "glTF\2\0\0\0";
    char *text = text_of("\"byteLength\": 204", ALL, "");
    const uint32_t n = (uint32_t)(strlen(text) + 3) / 4 * 4, size = (uint32_t)q.size;
    memset(file + 20, ' ', n);
    memcpy(file + 20, text, strlen(text));
    memcpy(file + 12, &n, 4);
    memcpy(file + 16, "JSON", 4);
    memcpy(file + 20 + n, &size, 4);
    memcpy(file + 24 + n, "BIN", 4);
    memcpy(file + 28 + n, q.bytes, q.size);
    write_file(glb, file, 28 + n + q.size);
    if (!mesh_read(&m, glb, 2, NULL, &e))
        fail_msg("%s", e.msg);
    assert_near(m.vertex[2].at_m.x, 4, 0);
    mesh_finish(&m);
    write_file(glb, file, 28 + n + q.size - 1);
    assert_false(mesh_read(&m, glb, 1, NULL, &e));
    assert_string_equal(e.msg, "mesh.glb: is cut off");
    free(text);

    write_file("nacre test mesh.bin", q.bytes, q.size);
    text = text_of("\"uri\": \"nacre%20test%20mesh.bin\"", ALL, "");
    assert_true(read_text(text, NULL, &m, &e));
    mesh_finish(&m);
    unlink("nacre test mesh.bin");
    assert_false(read_text(text, NULL, &m, &e));
    assert_int_equal(e.code, ERR_FILE);
    assert_non_null(strstr(e.msg, "nacre test mesh.bin: cannot open: No such file"));
    free(text);
}

// Replaces the first `from` of the quad's text, data inside, by `to`, and reads that.
static bool read_spoilt(const char *from, const char *to, struct err *e)
{
    struct quad q = quad();
    const float none = NAN;
    if (!*from)
        memcpy(q.bytes + 16, &none, 4);
    char *data = base64(q.bytes, q.size), *buffer = malloc(strlen(data) + 80);
    assert_non_null(buffer);
    sprintf(buffer, "\"uri\": \"data:application/octet-stream;base64,%s\"", data);
    char *text = text_of(buffer, ALL, ""), *all = NULL;
    const char *at = strstr(text, from);
    assert_non_null(at);
    assert_true(asprintf(&all, "%.*s%s%s", (int)(at - text), text, to, at + strlen(from)) > 0);
    struct mesh m;
    const bool ok = read_text(all, NULL, &m, e);
    if (ok)
        mesh_finish(&m);
    free(all);
    free(text);
    free(buffer);
    free(data);
    return ok;
}

TEST(bad_files_say_what_is_wrong)
{
    enter_scratch("gltf");
    static const struct {
        const char *from, *to, *says;
    } bad[] = {
        {"", "", ": vertex 2 holds NaN or infinity"},
        {"\"asset\"", "asset", ":1: string or '}' expected near 'asset'"},
        {"\"asset\"", "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"], \"asset\"",
         ": requires KHR_draco_mesh_compression, which is not read"},
        {"\"nodes\": [0]", "\"nodes\": [9]", ": refers to nodes[9], which does not exist"},
        {"\"scenes\"", "\"none\"", ": refers to scenes[0], which does not exist"},
        {"\"children\": [1]", "\"children\": [0]", ": nodes that hold themselves, or are too many"},
        {"\"mesh\": 0", "\"mesh\": -3", ": refers to meshes[-1], which does not exist"},
        {"\"count\": 4", "\"count\": 400", ": accessor 0 reaches beyond its data"},
        {"\"count\": 4", "\"count\": 3", ": NORMAL has 4 elements for 3 vertices"},
        {"\"byteOffset\": 192", "\"byteOffset\": 96", ": an index without its vertex"},
        {"\"VEC3\"", "\"VEC2\"", ": accessor 0 is not a VEC3 of known numbers"},
        {"\"componentType\": 5126", "\"sparse\": {}, \"componentType\": 5126",
         ": has a sparse accessor: export the mesh without"},
        {"\"byteLength\": 204", "\"byteLength\": 205", ": accessor 0 reaches beyond its data"},
        {";base64,", ";base64,!", ": holds a buffer that is not base64"},
        {"\"uri\": \"data:", "\"uri\": \"https://x/", ": wants 'https://x/"},
        {"\"uri\"", "\"uro\"", ": a buffer without its data"},
        {"\"indices\": 4", "\"mode\": 1", ": holds no triangles"},
    };
    struct err e;
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        if (read_spoilt(bad[k].from, bad[k].to, &e))
            fail_msg("was read: %s", bad[k].says);
        if (!strstr(e.msg, bad[k].says))
            fail_msg("'%s' says '%s'", bad[k].says, e.msg);
        assert_int_equal(e.code, ERR_DATA);
    }
}

TEST(other_files_are_refused_by_their_name)
{
    enter_scratch("gltf");
    struct mesh m;
    struct err e;
    assert_false(mesh_read(&m, "thing.stl", 1, NULL, &e));
    assert_string_equal(e.msg, "thing.stl: a mesh is a .obj, .gltf or .glb file");
}

TEST_MAIN(cmocka_unit_test(a_quad_has_its_vertices_normals_and_tangents),
          cmocka_unit_test(tangents_that_are_missing_follow_the_texture_or_the_scene),
          cmocka_unit_test(nodes_place_a_mesh),
          cmocka_unit_test(a_binary_file_and_one_beside_hold_the_same),
          cmocka_unit_test(bad_files_say_what_is_wrong),
          cmocka_unit_test(other_files_are_refused_by_their_name))

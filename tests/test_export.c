// test_export.c - exported materials, read back as others read them.
#include "tests/test.h"

#include "core/imgfile.h"
#include "core/infile.h"
#include "core/mem.h"
#include "render/export.h"
#include "render/gl.h"
#include "render/shaders.h"
#include "tests/run.h"

// A smooth pattern, so that coarse formats can hold it; `count` tables with a basis over w.
static struct material material_new(int n, int power, enum table_basis basis, int count)
{
    struct material m;
    struct table t;
    struct err e = {0};
    material_init(&m);
    assert_true(table_init(&t, n, 1, power, count, &e));
    t.is_rgb = true;
    t.basis = basis;
    t.w_min = 0.5;
    t.w_max = 2;
    for (int k = 0; k < count; k++)
        for (int q = 0; q < n * n; q++) {
            const double u = table_node(&t, q % n), v = table_node(&t, q / n);
            for (int c = 0; c < 3; c++)
                t.tab[3 * (k * n * n + q) + c] =
                    (float)(exp(-(u * u + v * v) * (2 + c)) * (1 + 0.3 * u) / (1 + 3 * k));
        }
    if (basis == TABLE_POD) {
        t.nw = 64;
        t.curve = xcalloc(64 * (size_t)count, sizeof *t.curve);
        for (int k = 0; k < 64 * count; k++)
            t.curve[k] = k < 64 ? 1 : sin(0.1 * k);
    }
    material_take_table(&m, &t, 0.04);
    return m;
}

static struct vec3 outgoing(int i, int j, int side)
{
    const double x = 0.7 * (2.0 * i / (side - 1) - 1), y = 0.7 * (2.0 * j / (side - 1) - 1);
    return v3(x, y, sqrt(1 - x * x - y * y));
}

// The snippet as its user would have it: pasted above a main() that draws wo over the picture.
static void draw_snippet(const char *path, const char *texture, int layers, struct vec3 wi,
                         int side, struct image *out)
{
    struct err e = {0};
    struct image im;
    size_t size;
    char *snippet = infile_slurp(path, 1 << 20, &size, &e);
    assert_non_null(snippet);
    assert_true(image_read(&im, texture, &e));
    const char *vertex[] = {shader_screen, NULL};
    const char *fragment[] = {
        snippet,
        "uniform vec3 wi;\nuniform float side;\nout vec4 color;\n"
        "void main()\n{\n"
        "    vec2 p = 0.7 * (2.0 * (gl_FragCoord.xy - 0.5) / (side - 1.0) - 1.0);\n"
        "    vec3 wo = vec3(p, sqrt(1.0 - dot(p, p)));\n"
        "    color = vec4(nacre_diffraction(wi, wo), 1.0);\n}\n",
        NULL};
    const GLuint program = gl_program("snippet", "", vertex, fragment, &e);
    if (!program)
        fail_msg("%s", e.msg);
    struct gl_target target;
    assert_true(gl_target_init(&target, side, side, &e));
    const GLuint tex = gl_texture(GL_TEXTURE_2D_ARRAY, GL_LINEAR);
    glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_RGB32F, im.w, im.h / layers, layers, 0, GL_RGB,
                 GL_FLOAT, im.px);
    glUseProgram(program);
    gl_bind(program, "nacre_table", 0, GL_TEXTURE_2D_ARRAY, tex);
    gl_set3f(program, "wi", (double[]){wi.x, wi.y, wi.z});
    gl_set1f(program, "side", side);
    GLuint vertices; // none, but a core context wants an array bound
    glGenVertexArrays(1, &vertices);
    glBindVertexArray(vertices);
    glBindFramebuffer(GL_FRAMEBUFFER, target.frame);
    glViewport(0, 0, side, side);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    if (!gl_target_read(&target, out, &e))
        fail_msg("%s", e.msg);
    gl_target_finish(&target);
    glDeleteVertexArrays(1, &vertices);
    glDeleteTextures(1, &tex);
    glDeleteProgram(program);
    image_finish(&im);
    free(snippet);
}

TEST(the_glsl_snippet_draws_what_the_material_is)
{
    enum { SIDE = 33 };
    static const struct {
        int power;
        enum table_basis basis;
        int count;
    } cases[] = {{1, TABLE_PLAIN, 1},
                 {5, TABLE_PLAIN, 1},
                 {1, TABLE_POD, 3},
                 {3, TABLE_TAYLOR, 2},
                 {1, TABLE_CHEBYSHEV, 3}};
    struct gl_context *gl;
    struct err e = {0};
    if (!gl_context_open(&gl, &e)) {
        print_message("skipped: %s\n", e.msg);
        skip();
    }
    enter_scratch("export_glsl");
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct material m = material_new(65, cases[k].power, cases[k].basis, cases[k].count);
        struct export_loss loss;
        struct image drawn;
        assert_true(export_glsl(&m, "s.glsl", &loss, &e));
        const struct vec3 wi = v3_unit(v3(0.2, -0.3, 1));
        draw_snippet("s.glsl", "s.pfm", cases[k].count, wi, SIDE, &drawn);
        double diff = 0, norm = 0;
        for (int j = 0; j < SIDE; j++)
            for (int i = 0; i < SIDE; i++) {
                double want[3];
                material_diffraction(&m, wi, outgoing(i, j, SIDE), want);
                for (int c = 0; c < 3; c++) {
                    diff += pow(drawn.px[3 * (j * SIDE + i) + c] - want[c], 2);
                    norm += want[c] * want[c];
                }
            }
        if (!(norm > 0 && sqrt(diff / norm) < 2e-3)) // 8-bit weights of a texture unit
            fail_msg("case %zu: relative L2 error %g", k, sqrt(diff / norm));
        image_finish(&drawn);
        material_finish(&m);
    }
    gl_context_close(gl);
}

// The format, read independently: name, type, shape, offset of every field.
struct reader {
    const unsigned char *at, *all;
};

static uint64_t take(struct reader *r, int bytes)
{
    uint64_t v = 0;
    for (int k = 0; k < bytes; k++)
        v |= (uint64_t)*r->at++ << (8 * k);
    return v;
}

static const float *find_field(const unsigned char *all, const char *name, int type,
                               uint64_t shape[5])
{
    struct reader r = {all, all};
    assert_memory_equal(r.at, "tensor_file\0\1\0", 14);
    r.at += 14;
    for (uint64_t n = take(&r, 4); n > 0; n--) {
        const size_t length = (size_t)take(&r, 2);
        const bool mine = length == strlen(name) && !memcmp(r.at, name, length);
        r.at += length;
        const int ndim = (int)take(&r, 2), is = (int)take(&r, 1);
        const uint64_t offset = take(&r, 8);
        for (int d = 0; d < ndim; d++)
            shape[d] = take(&r, 8);
        if (mine) {
            assert_int_equal(is, type);
            return (const float *)(const void *)(all + offset);
        }
    }
    fail_msg("no field %s", name);
    return NULL;
}

static float sample(const float *at) // fields need not be aligned
{
    float x;
    memcpy(&x, at, sizeof x);
    return x;
}

TEST(the_bsdf_file_holds_f_cos_at_its_nodes)
{
    enter_scratch("export_bsdf");
    struct material m = material_new(65, 1, TABLE_PLAIN, 1);
    struct export_loss loss;
    struct err e = {0};
    const struct export_bsdf how = {9, 5, 32};
    assert_true(export_bsdf(&m, &how, "m.bsdf", &loss, &e));
    assert_true(loss.error < 0.05);
    size_t size;
    unsigned char *all = (unsigned char *)infile_slurp("m.bsdf", 1 << 26, &size, &e);
    assert_non_null(all);
    uint64_t shape[5];
    const char *note = (const char *)find_field(all, "description", 1, shape);
    assert_int_equal(shape[0], strlen(loss.what));
    assert_memory_equal(note, loss.what, shape[0]);
    const float *phi = find_field(all, "phi_i", 10, shape);
    assert_int_equal(shape[0], 9);
    const float *theta = find_field(all, "theta_i", 10, shape);
    assert_int_equal(shape[0], 5);
    const float *ndf = find_field(all, "ndf", 10, shape);
    const float *sigma = find_field(all, "sigma", 10, shape);
    find_field(all, "jacobian", 1, shape);
    find_field(all, "luminance", 10, shape);
    assert_int_equal(shape[3], 32);
    find_field(all, "vndf", 10, shape);
    const float *rgb = find_field(all, "rgb", 10, shape);
    static const uint64_t want_shape[5] = {9, 5, 3, 32, 32};
    assert_memory_equal(shape, want_shape, sizeof want_shape);
    for (int k = 0; k < 9 * 5 * 32 * 32; k += 37) {
        const int i = k % 32, j = k / 32 % 32, t = k / 1024 % 5, p = k / 5120;
        const double ti = sample(theta + t), pi = sample(phi + p);
        const double tm = pow(i / 31.0, 2) * M_PI / 2, pm = (2 * j / 31.0 - 1) * M_PI;
        const struct vec3 wi = v3(sin(ti) * cos(pi), sin(ti) * sin(pi), cos(ti));
        const struct vec3 wm = v3(sin(tm) * cos(pm), sin(tm) * sin(pm), cos(tm));
        const struct vec3 wo = v3_sub(v3_scale(2 * v3_dot(wi, wm), wm), wi);
        if (v3_dot(wi, wm) < 0.01 || wo.z < 0.01)
            continue;
        double f[3]; // f cos_i, so turned round it is f cos_o
        material_diffraction(&m, wo, wi, f);
        for (int c = 0; c < 3; c++) {
            const double stored = sample(rgb + ((p * 5 + t) * 3 + c) * 1024 + j * 32 + i);
            assert_near(stored * sample(ndf) / (4 * sample(sigma)), f[c], 1e-5 * f[c] + 1e-7);
        }
    }
    free(all);
    material_finish(&m);
}

TEST(the_merl_file_holds_f_of_its_slice)
{
    enter_scratch("export_merl");
    struct material m = material_new(129, 1, TABLE_PLAIN, 1);
    struct export_loss loss;
    struct err e = {0};
    assert_true(export_merl(&m, 0.5, "m.binary", &loss, &e));
    assert_true(loss.error > 0.01 && loss.error < 0.5); // 1 + 0.3 u is not isotropic
    size_t size;
    char *all = infile_slurp("m.binary", 1 << 26, &size, &e), *note;
    assert_non_null(all);
    assert_int_equal(size, 12 + 3 * 8 * 90 * 90 * 180);
    static const int32_t dims[3] = {90, 90, 180};
    assert_memory_equal(all, dims, sizeof dims);
    static const double scale[3] = {1 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0};
    const int i = 40, j = 10, k = 33; // one bin, by hand
    const double th = pow(40.5 / 90, 2) * M_PI / 2, td = 10.5 / 90 * M_PI / 2,
                 pd = 33.5 / 180 * M_PI;
    const struct vec3 h = v3(sin(th) * cos(0.5), sin(th) * sin(0.5), cos(th));
    const struct vec3 bi = v3(-sin(0.5), cos(0.5), 0), tg = v3_cross(bi, h); // b = n x t
    const struct vec3 wi = v3_add(v3_scale(cos(td), h), v3_add(v3_scale(sin(td) * cos(pd), tg),
                                                               v3_scale(sin(td) * sin(pd), bi)));
    const struct vec3 wo = v3_sub(v3_scale(2 * cos(td), h), wi);
    double f[3];
    material_diffraction(&m, wi, wo, f);
    for (int c = 0; c < 3; c++) {
        double stored;
        memcpy(&stored, all + 12 + 8 * (c * 90 * 90 * 180 + (i * 90 + j) * 180 + k), 8);
        assert_near(stored * scale[c], f[c] / wi.z, 1e-9);
    }
    note = infile_slurp("m.binary.txt", 4096, &size, &e);
    assert_string_equal(note, loss.what);
    free(note);
    free(all);
    material_finish(&m);
}

TEST(the_command_exports_and_refuses)
{
    static const struct {
        const char *words;
        int status;
        const char *says;
    } bad[] = {
        {"export t.exr --to obj -o x", 2, "--to"},
        {"export none.exr --to glsl -o x.glsl", 5, "none.exr"},
        {"export t.exr --to bsdf --resolution 1 -o x.bsdf", 3, "bad size 17 x 8 x 1"},
        {"export t.exr --to bsdf --resolution 9999 -o x.bsdf", 3, "is too large"},
        {"export t.exr --to merl --r0 2 -o x.bin", 3, "bad R0 2"},
        {"export t.exr --to merl --count 2 -o x.bin", 3, "--count 2: t.exr has 1 tables"},
        {"export t.exr --to merl -o none/x.bin", 5, "no folder 'none'"},
    };
    enter_scratch("export_cmd");
    struct table t;
    struct err e = {0};
    assert_true(table_init(&t, 9, 0.3, 1, 1, &e));
    assert_true(table_write(&t, "t.exr", &e));
    table_finish(&t);
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        const struct run r = run_nacre(bad[k].words);
        if (r.status != bad[k].status || !strstr(r.err, bad[k].says) || count_errors(r.err) != 1)
            fail_msg("%s: exit %d, %s", bad[k].words, r.status, r.err);
    }
    const struct run r = run_nacre("export t.exr --to glsl -o out.glsl");
    assert_int_equal(r.status, 0);
    assert_non_null(strstr(r.out, "Lost: nothing of the table but its variance"));
    assert_int_equal(access("out.pfm", R_OK), 0);
}

TEST_MAIN(cmocka_unit_test(the_glsl_snippet_draws_what_the_material_is),
          cmocka_unit_test(the_bsdf_file_holds_f_cos_at_its_nodes),
          cmocka_unit_test(the_merl_file_holds_f_of_its_slice),
          cmocka_unit_test(the_command_exports_and_refuses))

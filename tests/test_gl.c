// test_gl.c - a driver that cannot do what is needed, and one that goes away: messages, no crash.
#include "tests/test.h"

#include "render/gl_progress.h"
#include "tests/render_fixture.h"

static struct gl_context *context_or_skip(void)
{
    struct gl_context *c = NULL;
    struct err e;
    if (!gl_context_open(&c, &e)) {
        assert_int_equal(e.code, ERR_DEVICE);
        print_message("skipped: %s\n", e.msg);
        skip();
    }
    return c;
}

TEST(a_driver_without_float_textures_is_refused)
{
    gl_context_close(context_or_skip());
    struct gl_context *c = NULL;
    struct err e;
    gl_picture_format = GL_RGB9_E5; // which nothing can draw to
    const bool opened = gl_context_open(&c, &e);
    gl_picture_format = GL_RGBA32F;
    assert_false(opened);
    assert_int_equal(e.code, ERR_DEVICE);
    assert_non_null(strstr(e.msg, "cannot draw to float textures; use --backend cpu"));
}

TEST(a_context_that_goes_away_is_told_not_used)
{
    struct gl_context *c = context_or_skip();
    struct light light = {.at = {0.03, 0.05, 0.45}, .power = 1, .tint = {1, 1, 1}};
    struct object o = fixture_object(SHAPE_DISC);
    struct scene s = fixture_scene(&o, &light, 1);
    struct gl_renderer *r = NULL;
    struct gl_target t = {0};
    struct gl_progress p = {0};
    struct image im = {0};
    struct err e;
    assert_true(gl_renderer_open(&r, &s, &e) && gl_target_init(&t, 64, 48, &e) &&
                gl_progress_init(&p, &s, 2, 64, 48, &e));
    assert_true(gl_renderer_draw(r, &s, &t, &e) && gl_progress_step(&p, r, &e));
    gl_context_close(c);
    assert_false(gl_renderer_draw(r, &s, &t, &e));
    assert_string_equal(e.msg, "OpenGL's context is gone; render again, or with --backend cpu");
    assert_int_equal(e.code, ERR_DEVICE);
    assert_false(gl_progress_step(&p, r, &e));
    assert_false(gl_target_read(&t, &im, &e));
    assert_int_equal(e.code, ERR_DEVICE);
    gl_progress_finish(&p);
    gl_target_finish(&t);
    gl_renderer_close(r);
    struct image again = {0};
    assert_true(gl_render(&s, &again, NULL, &e)); // a new context draws as before
    image_finish(&again);
}

// What the command says where there is no OpenGL to be had, by Mesa's own switches.
TEST(the_command_says_what_to_do_without_opengl)
{
    static const struct {
        const char *env, *says;
    } drivers[] = {
        {"MESA_GL_VERSION_OVERRIDE=3.2", "no OpenGL 3.3 core context"},
        {"__EGL_VENDOR_LIBRARY_FILENAMES=/dev/null", "no OpenGL: EGL has no usable display"},
    };
    gl_context_close(context_or_skip());
    for (size_t k = 0; k < sizeof drivers / sizeof *drivers; k++) {
        char line[600], said[400] = "";
        snprintf(line, sizeof line,
                 "env %s %s/nacre render %s/rigs/scenes/plane.yaml -o /tmp/nacre_test_gl.exr 2>&1",
                 drivers[k].env, BIN_DIR, SOURCE_DIR);
        FILE *f = popen(line, "r");
        assert_non_null(f);
        while (!strstr(said, drivers[k].says) && fgets(said, sizeof said, f))
            ;
        const bool right = strstr(said, drivers[k].says) && strstr(said, "--backend cpu");
        while (fgets(said, sizeof said, f))
            ;
        const int status = pclose(f);
        if (WEXITSTATUS(status) == 0) // a driver that does not know Mesa's switches
            continue;
        assert_int_equal(WEXITSTATUS(status), 4);
        assert_true(right);
        assert_int_not_equal(access("/tmp/nacre_test_gl.exr", F_OK), 0);
    }
}

TEST_MAIN(cmocka_unit_test(a_driver_without_float_textures_is_refused),
          cmocka_unit_test(a_context_that_goes_away_is_told_not_used),
          cmocka_unit_test(the_command_says_what_to_do_without_opengl))

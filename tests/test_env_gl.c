// test_env_gl.c - R17's filters on OpenGL give what they give on the processor.
#include "tests/env_case.h"

#include "render/env_gl.h"
#include "render/gl.h"

static struct factors factors_of(const struct table *t, int rank, bool align)
{
    struct factors f;
    struct err e = {0};
    assert_true(factor(&f, t, rank, align, false, &e));
    return f;
}

TEST(shaders_and_processor_agree)
{
    struct gl_context *gl;
    struct err e = {0};
    if (!gl_context_open(&gl, &e)) {
        print_message("skipped: %s\n", e.msg);
        skip();
    }
    struct environment env = case_environment(64, &case_axes);
    struct table t = case_table(81, .4, 1);
    for (int q = 0; q < 6; q++) {
        const struct frame frame = case_frame(.3, .8, -.2, -.1, q > 3 ? 1 : .4, q > 3 ? 0 : .9);
        struct factors f = factors_of(&t, q == 1 ? 3 : 1, q == 2);
        if (q == 3 || q == 4) // the same filters as a sum, or one of them
            f.kind = q == 3 ? FACTOR_SUM : FACTOR_LINE;
        const struct separable how = {192, 48, q % 2 == 0};
        struct image cpu, drawn;
        assert_true(env_separable(&f, &env, &frame, &how, &cpu, &e));
        assert_true(env_gl_separable(&f, &env, &frame, &how, &drawn, &e));
        double wrong = 0, all = 0, worst = 0, peak = 0;
        for (int k = 0; k < 3 * cpu.w * cpu.h; k++) {
            const double want = (double)cpu.px[k], d = (double)drawn.px[k] - want;
            wrong += d * d;
            all += want * want;
            worst = fmax(worst, fabs(d));
            peak = fmax(peak, want);
        }
        print_message("case %d: L2 %.1e, worst %.1e of the peak\n", q, sqrt(wrong / all),
                      worst / peak);
        assert_true(sqrt(wrong / all) < 1e-4 && worst < 1e-3 * peak);
        image_finish(&cpu);
        image_finish(&drawn);
        factors_finish(&f);
    }
    table_finish(&t);
    environment_finish(&env);
    gl_context_close(gl);
}

TEST_MAIN(cmocka_unit_test(shaders_and_processor_agree))

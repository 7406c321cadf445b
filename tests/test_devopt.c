// test_devopt.c - driver options: types, ranges, defaults, and what a refusal says.
#include "acquire/devopt.h"
#include "tests/test.h"

struct toy {
    char *path, *inner;
    int w;
    double noise;
    int64_t lag_ns;
};

static const struct devopt options[] = {
    {"path", DEVOPT_TEXT, offsetof(struct toy, path), .help = "device"},
    {"w", DEVOPT_INT, offsetof(struct toy, w), UNIT_PX, 1, 100, "64", "width"},
    {"noise", DEVOPT_NUM, offsetof(struct toy, noise), UNIT_NONE, 0, 10, "1.5", "counts"},
    {"lag", DEVOPT_NS, offsetof(struct toy, lag_ns), UNIT_S, -1, 1, "0", "delay"},
    {"in", DEVOPT_REST, offsetof(struct toy, inner), .help = "the driver it wraps"},
    {0},
};

TEST(a_text_of_options_fills_the_struct)
{
    struct toy t = {0};
    struct err e = {0};
    assert_true(devopt_parse(options, "/dev/video0,w=8,lag=-20us,in=sim:w=8,h=4", &t, &e));
    assert_string_equal(t.path, "/dev/video0");
    assert_int_equal(t.w, 8);
    assert_near(t.noise, 1.5, 0);
    assert_true(t.lag_ns == -20000);
    assert_string_equal(t.inner, "sim:w=8,h=4");
    devopt_finish(options, &t);
    assert_null(t.inner);
}

TEST(a_refusal_names_the_option_and_its_range)
{
    static const struct {
        const char *args, *msg;
    } bad[] = {
        {"w=0", "w=0: must be 1 px to 100 px"},
        {"w=1.5", "w=1.5: not a whole number"},
        {"path=x,q=1", "no option 'q'; there are path, w, noise, lag, in"},
        {"w=2,3", "no option '3'; there are path, w, noise, lag, in"},
        {"noise=loud", "noise=loud: 'loud' is not a number such as 0.35"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        struct toy t = {0};
        struct err e = {0};
        assert_false(devopt_parse(options, bad[k].args, &t, &e));
        assert_string_equal(e.msg, bad[k].msg);
        assert_int_equal(e.code, ERR_DATA);
        devopt_finish(options, &t);
    }
}

TEST_MAIN(cmocka_unit_test(a_text_of_options_fills_the_struct),
          cmocka_unit_test(a_refusal_names_the_option_and_its_range))

// test_gpiod.c - what gpiod: does to the pins, seen from the other side, by the kernel's gpio-sim.
// Needs TEST_GPIO=/sys/devices/platform/gpio-sim.0/gpiochipN, whose line 2 is named "flash";
// tests/vm has it. Everywhere else it is skipped.
#include "tests/test.h"

#include "acquire/clock.h"
#include "acquire/hardware.h"
#ifdef HAVE_GPIOD

static const struct trig_driver *const drivers[] = {&gpiod_trig, NULL};

static const char *chip(void)
{
    const char *path = getenv("TEST_GPIO");
    if (!path) {
        print_message("skipped: no TEST_GPIO in the environment\n");
        skip();
    }
    return path ? path : ""; // skip() does not return
}

static int pin(int line)
{
    char path[200];
    snprintf(path, sizeof path, "%s/sim_gpio%d/value", chip(), line);
    FILE *f = fopen(path, "r");
    assert_non_null(f);
    const int c = fgetc(f);
    fclose(f);
    return c - '0';
}

static struct trig *open_lines(const char *args, struct err *e)
{
    char uri[200];
    snprintf(uri, sizeof uri, "gpiod:%s,%s", strrchr(chip(), '/') + 1, args);
    *e = (struct err){0};
    return trig_open(drivers, uri, e);
}

TEST(lines_follow_the_mask_and_are_low_before_and_after)
{
    struct err e;
    struct trig *t = open_lines("lines=1+flash+4", &e);
    if (!t)
        fail_msg("%s", e.msg);
    for (uint32_t mask = 0; mask < 8; mask++) {
        assert_true(trig_set(t, mask, &e));
        assert_int_equal(pin(1), mask & 1);
        assert_int_equal(pin(2), mask >> 1 & 1);
        assert_int_equal(pin(4), mask >> 2 & 1);
        assert_int_equal(pin(3), 0);
    }
    trig_close(t);
    assert_int_equal(pin(1) + pin(2) + pin(4), 0);
}

TEST(active_low_lines_are_high_when_they_are_off)
{
    struct err e;
    struct trig *t = open_lines("lines=5,active-low=1", &e);
    assert_non_null(t);
    assert_int_equal(pin(5), 1);
    assert_true(trig_set(t, 1, &e));
    assert_int_equal(pin(5), 0);
    trig_close(t);
}

TEST(a_pulse_ends_by_itself)
{
    struct err e;
    struct trig *t = open_lines("lines=1", &e);
    assert_non_null(t);
    assert_true(trig_pulse(t, 1, 300000000, &e));
    assert_int_equal(pin(1), 1);
    for (int k = 0; k < 300 && pin(1); k++)
        usleep(10000);
    const int64_t late = clock_boot_ns() - t->ends_ns;
    assert_int_equal(pin(1), 0);
    assert_true(late >= 0);
    trig_close(t);
}

TEST(lines_that_cannot_be_had_are_refused)
{
    static const struct {
        const char *args, *says;
    } bad[] = {{"lines=99", "lines: Invalid argument"},
               {"lines=lamp", "has no line 'lamp'"},
               {"lines=flash+2", "lines: '2' is there twice"}};
    struct err e;
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        assert_null(open_lines(bad[k].args, &e));
        if (!strstr(e.msg, bad[k].says))
            fail_msg("%s: %s", bad[k].args, e.msg);
    }
    struct trig *t = open_lines("lines=1", &e);
    assert_non_null(t);
    assert_null(open_lines("lines=1", &e));
    assert_non_null(strstr(e.msg, "another program holds it"));
    trig_close(t);
}

TEST_MAIN(cmocka_unit_test(lines_follow_the_mask_and_are_low_before_and_after),
          cmocka_unit_test(active_low_lines_are_high_when_they_are_off),
          cmocka_unit_test(a_pulse_ends_by_itself),
          cmocka_unit_test(lines_that_cannot_be_had_are_refused))
#else
int main(void)
{
    return 0;
}
#endif

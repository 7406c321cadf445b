// test_lights.c - whatever dies, hangs or forgets: the light goes off, and how soon.
#include "tests/test.h"

#include "acquire/clock.h"
#include "acquire/lights.h"
#include "core/outfile.h"
#include "sim/world.h"
#include "tests/run.h"
#include <poll.h>
#include <signal.h>

static struct rig rig;
static struct world *world;
static char run[40];

static int setup(void **state)
{
    static const char text[] = "name: r\ncamera: {uri: 'sim:'}\nlights:\n"
                               "  trigger: 'sim:lines=2,world=@run'\n"
                               "  list: [{name: led, line: 0, max_on: 700ms}]\n";
    struct err e;
    (void)state;
    enter_scratch("lights");
    snprintf(run, sizeof run, "test-lights-%d", (int)getpid());
    if (!outfile_write("rig.yaml", text, sizeof text - 1, &e) || !rig_open(&rig, "rig.yaml", &e))
        return -1;
    world = world_open(run, &e);
    return world ? 0 : -1;
}

static int teardown(void **state)
{
    (void)state;
    rig_finish(&rig);
    world_close(world);
    return 0;
}

// When line 0 was switched on and off last; INT64_MAX: it is on.
static void last_lit(int64_t *from, int64_t *to)
{
    struct world_state s;
    world_read(world, &s);
    *from = *to = 0;
    for (int k = 0; k < s.n_lights; k++)
        if (s.light[k].mask & 1) {
            *from = s.light[k].from_ns;
            *to = s.light[k].to_ns;
        }
}

static bool is_lit(void)
{
    int64_t from, to;
    last_lit(&from, &to);
    return to > clock_boot_ns();
}

static double lit_for_s(void)
{
    for (int k = 0; k < 400 && is_lit(); k++)
        usleep(10000);
    int64_t from, to;
    last_lit(&from, &to);
    return 1e-9 * (double)(to - from);
}

static struct trig *opened(void)
{
    struct err e = {0};
    struct trig *t = lights_open(&rig, run, &e);
    if (!t)
        fail_msg("%s", e.msg);
    return t;
}

static pid_t keeper_pid(void)
{
    char line[100];
    int pid = 0;
    snprintf(line, sizeof line, "pgrep -f -- '--run %s$' > pid", run);
    assert_int_equal(system(line), 0);
    FILE *f = fopen("pid", "r");
    assert_int_equal(fscanf(f, "%d", &pid), 1);
    fclose(f);
    return pid;
}

TEST(a_line_follows_its_orders)
{
    struct err e = {0};
    struct trig *t = opened();
    assert_int_equal(t->caps.lines, 2);
    assert_false(is_lit());
    assert_true(trig_set(t, 1, &e) && is_lit());
    assert_true(llabs(t->changed_ns - clock_boot_ns()) < 100000000);
    assert_true(trig_set(t, 0, &e) && !is_lit());
    assert_true(trig_pulse(t, 1, 30000000, &e) && is_lit());
    assert_near(lit_for_s(), 0.03, 0.02);
    trig_close(t);
}

TEST(a_line_that_is_not_in_the_rig_or_for_too_long_is_refused)
{
    struct err e = {0};
    struct trig *t = opened();
    assert_false(trig_set(t, 2, &e));
    assert_non_null(strstr(e.msg, "line 1: not in the rig"));
    assert_false(trig_pulse(t, 1, 800000000, &e));
    assert_non_null(strstr(e.msg, "longer than the rig allows"));
    assert_false(is_lit());
    trig_close(t);
}

TEST(silence_switches_off)
{
    struct err e = {0};
    char news[LIGHTS_MESSAGE];
    struct trig *t = opened();
    assert_true(trig_set(t, 1, &e));
    assert_near(lit_for_s(), 0.5, 0.1);
    assert_true(lights_pump(t, news, sizeof news, &e));
    assert_string_equal(news, "off 1 nothing heard for 500 ms");
    trig_close(t);
}

TEST(the_cap_switches_off_though_beats_go_on)
{
    struct err e = {0};
    char news[LIGHTS_MESSAGE];
    struct trig *t = opened();
    assert_true(trig_set(t, 1, &e));
    for (int k = 0; k < 20; k++) {
        lights_beat(t);
        usleep(50000);
    }
    assert_near(lit_for_s(), 0.7, 0.1);
    assert_true(lights_pump(t, news, sizeof news, &e));
    assert_string_equal(news, "off 1 on for longer than the rig allows");
    trig_close(t);
}

TEST(closing_switches_off)
{
    struct err e = {0};
    struct trig *t = opened();
    assert_true(trig_set(t, 1, &e));
    trig_close(t);
    assert_false(is_lit());
}

TEST(a_killed_owner_leaves_no_light)
{
    const pid_t pid = fork();
    if (!pid) {
        struct err e;
        struct trig *t = lights_open(&rig, run, &e);
        if (t)
            trig_set(t, 1, &e);
        raise(SIGKILL);
    }
    int status;
    waitpid(pid, &status, 0);
    assert_true(lit_for_s() < 0.1);
    int64_t from, to;
    last_lit(&from, &to);
    assert_true(from > 0); // it had been on
}

TEST(a_killed_keeper_is_replaced_and_the_new_one_switches_off)
{
    struct err e = {0};
    char news[LIGHTS_MESSAGE];
    struct trig *t = opened();
    assert_true(trig_set(t, 1, &e));
    kill(keeper_pid(), SIGKILL);
    struct pollfd p = {t->fd, POLLIN, 0};
    assert_int_equal(poll(&p, 1, 1000), 1); // what the loop would wake up for
    assert_true(is_lit());                  // as a GPIO line would be
    assert_true(lights_pump(t, news, sizeof news, &e));
    assert_non_null(strstr(news, "nacre-lights has died; a new one has switched the lines off"));
    assert_false(is_lit());
    assert_true(trig_set(t, 1, &e) && is_lit());
    kill(keeper_pid(), SIGSTOP); // and one that hangs
    assert_true(trig_set(t, 0, &e));
    assert_false(is_lit());
    trig_close(t);
}

TEST(a_keeper_that_hangs_with_a_full_queue_is_replaced_at_once)
{
    struct err e = {0};
    struct trig *t = opened();
    assert_true(trig_set(t, 1, &e));
    kill(keeper_pid(), SIGSTOP);
    for (int k = 0; k < 5000; k++)
        lights_beat(t); // until no more fit
    alarm(60);          // an order that waits for ever fails the test
    assert_true(trig_set(t, 0, &e));
    alarm(0);
    assert_false(is_lit());
    trig_close(t);
}

TEST(a_keeper_that_dies_again_and_again_is_given_up)
{
    struct err e = {0};
    char news[LIGHTS_MESSAGE];
    struct trig *t = opened();
    int deaths = 0;
    for (bool alive = true; alive && deaths < 100; deaths++) {
        struct pollfd p = {t->fd, POLLIN, 0};
        kill(keeper_pid(), SIGKILL);
        assert_int_equal(poll(&p, 1, 1000), 1);
        alive = lights_pump(t, news, sizeof news, &e);
    }
    assert_in_range(deaths, 6, 99);
    assert_non_null(strstr(e.msg, "cannot be started again: it dies again and again"));
    trig_close(t);
}

TEST(off_is_a_command_of_its_own)
{
    struct err e = {0};
    struct trig *t = opened();
    assert_true(trig_set(t, 1, &e));
    char line[300];
    snprintf(line, sizeof line, "%s/nacre-lights --rig rig.yaml --run %s --off", BIN_DIR, run);
    assert_int_equal(system(line), 0);
    assert_false(is_lit());
    trig_close(t);
    snprintf(line, sizeof line, "%s/nacre-lights --rig absent.yaml --off 2>err </dev/null",
             BIN_DIR);
    assert_int_equal(WEXITSTATUS(system(line)), 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_line_follows_its_orders),
        cmocka_unit_test(a_line_that_is_not_in_the_rig_or_for_too_long_is_refused),
        cmocka_unit_test(silence_switches_off),
        cmocka_unit_test(the_cap_switches_off_though_beats_go_on),
        cmocka_unit_test(closing_switches_off),
        cmocka_unit_test(a_killed_owner_leaves_no_light),
        cmocka_unit_test(a_killed_keeper_is_replaced_and_the_new_one_switches_off),
        cmocka_unit_test(a_keeper_that_hangs_with_a_full_queue_is_replaced_at_once),
        cmocka_unit_test(a_keeper_that_dies_again_and_again_is_given_up),
        cmocka_unit_test(off_is_a_command_of_its_own),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

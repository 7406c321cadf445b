// test_hardware.c - the drivers of real devices where there is no device: what they refuse, and how
// they say so; pulses, moves, and a person at a terminal.
#include "tests/test.h"

#include "acquire/clock.h"
#include "acquire/hardware.h"
#include "acquire/pulse.h"
#include "tests/run.h"
#include "ui/drivers.h"
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <termios.h>

static void no_frame(void *ctx, const struct cam_frame *frame)
{
    (void)ctx;
    (void)frame;
}

TEST(cameras_that_are_not_there_are_refused_with_the_reason)
{
    static const struct {
        const char *uri, *msg;
        enum err_code code;
    } bad[] = {
        {"v4l2:/dev/none", "camera v4l2: /dev/none: open: No such file or directory", ERR_DEVICE},
        {"v4l2:/dev/null", "camera v4l2: /dev/null: is no camera that streams", ERR_DEVICE},
        {"v4l2:/dev/null,memory=ram", "camera v4l2: memory=ram: must be mmap or dmabuf", ERR_DATA},
        {"v4l2:w=0", "camera v4l2: w=0: must be 1 px to 6.554e+04 px", ERR_DATA},
        {"v4l2:fps=1s", NULL, ERR_DATA},
        {"v4l2:black=-1", "camera v4l2: black=-1: must be 0 to 6.554e+04", ERR_DATA},
        {"v4l2:shutter=1", NULL, ERR_DATA},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        struct err e = {0};
        assert_null(cam_open(all_drivers.cameras, bad[k].uri, no_frame, NULL, &e));
        assert_int_equal(e.code, bad[k].code);
        if (bad[k].msg)
            assert_string_equal(e.msg, bad[k].msg);
    }
}

static bool is_built(const char *name)
{
    for (const struct trig_driver *const *d = all_triggers; *d; d++)
        if (!strcmp((*d)->name, name))
            return true;
    return false;
}

TEST(triggers_that_are_not_there_are_refused_with_the_reason)
{
    static const struct {
        const char *name, *uri, *msg;
        enum err_code code;
    } bad[] = {
        {"gpiod", "gpiod:", "trigger gpiod: chip: name it, as in gpiod:gpiochip0,lines=17",
         ERR_DATA},
        {"gpiod", "gpiod:no-such-chip,lines=1",
         "trigger gpiod: no-such-chip: open: No such file or directory", ERR_DEVICE},
        {"gpiod", "gpiod:c,active-low=2", "trigger gpiod: active-low=2: must be 0 to 1", ERR_DATA},
        {"usb", "usb:", "trigger usb: kind=: must be relay or wheel", ERR_DATA},
        {"usb", "usb:relay,port=99-1", NULL, ERR_DEVICE},
        {"usb", "usb:relay,lines=9", "trigger usb: lines=9: must be 1 to 8", ERR_DATA},
        {"usb", "usb:wheel,timeout=200ms", "trigger usb: timeout=200ms: must be 1 s to 120 s",
         ERR_DATA},
        {"prompt", "prompt:tty=/dev/null",
         "trigger prompt: tty=/dev/null: no terminal to ask a person at", ERR_DEVICE},
        {"prompt", "prompt:positions=0", "trigger prompt: positions=0: must be 1 to 100", ERR_DATA},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        struct err e = {0};
        if (!is_built(bad[k].name))
            continue;
        assert_null(trig_open(all_triggers, bad[k].uri, &e));
        if (bad[k].msg)
            assert_string_equal(e.msg, bad[k].msg);
        assert_int_equal(e.code, bad[k].code);
    }
}

// --- nacre doctor --devices ---

TEST(the_doctor_lists_every_driver_with_its_options)
{
    enter_scratch("doctor");
    struct run r = run_nacre("doctor --devices");
    assert_int_equal(r.status, 0);
    for (const struct cam_driver *const *c = all_drivers.cameras; *c; c++) {
        char title[40];
        snprintf(title, sizeof title, "camera %s: ", (*c)->name);
        assert_non_null(strstr(r.out, title));
    }
    assert_non_null(strstr(r.out, "camera v4l2:w=           width, instead of the device's "
                                  "(1 px to 65536 px)\n"));
    assert_non_null(strstr(r.out, "trigger prompt:patience= how long to wait for a person (1 s to "
                                  "86400 s) [10min]\n"));
    r = run_nacre("doctor --devices --json");
    assert_int_equal(r.status, 0);
    assert_non_null(strstr(r.out, "\"name\": \"v4l2\""));
}

// --- pulses ---

static int64_t ended_ns;

static void end(void *ctx)
{
    (void)ctx;
    ended_ns = clock_boot_ns();
}

static int64_t wait_for_end(struct pulse *p, int ms)
{
    int64_t t = 0;
    for (int k = 0; k < ms && !t; k++) {
        usleep(1000);
        pulse_lock(p);
        t = ended_ns;
        pulse_unlock(p);
    }
    return t;
}

TEST(a_pulse_ends_once_and_not_before_its_time)
{
    struct pulse p;
    struct err e = {0};
    assert_true(pulse_init(&p, end, NULL, &e));
    ended_ns = 0;
    const int64_t until = clock_boot_ns() + 20000000;
    pulse_lock(&p);
    pulse_arm(&p, until);
    pulse_unlock(&p);
    const int64_t t = wait_for_end(&p, 2000);
    assert_true(t >= until);
    pulse_lock(&p);
    ended_ns = 0;
    pulse_arm(&p, clock_boot_ns() + 20000000);
    pulse_arm(&p, 0); // and one that is taken back
    pulse_unlock(&p);
    assert_true(wait_for_end(&p, 60) == 0);
    pulse_lock(&p);
    pulse_arm(&p, clock_boot_ns() + INT64_C(3600000000000));
    pulse_unlock(&p);
    pulse_finish(&p); // does not wait for it
    assert_true(ended_ns == 0);
}

// --- a person ---

static int person;

static char *open_terminal(char path[64])
{
    struct termios raw;
    person = posix_openpt(O_RDWR | O_NOCTTY);
    assert_true(person >= 0 && !grantpt(person) && !unlockpt(person));
    assert_int_equal(ptsname_r(person, path, 64), 0);
    assert_int_equal(tcgetattr(person, &raw), 0);
    raw.c_lflag &= (tcflag_t)~ECHO;
    assert_int_equal(tcsetattr(person, TCSANOW, &raw), 0);
    return path;
}

static void expect_on_screen(const char *words)
{
    char seen[400] = "";
    for (int k = 0; k < 40 && !strstr(seen, words); k++) {
        struct pollfd p = {person, POLLIN, 0};
        if (poll(&p, 1, 50) == 1) {
            const size_t n = strlen(seen);
            const ssize_t got = read(person, seen + n, sizeof seen - 1 - n);
            seen[n + (got > 0 ? (size_t)got : 0)] = 0;
        }
    }
    if (!strstr(seen, words))
        fail_msg("'%s' is not in '%s'", words, seen);
}

TEST(a_person_is_asked_by_name_and_waited_for)
{
    char path[64], uri[200];
    struct err e = {0};
    snprintf(uri, sizeof uri, "prompt:positions=3,names=red+green,tty=%s", open_terminal(path));
    struct trig *t = trig_open(all_triggers, uri, &e);
    assert_non_null(t);
    assert_true(trig_set(t, 1, &e));
    expect_on_screen("Put filter 'green' in place, then press Enter: ");
    struct pollfd p = {t->fd, POLLIN, 0};
    assert_int_equal(poll(&p, 1, 100), 0);
    assert_int_equal(write(person, "\n", 1), 1);
    assert_int_equal(poll(&p, 1, 2000), 1);
    assert_true(trig_settled(t, &e));
    assert_true(trig_set(t, 2, &e));
    expect_on_screen("filter number 2 ");
    trig_close(t); // while it waits
    close(person);
}

TEST(a_person_who_does_not_answer_is_an_error)
{
    char path[64], uri[200];
    struct err e = {0};
    snprintf(uri, sizeof uri, "prompt:positions=3,patience=1s,tty=%s", open_terminal(path));
    struct trig *t = trig_open(all_triggers, uri, &e);
    assert_non_null(t);
    assert_true(trig_set(t, 0, &e));
    struct pollfd p = {t->fd, POLLIN, 0};
    assert_int_equal(poll(&p, 1, 5000), 1);
    assert_false(trig_settled(t, &e));
    assert_non_null(strstr(e.msg, "trigger prompt: nobody answered at /dev/pts/"));
    assert_int_equal(e.code, ERR_DEVICE);
    trig_close(t);
    close(person);
}

TEST_MAIN(cmocka_unit_test(the_doctor_lists_every_driver_with_its_options),
          cmocka_unit_test(cameras_that_are_not_there_are_refused_with_the_reason),
          cmocka_unit_test(triggers_that_are_not_there_are_refused_with_the_reason),
          cmocka_unit_test(a_pulse_ends_once_and_not_before_its_time),
          cmocka_unit_test(a_person_is_asked_by_name_and_waited_for),
          cmocka_unit_test(a_person_who_does_not_answer_is_an_error))

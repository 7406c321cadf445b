// test_usb.c - usb: when the device is pulled out and plugged in again. Needs
// TEST_UDC=/sys/kernel/config/usb_gadget with gadgets "relay" and "wheel"; tests/vm has them.
// Everywhere else it is skipped.
#include "tests/test.h"

#include "acquire/hardware.h"
#ifdef HAVE_LIBUSB
#include <poll.h>

static const struct trig_driver *const drivers[] = {&usb_trig, NULL};

static void skip_without_gadgets(void)
{
    if (getenv("TEST_UDC"))
        return;
    print_message("skipped: no TEST_UDC in the environment\n");
    skip();
}

static void plug(const char *gadget, const char *controller)
{
    char path[200];
    snprintf(path, sizeof path, "%s/%s/UDC", getenv("TEST_UDC"), gadget);
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    fprintf(f, "%s\n", controller);
    fclose(f);
}

static struct trig *wait_for(const char *uri)
{
    struct err e = {0};
    struct trig *t = NULL;
    for (int k = 0; k < 100 && !(t = trig_open(drivers, uri, &e)); k++)
        usleep(100000);
    if (!t)
        fail_msg("%s", e.msg);
    return t;
}

TEST(a_relay_board_that_is_pulled_out_is_told_and_comes_back)
{
    struct err e;
    skip_without_gadgets();
    struct trig *t = wait_for("usb:relay");
    assert_true(trig_set(t, 5, &e));
    plug("relay", "");
    assert_false(trig_set(t, 0, &e));
    assert_int_equal(e.code, ERR_DEVICE);
    print_message("%s\n", e.msg);
    trig_close(t);
    assert_null(trig_open(drivers, "usb:relay", &e));
    assert_string_equal(e.msg, "trigger usb: no relay board 16c0:05df is plugged in");
    plug("relay", "dummy_udc.0");
    t = wait_for("usb:relay");
    assert_true(trig_set(t, 2, &e));
    trig_close(t);
}

TEST(a_wheel_that_is_pulled_out_while_it_turns_fails_the_move)
{
    struct err e = {0};
    skip_without_gadgets();
    struct trig *t = wait_for("usb:wheel");
    assert_int_equal(t->caps.positions, 5);
    assert_true(trig_set(t, 3, &e));
    plug("wheel", "");
    struct pollfd p = {t->fd, POLLIN, 0};
    assert_int_equal(poll(&p, 1, 10000), 1);
    assert_false(trig_settled(t, &e));
    assert_int_equal(e.code, ERR_DEVICE);
    print_message("%s\n", e.msg);
    trig_close(t);
    plug("wheel", "dummy_udc.1");
    t = wait_for("usb:wheel");
    trig_close(t);
}

TEST(the_wrong_board_is_refused)
{
    struct err e;
    skip_without_gadgets();
    assert_null(trig_open(drivers, "usb:relay,serial=OTHER", &e));
    assert_string_equal(e.msg, "trigger usb: serial=OTHER: there is only 'NACRE'");
    assert_null(trig_open(drivers, "usb:relay,port=9-9", &e));
    assert_string_equal(e.msg, "trigger usb: no relay board 16c0:05df at port 9-9 is plugged in");
}

TEST_MAIN(cmocka_unit_test(the_wrong_board_is_refused),
          cmocka_unit_test(a_relay_board_that_is_pulled_out_is_told_and_comes_back),
          cmocka_unit_test(a_wheel_that_is_pulled_out_while_it_turns_fails_the_move))
#else
int main(void)
{
    return 0;
}
#endif

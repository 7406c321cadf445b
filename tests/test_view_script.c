// test_view_script.c - scripts of the window: what they hold, and what is wrong with others.
#include "tests/test.h"

#include "ui/view_keys.h"
#include "ui/view_script.h"

static bool read_text(struct script *s, const char *text, struct err *e)
{
    char path[] = "/tmp/nacre_script_XXXXXX";
    const int fd = mkstemp(path);
    assert_int_equal(write(fd, text, strlen(text)), strlen(text));
    close(fd);
    const bool ok = script_read(s, path, e);
    unlink(path);
    return ok;
}

TEST(a_script_is_a_list_of_steps)
{
    struct script s;
    struct err e;
    assert_true(read_text(&s,
                          "# a comment\n\nsize 800 600\nmove table 0.5 0.25\nkey ctrl+Z\n"
                          "set -2 exposure\nwait 250ms\nscreenshot a b.png\nturntable 12 turn\n",
                          &e));
    assert_int_equal(s.n, 7);
    assert_int_equal(s.step[0].verb, SCRIPT_SIZE);
    assert_near(s.step[0].num[1], 600, 0);
    assert_string_equal(s.step[1].pane, "table");
    assert_near(s.step[1].num[1], 0.25, 0);
    assert_int_equal(s.step[2].key, 'Z');
    assert_int_equal(s.step[2].mods, MOD_CTRL);
    assert_near(s.step[3].num[0], -2, 0);
    assert_string_equal(s.step[3].text, "exposure");
    assert_near(s.step[4].num[0], 0.25, 1e-12);
    assert_string_equal(s.step[5].text, "a b.png");
    assert_near(s.step[6].num[0], 12, 0);
    assert_string_equal(s.step[6].text, "turn");
    script_finish(&s);
}

TEST(a_drag_presses_moves_and_lets_go)
{
    struct script s;
    struct err e;
    assert_true(read_text(&s, "drag material 0 0 1 0.5 right\n", &e));
    assert_int_equal(s.step[0].verb, SCRIPT_MOVE);
    assert_int_equal(s.step[1].verb, SCRIPT_PRESS);
    assert_int_equal(s.step[1].button, BUTTON_RIGHT);
    assert_int_equal(s.step[s.n - 1].verb, SCRIPT_RELEASE);
    assert_near(s.step[s.n - 2].num[0], 1, 1e-12);
    assert_near(s.step[s.n - 2].num[1], 0.5, 1e-12);
    script_finish(&s);
}

TEST(what_is_wrong_with_a_script_is_told_with_its_line)
{
    static const struct {
        const char *text, *says;
    } bad[] = {
        {"settle\nfly 1 2\n", ":2: 'fly' is not a step of a script"},
        {"move 1\n", ":1: must be: move [PANE] X Y"},
        {"key\n", ":1: must be: key NAME"},
        {"key super\n", ":1: 'super' is not a key"},
        {"press up\n", ":1: 'up' is not left, right or middle"},
        {"wait soon\n", ":1: "},
        {"drag 1 2 3\n", ":1: must be: drag"},
        {"settle now\n", ":1: must be: settle"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        struct script s;
        struct err e;
        assert_false(read_text(&s, bad[k].text, &e));
        assert_int_equal(e.code, ERR_DATA);
        if (!strstr(e.msg, bad[k].says))
            fail_msg("'%s' does not say '%s'", e.msg, bad[k].says);
    }
}

TEST_MAIN(cmocka_unit_test(a_script_is_a_list_of_steps),
          cmocka_unit_test(a_drag_presses_moves_and_lets_go),
          cmocka_unit_test(what_is_wrong_with_a_script_is_told_with_its_line))

// test_manual.c - manual pages and the doctor say what the programs do.
#include "tests/run.h"

#include "core/mem.h"

static char *text_of(const char *command)
{
    static char text[1 << 17];
    FILE *p = popen(command, "r");
    assert_non_null(p);
    text[fread(text, 1, sizeof text - 1, p)] = 0;
    assert_int_equal(pclose(p), 0);
    return text;
}

// Every "--name" of the help stands in the page as roff writes it.
static void holds_options_of(const char *page, const char *help)
{
    int n = 0;
    for (const char *at = help; (at = strstr(at, "\n  -")); at += 4, n++) {
        char name[80] = "";
        for (const char *s = at + 3; *s && *s != ' ' && *s != '\n'; s++)
            strcat(name, *s == '-' ? "\\-" : (char[]){*s, 0});
        if (!strstr(page, name))
            fail_msg("the page lacks %s", name);
    }
    assert_true(n > 0);
}

TEST(every_command_has_a_page_with_every_option)
{
    enter_scratch("manual");
    char *all = xstrdup(text_of(BIN_DIR "/nacre --help"));
    int commands = 0;
    for (char *at = strstr(all, "\n  "); at; at = strstr(at + 1, "\n  ")) {
        char name[20], line[300];
        assert_int_equal(sscanf(at, " %19s", name), 1);
        if (!strcmp(name, "completion") || !strcmp(name, "man"))
            continue;
        snprintf(line, sizeof line, BIN_DIR "/nacre man %s", name);
        char *page = xstrdup(text_of(line));
        snprintf(line, sizeof line, ".SH NAME\nnacre\\-%s \\- ", name);
        assert_non_null(strstr(page, line));
        snprintf(line, sizeof line, BIN_DIR "/nacre %s --help", name);
        holds_options_of(page, text_of(line));
        free(page);
        commands++;
    }
    assert_true(commands > 20);
    free(all);
    assert_int_equal(run_nacre("man nothing").status, 2);
}

TEST(pages_of_the_daemons_hold_their_options)
{
    static const char *const program[] = {"nacred", "nacre-lights"};
    for (int k = 0; k < 2; k++) {
        char line[300];
        snprintf(line, sizeof line, "cat " SOURCE_DIR "/docs/man/man8/%s.8", program[k]);
        char *page = xstrdup(text_of(line));
        snprintf(line, sizeof line, BIN_DIR "/%s --help", program[k]);
        holds_options_of(page, text_of(line));
        free(page);
    }
}

TEST(verbs_stand_in_the_page_with_their_own_options)
{
    const char *page = text_of(BIN_DIR "/nacre man calib"), *lens = strstr(page, ".SS lens\n");
    assert_non_null(lens);
    const char *next = strstr(lens + 1, ".SS "), *board = strstr(lens, "\\-\\-board");
    assert_true(board && board < next);
    assert_null(strstr(lens, ".SS dark"));
}

TEST(the_doctor_misses_a_daemon_that_is_not_beside_it)
{
    enter_scratch("manual");
    assert_int_equal(system("cp " BIN_DIR "/nacre ."), 0);
    assert_int_equal(system("NACRE_DATA=" SOURCE_DIR " ./nacre doctor >found.txt 2>errors.txt"),
                     6 << 8);
    assert_non_null(strstr(text_of("cat found.txt"), "install the package nacred"));
    assert_int_equal(count_errors(text_of("cat errors.txt")), 1);
    assert_int_equal(run_nacre("doctor").status, 0);
}

TEST_MAIN(cmocka_unit_test(every_command_has_a_page_with_every_option),
          cmocka_unit_test(pages_of_the_daemons_hold_their_options),
          cmocka_unit_test(verbs_stand_in_the_page_with_their_own_options),
          cmocka_unit_test(the_doctor_misses_a_daemon_that_is_not_beside_it))

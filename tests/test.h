// test.h - cmocka with the few words that our tests use. Include it first.
#pragma once
#define _GNU_SOURCE
#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#define TEST(name) static void name(void **state __attribute__((unused)))
#define TEST_MAIN(...)                                                                             \
    int main(void)                                                                                 \
    {                                                                                              \
        const struct CMUnitTest tests[] = {__VA_ARGS__};                                           \
        return cmocka_run_group_tests(tests, NULL, NULL);                                          \
    }

// |a - b| <= tol, with all three in the message; NAN fails.
#define assert_near(a, b, tol)                                                                     \
    do {                                                                                           \
        const double near_a = (a), near_b = (b), near_tol = (tol);                                 \
        if (!(fabs(near_a - near_b) <= near_tol))                                                  \
            fail_msg("%s = %.17g, not %.17g within %g", #a, near_a, near_b, near_tol);             \
    } while (0)

// A path below the reference data, or skips the test (and says so) where it is absent.
static inline const char *shared_or_skip(const char *path)
{
    static char full[8][1024];
    static int turn;
    char *p = full[turn++ % 8];
    snprintf(p, sizeof full[0], "%s/%s", SHARED_DIR, path);
    if (access(p, R_OK)) {
        print_message("skipped: no reference data %s\n", p);
        skip();
    }
    return p;
}

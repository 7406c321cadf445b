// test_err.c - messages are interface.
#include "core/err.h"
#include "tests/test.h"

TEST(context_goes_in_front_and_the_code_stays)
{
    struct err e = {0};
    assert_false(err_set(&e, ERR_DATA, "bad size %dx%d", 0, 48));
    assert_false(err_in(&e, "sim:w=0"));
    assert_string_equal(e.msg, "sim:w=0: bad size 0x48");
    assert_int_equal(e.code, ERR_DATA);
}

TEST(errno_becomes_a_reason)
{
    struct err e = {0};
    errno = ENOENT;
    assert_false(err_errno(&e, "%s", "a.exr"));
    assert_string_equal(e.msg, "a.exr: No such file or directory");
    assert_int_equal(e.code, ERR_FILE);
}

TEST_MAIN(cmocka_unit_test(context_goes_in_front_and_the_code_stays),
          cmocka_unit_test(errno_becomes_a_reason))

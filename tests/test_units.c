// test_units.c - quantities as people type them.
#include "core/units.h"
#include "tests/test.h"

TEST(quantities_carry_units)
{
    static const struct {
        const char *text;
        enum unit unit;
        double si;
    } good[] = {
        {"530nm", UNIT_M, 530e-9},
        {"0.25um", UNIT_M, 0.25e-6},
        {"5.3e-7", UNIT_M, 5.3e-7},
        {"65 um", UNIT_M, 65e-6},
        {"13deg", UNIT_RAD, 13 * M_PI / 180},
        {"1/60s", UNIT_S, 1 / 60.0},
        {"1/8000", UNIT_S, 1 / 8000.0},
        {"20ms", UNIT_S, 0.02},
        {"600/mm", UNIT_PER_M, 6e5},
        {"-3.5", UNIT_NONE, -3.5},
        {"2GB", UNIT_BYTES, 2e9},
        {"0.25\u00b5m", UNIT_M, 0.25e-6},
    };
    for (size_t k = 0; k < sizeof good / sizeof *good; k++) {
        struct err e = {0};
        double si = 0;
        if (!quantity_parse(good[k].text, good[k].unit, &si, &e))
            fail_msg("%s", e.msg);
        assert_near(si, good[k].si, 1e-12 * fabs(good[k].si));
    }
}

TEST(what_is_not_a_quantity_says_what_would_be)
{
    static const struct {
        const char *text;
        enum unit unit;
        const char *msg;
    } bad[] = {
        {"", UNIT_M, "'' is not a length such as 530nm or 0.25um"},
        {"530mn", UNIT_M, "'530mn' is not a length such as 530nm or 0.25um"},
        {"530nm", UNIT_S, "'530nm' is not a time such as 1/60s or 20ms"},
        {"1/0", UNIT_S, "'1/0' is not a time such as 1/60s or 20ms"},
        {"nan", UNIT_NONE, "'nan' is not a number such as 0.35"},
        {"inf", UNIT_NONE, "'inf' is not a number such as 0.35"},
        {"12x", UNIT_NONE, "'12x' is not a number such as 0.35"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        struct err e = {0};
        double si = 7;
        assert_false(quantity_parse(bad[k].text, bad[k].unit, &si, &e));
        assert_string_equal(e.msg, bad[k].msg);
        assert_int_equal(e.code, ERR_USAGE);
        assert_near(si, 7, 0);
    }
}

TEST(printing_picks_the_unit_a_person_would)
{
    static const struct {
        double si;
        enum unit unit;
        const char *text;
    } cases[] = {
        {532e-9, UNIT_M, "532 nm"},
        {1.6e-6, UNIT_M, "1.6 um"},
        {1 / 60.0, UNIT_S, "16.67 ms"},
        {6e5, UNIT_PER_M, "600/mm"},
        {13 * M_PI / 180, UNIT_RAD, "13 deg"},
        {0.35, UNIT_NONE, "0.35"},
        {2e9, UNIT_BYTES, "2 GB"},
    };
    char buf[40];
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        assert_string_equal(quantity_text(cases[k].si, cases[k].unit, buf, sizeof buf),
                            cases[k].text);
}

TEST_MAIN(cmocka_unit_test(quantities_carry_units),
          cmocka_unit_test(what_is_not_a_quantity_says_what_would_be),
          cmocka_unit_test(printing_picks_the_unit_a_person_would))

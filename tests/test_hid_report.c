// test_hid_report.c - the bytes of relay boards and filter wheels.
#include "tests/test.h"

#include "acquire/hid_report.h"

// What a board does with a report, by its firmware's commands.
static uint32_t board_does(uint32_t was, const uint8_t *r, int relays)
{
    const uint32_t all = (1u << relays) - 1, one = r[1] ? 1u << (r[1] - 1) : 0;
    switch (r[0]) {
    case 0xff: return was | one;
    case 0xfd: return was & ~one;
    case 0xfe: return all;
    case 0xfc: return 0;
    default: fail_msg("command 0x%02x", r[0]); return 0;
    }
}

TEST(reports_lead_from_every_state_to_every_other)
{
    uint8_t report[RELAY_MAX][RELAY_REPORT];
    for (int relays = 1; relays <= RELAY_MAX; relays++)
        for (uint32_t from = 0; from < 1u << relays; from++)
            for (uint32_t to = 0; to < 1u << relays; to++) {
                uint32_t on = from;
                const int n = relay_reports(from, to, relays, report);
                assert_in_range(n, 0, relays);
                for (int k = 0; k < n; k++) {
                    const uint32_t next = board_does(on, report[k], relays);
                    // No light goes on that is not wanted, and none before those that go off.
                    assert_int_equal(next & ~(from | to), 0);
                    if (next & ~on)
                        assert_int_equal(on & ~to, 0);
                    for (int b = 2; b < RELAY_REPORT; b++)
                        assert_int_equal(report[k][b], 0);
                    on = next;
                }
                assert_int_equal(on, to);
            }
}

TEST(all_off_is_one_report_from_whatever_state)
{
    uint8_t report[RELAY_MAX][RELAY_REPORT];
    assert_int_equal(relay_reports(UINT32_MAX, 0, 4, report), 1);
    assert_int_equal(report[0][0], 0xfc);
    assert_int_equal(relay_reports(0, 0, 4, report), 0);
}

TEST(a_board_names_its_relays)
{
    static const struct {
        const char *product;
        int n;
    } names[] = {{"USBRelay1", 1}, {"USBRelay8", 8},  {"USBRelay9", 0}, {"USBRelay0", 0},
                 {"USBRelay", 0},  {"USBRelay16", 0}, {"Mouse", 0},     {"", 0}};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        assert_int_equal(relay_count(names[k].product), names[k].n);
}

TEST(a_boards_answer_has_letters_and_a_state)
{
    const uint8_t good[] = {'B', 'I', 'T', 'F', 'T', 0, 0, 0x05};
    uint8_t bad[sizeof good];
    struct relay_state s;
    assert_true(relay_read(good, sizeof good, &s));
    assert_string_equal(s.letters, "BITFT");
    assert_int_equal(s.on, 5);
    memcpy(bad, good, sizeof good);
    bad[2] = 0;
    assert_false(relay_read(bad, sizeof bad, &s));
    assert_false(relay_read(good, 7, &s));
}

TEST(wheels_count_from_one_and_say_when_they_move)
{
    uint8_t r[WHEEL_REPORT];
    struct wheel_state s;
    wheel_go(4, r);
    assert_true(r[0] == 5 && r[1] == 0);
    wheel_ask(r);
    assert_true(r[0] == 0 && r[1] == 0);
    wheel_count(r);
    assert_true(r[0] == 0 && r[1] == 1);
    assert_true(wheel_read((const uint8_t[]){3, 7}, 2, &s) && s.position == 2 && s.positions == 7);
    assert_true(wheel_read((const uint8_t[]){0, 7}, 2, &s) && s.position == -1);
    assert_false(wheel_read((const uint8_t[]){3, 7, 0}, 3, &s));
    assert_false(wheel_read((const uint8_t[]){0x85, 7}, 2, &s));
}

TEST_MAIN(cmocka_unit_test(reports_lead_from_every_state_to_every_other),
          cmocka_unit_test(all_off_is_one_report_from_whatever_state),
          cmocka_unit_test(a_board_names_its_relays),
          cmocka_unit_test(a_boards_answer_has_letters_and_a_state),
          cmocka_unit_test(wheels_count_from_one_and_say_when_they_move))

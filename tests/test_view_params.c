// test_view_params.c - what can be set, undone, and asked for by a key.
#include "tests/test.h"

#include "ui/view_keys.h"
#include "ui/view_undo.h"

TEST(values_stay_in_their_range_and_angles_come_round)
{
    struct params p = params_start();
    assert_true(param_set(&p, PARAM_OFFSET, 7));
    assert_near(p.v[PARAM_OFFSET], 1, 0);
    assert_false(param_set(&p, PARAM_OFFSET, NAN));
    assert_near(p.v[PARAM_OFFSET], 1, 0);
    param_set(&p, PARAM_YAW, 1.5 * M_PI);
    assert_near(p.v[PARAM_YAW], -0.5 * M_PI, 1e-12);
    assert_int_equal(param_find("exposure"), PARAM_EXPOSURE);
    assert_int_equal(param_find("expos"), -1);
}

TEST(a_change_of_display_or_room_asks_for_no_drawing_at_once)
{
    const struct params a = params_start();
    struct params b = a;
    enum param first;
    assert_int_equal(params_differ(&a, &b, &first), -1);
    param_set(&b, PARAM_EXPOSURE, 2);
    assert_int_equal(params_differ(&a, &b, &first), COST_SHOW);
    assert_int_equal(first, PARAM_EXPOSURE);
    param_set(&b, PARAM_ROOM_TURN, 1);
    assert_int_equal(params_differ(&a, &b, &first), COST_ROOM);
    param_set(&b, PARAM_YAW, 1);
    assert_int_equal(params_differ(&a, &b, &first), COST_DRAW);
}

TEST(undo_goes_back_step_by_step_and_redo_forth_until_something_new_is_done)
{
    static struct undo u;
    struct params p = params_start();
    enum param what;
    undo_start(&u, &p);
    assert_false(undo_back(&u, &p, &what));
    for (int k = 1; k <= 3; k++) {
        param_set(&p, PARAM_EXPOSURE, k);
        undo_note(&u, &p);
        undo_note(&u, &p); // nothing new
    }
    assert_true(undo_back(&u, &p, &what));
    assert_int_equal(what, PARAM_EXPOSURE);
    assert_true(undo_back(&u, &p, &what));
    assert_near(p.v[PARAM_EXPOSURE], 1, 0);
    assert_true(undo_forth(&u, &p, &what));
    assert_near(p.v[PARAM_EXPOSURE], 2, 0);
    param_set(&p, PARAM_GAIN, 5);
    undo_note(&u, &p);
    assert_false(undo_forth(&u, &p, &what));
    assert_true(undo_back(&u, &p, &what));
    assert_int_equal(what, PARAM_GAIN);
}

TEST(undo_forgets_the_oldest_steps_only)
{
    static struct undo u;
    struct params p = params_start();
    enum param what;
    undo_start(&u, &p);
    for (int k = 1; k <= UNDO_STEPS + 50; k++) {
        param_set(&p, PARAM_PITCH, 1e-6 + k * 1e-8);
        undo_note(&u, &p);
    }
    int steps = 0;
    while (undo_back(&u, &p, &what))
        steps++;
    assert_int_equal(steps, UNDO_STEPS - 1);
    assert_near(p.v[PARAM_PITCH], 1e-6 + 51 * 1e-8, 1e-15);
}

TEST(the_keys_of_tev_do_what_they_do_there)
{
    int which = 0;
    assert_int_equal(key_action('E', 0, &which), ACTION_BRIGHTER);
    assert_int_equal(key_action('E', MOD_SHIFT, &which), ACTION_DARKER);
    assert_int_equal(key_action('O', 0, &which), ACTION_OFFSET_UP);
    assert_int_equal(key_action('F', 0, &which), ACTION_FIT);
    assert_int_equal(key_action('7', 0, &which), ACTION_SELECT);
    assert_int_equal(which, 7);
    assert_int_equal(key_action('?', MOD_SHIFT, &which), ACTION_HELP);
    assert_int_equal(key_action('Z', MOD_CTRL, &which), ACTION_UNDO);
    assert_int_equal(key_action('E', MOD_CTRL, &which), ACTION_NONE);
}

TEST(no_key_has_two_meanings)
{
    for (const struct key *a = keys; a->action; a++)
        for (const struct key *b = a + 1; b->action; b++)
            assert_false(a->key == b->key && a->mods == b->mods);
}

TEST(keys_are_read_as_people_write_them)
{
    int key, mods;
    assert_true(key_parse("ctrl+shift+z", &key, &mods));
    assert_int_equal(key, 'Z');
    assert_int_equal(mods, MOD_CTRL | MOD_SHIFT);
    assert_true(key_parse("Left", &key, &mods));
    assert_int_equal(key, KEY_LEFT);
    assert_true(key_parse("?", &key, &mods));
    assert_false(key_parse("hyper+E", &key, &mods));
    assert_false(key_parse("", &key, &mods));
}

TEST_MAIN(cmocka_unit_test(values_stay_in_their_range_and_angles_come_round),
          cmocka_unit_test(a_change_of_display_or_room_asks_for_no_drawing_at_once),
          cmocka_unit_test(undo_goes_back_step_by_step_and_redo_forth_until_something_new_is_done),
          cmocka_unit_test(undo_forgets_the_oldest_steps_only),
          cmocka_unit_test(the_keys_of_tev_do_what_they_do_there),
          cmocka_unit_test(no_key_has_two_meanings),
          cmocka_unit_test(keys_are_read_as_people_write_them))

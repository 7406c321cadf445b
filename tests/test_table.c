// test_table.c - nodes, look-up, weights, refusals.
#include "core/table.h"
#include "tests/test.h"

TEST(nodes_and_indices_are_inverses)
{
    static const int powers[] = {1, 3, 5, 9};
    for (int k = 0; k < 4; k++) {
        struct table t;
        struct err e = {0};
        assert_true(table_init(&t, 501, 0.35, powers[k], 1, &e));
        assert_near(table_node(&t, 0), -0.35, 0);
        assert_near(table_node(&t, 500), 0.35, 0);
        assert_near(table_node(&t, 250), 0, 0);
        for (int i = 0; i < 501; i++)
            assert_near(table_index(&t, table_node(&t, i)), i, 1e-10);
        assert_true(isnan(table_index(&t, 0.351)));
        table_finish(&t);
    }
}

TEST(lookup_is_exact_on_nodes_and_linear_between)
{
    struct table t;
    struct err e = {0};
    assert_true(table_init(&t, 5, 1, 1, 1, &e));
    for (int j = 0; j < 5; j++)
        for (int i = 0; i < 5; i++)
            for (int c = 0; c < 3; c++)
                t.tab[(j * 5 + i) * 3 + c] = (float)(i + 10 * j + 100 * c);
    double out[3];
    table_eval(&t, -1, 1, 2, 0, out);
    assert_near(out[0], 40, 0);
    table_eval(&t, 0.25, -0.5, 2, 0, out); // i = 2.5, j = 1
    assert_near(out[1], 112.5, 1e-12);
    table_eval(&t, 1.01, 0, 2, 0, out);
    assert_near(out[2], 0, 0);
    table_finish(&t);
}

TEST(weights_follow_their_basis)
{
    struct table t = {.n = 2, .count = 3, .basis = TABLE_CHEBYSHEV, .w_min = 0, .w_max = 2};
    assert_near(table_weight(&t, 2, 1.5), 2 * 0.25 - 1, 1e-15); // T2(x) = 2 x^2 - 1 at x = 0.5
    t.basis = TABLE_TAYLOR;
    assert_near(table_weight(&t, 2, 1.5), 2.25, 1e-15);
    t.basis = TABLE_POD;
    t.nw = 3;
    t.curve = (double[]){0, 1, 4, 0, 0, 0, 1, 1, 1};
    assert_near(table_weight(&t, 0, 1.5), 2.5, 1e-15);
    assert_near(table_weight(&t, 0, 3), 4, 1e-15);
}

TEST(impossible_nodes_are_refused)
{
    struct table t;
    struct err e = {0};
    assert_false(table_init(&t, 501, 0.35, 2, 1, &e));
    assert_string_equal(e.msg, "bad table power 2: must be odd (1, 3, 5, ...)");
    assert_false(table_init(&t, 0, 0.35, 1, 1, &e));
    assert_string_equal(e.msg, "bad table size 0: must be 2 to 65536 nodes a side");
    assert_false(table_init(&t, 9, -1, 1, 1, &e));
    assert_string_equal(e.msg, "bad table range -1: must be above 0 and at most 2 (|h| = 2)");
    assert_false(table_init(&t, 9, NAN, 1, 1, &e));
}

TEST_MAIN(cmocka_unit_test(nodes_and_indices_are_inverses),
          cmocka_unit_test(lookup_is_exact_on_nodes_and_linear_between),
          cmocka_unit_test(weights_follow_their_basis),
          cmocka_unit_test(impossible_nodes_are_refused))

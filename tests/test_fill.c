// test_fill.c - heights for the nodes that were not measured.
#include "tests/test.h"

#include "process/fill.h"

static struct hfield plane(int nx, int ny)
{
    struct hfield hf = {0};
    struct err e = {0};
    assert_true(hfield_init(&hf, nx, ny, 1e-6, 1e-6, &e));
    for (int k = 0; k < nx * ny; k++)
        hf.z[k] = (float)(1e-9 * (3 * (k % nx) - 2 * (k / nx)));
    return hf;
}

TEST(a_plane_is_continued_over_holes_of_any_size)
{
    struct hfield hf = plane(61, 45), want = plane(61, 45);
    struct err e = {0};
    long holes = 0, filled;
    for (int j = 5; j < 40; j++)
        for (int i = 7; i < 50; i++) {
            hf.z[j * 61 + i] = NAN;
            holes++;
        }
    assert_true(hfield_fill(&hf, &filled, &e));
    assert_int_equal(filled, holes);
    for (int k = 0; k < 61 * 45; k++)
        assert_near(hf.z[k], want.z[k], 1e-11); // 0.01 nm of a span of 270 nm
    hfield_finish(&hf);
    hfield_finish(&want);
}

TEST(holes_at_the_edge_stay_within_what_was_measured)
{
    struct hfield hf = plane(20, 1 + 9);
    struct err e = {0};
    long filled;
    for (int j = 0; j < 10; j++)
        for (int i = 15; i < 20; i++)
            hf.z[j * 20 + i] = NAN;
    assert_true(hfield_fill(&hf, &filled, &e));
    for (int k = 0; k < 200; k++)
        assert_true(hf.z[k] >= -1.9e-8f && hf.z[k] <= 4.3e-8f);
    hfield_finish(&hf);
}

TEST(nothing_measured_cannot_be_filled)
{
    struct hfield hf = {0};
    struct err e = {0};
    long filled;
    assert_true(hfield_init(&hf, 4, 4, 1e-6, 1e-6, &e));
    assert_false(hfield_fill(&hf, &filled, &e));
    assert_string_equal(e.msg, "no node was measured: nothing to fill from");
    hfield_finish(&hf);
}

TEST_MAIN(cmocka_unit_test(a_plane_is_continued_over_holes_of_any_size),
          cmocka_unit_test(holes_at_the_edge_stay_within_what_was_measured),
          cmocka_unit_test(nothing_measured_cannot_be_filled))

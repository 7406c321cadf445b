// test_table_file.c - diffraction tables come back from files; what a file does not say is asked
// for.
#include "core/imgfile.h"
#include "core/mem.h"
#include "core/table.h"
#include "tests/test.h"

static struct table made(int n, int count, enum table_basis basis)
{
    struct table t;
    struct err e;
    assert_true(table_init(&t, n, 0.6, 5, count, &e));
    t.basis = basis;
    for (int k = 0; k < count * n * n * 3; k++)
        t.tab[k] = (float)cos(0.3 * k) / 3;
    if (basis != TABLE_PLAIN) {
        t.w_min = 1.0 / 3;
        t.w_max = 2;
    }
    if (basis == TABLE_POD) {
        t.nw = 7;
        t.curve = xcalloc((size_t)(count * t.nw), sizeof *t.curve);
        for (int k = 0; k < count * t.nw; k++)
            t.curve[k] = sin(k) / 7;
    }
    meta_set_text(&t.meta, "nacre.illuminant", "E");
    meta_set_nums(&t.meta, "nacre.error", (double[]){0.1, 0.01}, 2);
    return t;
}

static void add_sigma_and_cover(struct table *t)
{
    const size_t n2 = (size_t)t->n * (size_t)t->n;
    t->sigma = xcalloc(n2 * 3, sizeof *t->sigma);
    t->cover = xcalloc(n2, sizeof *t->cover);
    for (size_t k = 0; k < n2; k++) {
        t->sigma[3 * k + 1] = (float)k / 3;
        t->cover[k] = (float)(k % 2);
    }
}

static struct table again(const struct table *t, const char *path, const struct table_nodes *nodes)
{
    struct table back = {0};
    struct err e = {0};
    if (!table_write(t, path, &e) || !table_read(&back, path, nodes, &e))
        fail_msg("%s", e.msg);
    unlink(path);
    return back;
}

static void assert_same(const struct table *a, const struct table *b)
{
    const size_t n2 = (size_t)a->n * (size_t)a->n;
    assert_int_equal(a->n, b->n);
    assert_int_equal(a->count, b->count);
    assert_int_equal(a->basis, b->basis);
    assert_int_equal(a->power, b->power);
    assert_int_equal(a->is_rgb, b->is_rgb);
    assert_near(a->range, b->range, 0);
    assert_near(a->w_min, b->w_min, 0);
    assert_near(a->w_max, b->w_max, 0);
    assert_memory_equal(a->tab, b->tab, n2 * 3 * (size_t)a->count * sizeof(float));
    assert_int_equal(a->nw, b->nw);
    if (a->curve)
        assert_memory_equal(a->curve, b->curve, (size_t)(a->count * a->nw) * sizeof(double));
    assert_int_equal(!a->sigma, !b->sigma);
    if (a->sigma)
        assert_memory_equal(a->sigma, b->sigma, n2 * 3 * sizeof(float));
    assert_int_equal(!a->cover, !b->cover);
    if (a->cover)
        assert_memory_equal(a->cover, b->cover, n2 * sizeof(float));
}

TEST(an_exr_keeps_the_whole_table)
{
    static const struct {
        int n, count;
        enum table_basis basis;
        bool is_rgb, extras;
    } cases[] = {
        {9, 1, TABLE_PLAIN, false, false},    {33, 1, TABLE_PLAIN, true, true},
        {8, 1, TABLE_POD, false, true},       {17, 12, TABLE_POD, true, false},
        {5, 3, TABLE_CHEBYSHEV, false, true}, {5, 70, TABLE_TAYLOR, false, false},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct table t = made(cases[k].n, cases[k].count, cases[k].basis);
        t.is_rgb = cases[k].is_rgb;
        if (cases[k].extras)
            add_sigma_and_cover(&t);
        struct table back = again(&t, "table_a.exr", NULL);
        assert_same(&t, &back);
        assert_int_equal(back.meta.n, t.meta.n);
        assert_string_equal(meta_text(&back.meta, "nacre.illuminant"), "E");
        assert_near(meta_find(&back.meta, "nacre.error")->num[1], 0.01, 0);
        table_finish(&t);
        table_finish(&back);
    }
}

TEST(a_pfm_keeps_the_samples_with_the_first_row_on_top)
{
    struct table t = made(9, 1, TABLE_PLAIN);
    struct err e = {0};
    const struct table_nodes nodes = {0.6, 5};
    struct image im;
    assert_true(table_write(&t, "table_b.pfm", &e));
    assert_true(image_read(&im, "table_b.pfm", &e));
    assert_near(im.px[3], t.tab[3], 0); // row 0 is v = -R, the top row
    image_finish(&im);
    struct table back = again(&t, "table_b.pfm", &nodes);
    assert_same(&t, &back);
    table_finish(&t);
    table_finish(&back);
}

TEST(what_a_table_file_does_not_say_is_refused)
{
    struct table t = made(9, 1, TABLE_PLAIN), pod = made(9, 2, TABLE_POD), back = {0};
    struct err e = {0};
    const struct table_nodes nodes = {0.6, 5}, even = {0.6, 2};
    struct image im;
    assert_true(table_write(&t, "table_c.pfm", &e));
    assert_false(table_read(&back, "table_c.pfm", NULL, &e));
    assert_string_equal(
        e.msg, "table_c.pfm: the file does not say range and power: give --range, --power");
    assert_false(table_read(&back, "table_c.pfm", &even, &e));
    assert_string_equal(e.msg, "table_c.pfm: bad table power 2: must be odd (1, 3, 5, ...)");
    assert_false(table_write(&pod, "table_c.pfm", &e));
    assert_string_equal(e.msg, "table_c.pfm: only .exr holds tables over w (2 tables)");
    t.tab[(4 * 9 + 2) * 3] = NAN;
    assert_true(table_write(&t, "table_c.pfm", &e));
    assert_false(table_read(&back, "table_c.pfm", &nodes, &e));
    assert_string_equal(e.msg, "table_c.pfm: node (2, 4) is NaN");
    assert_true(image_init(&im, 9, 8, 3, &e));
    assert_true(image_write(&im, "table_c.pfm", &e));
    assert_false(table_read(&back, "table_c.pfm", &nodes, &e));
    assert_string_equal(e.msg, "table_c.pfm: not a table: it must be square, not 9 x 8");
    image_finish(&im);
    assert_true(image_init(&im, 9, 9, 1, &e));
    assert_true(image_write(&im, "table_c.pfm", &e));
    assert_false(table_read(&back, "table_c.pfm", &nodes, &e));
    assert_string_equal(e.msg, "table_c.pfm: not a table: it has no channels X,Y,Z or R,G,B");
    assert_false(table_read(&back, "table_none.exr", &nodes, &e));
    assert_int_equal(e.code, ERR_FILE);
    assert_null(back.tab);
    image_finish(&im);
    table_finish(&t);
    table_finish(&pod);
    unlink("table_c.pfm");
}

TEST(tables_with_broken_metadata_are_refused)
{
    static const struct {
        const char *key, *text;
        double num[3];
        int n;
        const char *msg;
    } cases[] = {
        {"nacre.basis",
         "fourier",
         {0},
         0,
         "unknown basis 'fourier': must be plain taylor chebyshev pod"},
        {"nacre.basis", "plain", {0}, 0, "2 tables without a basis"},
        {"nacre.w_range", NULL, {2, 1}, 2, "no valid nacre.w_range: must be two rising numbers"},
        {"nacre.w_range", "x", {0}, 0, "no valid nacre.w_range: must be two rising numbers"},
        {"nacre.curves",
         NULL,
         {2, 1, 0},
         3,
         "no valid nacre.curves: must be 2 or more samples a table"},
        {"nacre.power", NULL, {4}, 1, "bad table power 4: must be odd (1, 3, 5, ...)"},
        {"nacre.power", NULL, {2.5}, 1, "bad table power 2.5: must be odd (1, 3, 5, ...)"},
        {"nacre.range",
         NULL,
         {-1},
         1,
         "bad table range -1: must be above 0 and at most 2 (|h| = 2)"},
        {"nacre.range",
         "far",
         {0},
         0,
         "the file does not say range and power: give --range, --power"},
    };
    struct table t = made(9, 2, TABLE_POD), back = {0};
    struct err e = {0};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct image im;
        char want[256];
        assert_true(table_write(&t, "table_d.exr", &e) && image_read(&im, "table_d.exr", &e));
        if (cases[k].text)
            meta_set_text(&im.meta, cases[k].key, cases[k].text);
        else
            meta_set_nums(&im.meta, cases[k].key, cases[k].num, cases[k].n);
        assert_true(image_write(&im, "table_d.exr", &e));
        image_finish(&im);
        assert_false(table_read(&back, "table_d.exr", NULL, &e));
        snprintf(want, sizeof want, "table_d.exr: %s", cases[k].msg);
        assert_string_equal(e.msg, want);
        assert_int_equal(e.code, ERR_DATA);
        assert_null(back.tab);
    }
    table_finish(&t);
    unlink("table_d.exr");
}

TEST_MAIN(cmocka_unit_test(an_exr_keeps_the_whole_table),
          cmocka_unit_test(a_pfm_keeps_the_samples_with_the_first_row_on_top),
          cmocka_unit_test(what_a_table_file_does_not_say_is_refused),
          cmocka_unit_test(tables_with_broken_metadata_are_refused))

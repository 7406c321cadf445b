// test_stability.c - numeric functions at the ends of the number line, a short run of nacre bench
// stability.
#include "tests/test.h"

#include "core/geom.h"
#include "render/material.h"
#include "tests/bench/stability.h"

TEST(no_function_leaves_its_bound_at_extreme_arguments)
{
    static struct stability_result w[256];
    char at[300];
    const int n = stability_count();
    assert_in_range(n, 1, 256);
    stability_run(60000, 1, w);
    int bad = 0;
    for (int k = 0; k < n; k++) {
        const struct stability_probe *p = w[k].probe;
        if (w[k].not_finite)
            print_error("%s: not finite %ld times, first at (%s)\n", p->name, w[k].not_finite,
                        stability_text(p, w[k].flaw, at, sizeof at));
        if (w[k].broken)
            print_error("%s: %.2g of %s, bound %.2g, %ld times, worst at (%s)\n", p->name,
                        w[k].worst, p->unit, p->bound, w[k].broken,
                        stability_text(p, w[k].at, at, sizeof at));
        bad += w[k].not_finite || w[k].broken;
    }
    assert_int_equal(bad, 0);
}

TEST(the_same_seed_gives_the_same_errors)
{
    static struct stability_result a[256], b[256];
    stability_run(3000, 7, a);
    stability_run(3000, 7, b);
    for (int k = 0; k < stability_count(); k++) {
        assert_true(a[k].worst == b[k].worst);
        assert_true(a[k].worst == 0 || stability_once(&a[k]) == a[k].worst);
    }
}

// Each of these once hung, was NaN, or had no digit right.
TEST(what_the_probes_found_stays_mended)
{
    assert_near(v3_norm(v3(3e200, 4e200, 0)) / 5e200, 1, 1e-15);
    assert_near(v3_norm(v3(0, 3e-200, 4e-200)) / 5e-200, 1, 1e-15);
    assert_near(v3_unit(v3(0, 3e-310, 4e-310)).z, 0.8, 1e-12);
    struct frame f;
    assert_true(frame_from(v3(1e-200, 0, 0), v3(0, 0, 1e200), &f));
    assert_near(coat_through(1, 1e-9), 1, 0); // no coat
    assert_near(coat_through(1, 1e-200), 1, 0);
    struct material m;
    double out[3];
    material_init(&m);
    m.specular[0] = m.specular[1] = m.specular[2] = 0.04;
    m.roughness = 3;
    material_specular(&m, v3(1, 0, 1e-170), v3(1, 0, 1e-170), out);
    assert_true(out[0] == 0);
    material_specular(&m, v3(1, 0, 1e-170), v3(-1, 0, 1e-170), out);
    assert_true(isfinite(out[0]) && out[0] > 0);
}

TEST_MAIN(cmocka_unit_test(no_function_leaves_its_bound_at_extreme_arguments),
          cmocka_unit_test(the_same_seed_gives_the_same_errors),
          cmocka_unit_test(what_the_probes_found_stays_mended))

// test_yaml.c - values with units; every refusal names file, line and reason.
#include "core/yaml.h"
#include "tests/test.h"

static bool read_sample(const char *text, double *pitch, int *count, int *kind, struct err *e)
{
    struct yaml *y = NULL;
    if (!yaml_open_text(&y, "s.yaml", text, e))
        return false;
    struct ynode *root = yaml_root(y), *inner = NULL;
    const bool ok = ymap_choice(root, "kind", Y_NEEDED, "flat|cd|lcd", kind, e) &&
                    ymap_map(root, "grid", Y_OPTIONAL, &inner, e) &&
                    (!inner || (ymap_num(inner, "pitch", Y_NEEDED, UNIT_M, 1e-9, 1, pitch, e) &&
                                ymap_int(inner, "count", Y_OPTIONAL, 1, 100, count, e)));
    struct err ignored;
    return yaml_close(y, ok, ok ? e : &ignored) && ok;
}

TEST(values_carry_units)
{
    double pitch = 0;
    int count = 7, kind = -1;
    struct err e = {0};
    if (!read_sample("kind: lcd\ngrid:\n  pitch: 25um\n", &pitch, &count, &kind, &e))
        fail_msg("%s", e.msg);
    assert_near(pitch, 25e-6, 1e-20);
    assert_int_equal(count, 7);
    assert_int_equal(kind, 2);
}

TEST(refusals_name_file_line_and_reason)
{
    static const struct {
        const char *text, *msg;
    } bad[] = {
        {"kind: lcd\ngrid:\n  pitch: -2um\n",
         "s.yaml:3: pitch: -2um is out of range: must be 1 nm to 1 m"},
        {"kind: lcd\ngrid:\n  pitch: 2s\n",
         "s.yaml:3: pitch: '2s' is not a length such as 530nm or 0.25um"},
        {"kind: lcd\ngrid:\n  pich: 2um\n", "s.yaml:3: grid: needs the key 'pitch'"},
        {"kind: lcd\ngrid:\n  pitch: 2um\n  cont: 3\n",
         "s.yaml:4: cont: unknown key, did you mean 'count'?"},
        {"kind: lce\n", "s.yaml:1: kind: 'lce' is not one of flat|cd|lcd"},
        {"kind: lcd\nkind: cd\n", "s.yaml:2: kind: given twice"},
        {"kind: lcd\ngrid: 3\n", "s.yaml:2: grid: expected a map of 'key: value' lines"},
        {"kind: lcd\ngrid:\n  pitch: 2um\n  count: 1.5\n",
         "s.yaml:4: count: 1.5 is not a whole number"},
        {"- a\n- b\n", "s.yaml:1: expected 'key: value' lines"},
        {"", "s.yaml: is empty"},
        {"a: [1, 2\n", NULL},
        {"a: &x [*x]\n", NULL},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        double pitch;
        int count, kind;
        struct err e = {0};
        assert_false(read_sample(bad[k].text, &pitch, &count, &kind, &e));
        if (bad[k].msg)
            assert_string_equal(e.msg, bad[k].msg);
        assert_int_equal(e.code, ERR_DATA);
    }
}

TEST_MAIN(cmocka_unit_test(values_carry_units),
          cmocka_unit_test(refusals_name_file_line_and_reason))

// fuzz_yaml.c - any bytes as a YAML file: read as text, walked, and judged as a rig.
#include "core/rig.h"
#include "core/yaml.h"
#include "tests/fuzz/fuzz.h"

static void walk(struct ynode *n, int depth)
{
    struct err e;
    double v;
    ynode_num(n, UNIT_M, -1, 1, &v, &e);
    for (int k = 0; depth < 20 && k < ylist_count(n); k++)
        walk(ylist_at(n, k), depth + 1);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct yaml *y = NULL;
    struct err e = {0};
    const char *path = fuzz_file(data, size);
    if (!yaml_open(&y, path, &e)) {
        fuzz_failed(&e);
    } else {
        struct ynode *root = yaml_root(y);
        if (ynode_is_list(root))
            walk(root, 0);
        if (!yaml_close(y, true, &e))
            fuzz_failed(&e);
    }
    struct rig rig = {0};
    if (!rig_open(&rig, path, &e))
        fuzz_failed(&e);
    else
        rig_finish(&rig);
    return 0;
}

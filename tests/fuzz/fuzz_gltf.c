// fuzz_gltf.c - any bytes as a glTF mesh.
#include "render/mesh.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct mesh m;
    struct err e;
    if (mesh_read_gltf(&m, fuzz_file(data, size), 1, NULL, &e))
        mesh_finish(&m);
    else
        fuzz_failed(&e);
    return 0;
}

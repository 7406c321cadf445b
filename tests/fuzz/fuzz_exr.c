// fuzz_exr.c - any bytes as an OpenEXR picture.
#include "core/codec.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_image(exr_read, data, size);
}

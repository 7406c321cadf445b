// fuzz_rgbe.c - any bytes as a Radiance picture.
#include "core/codec.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_image(rgbe_read, data, size);
}

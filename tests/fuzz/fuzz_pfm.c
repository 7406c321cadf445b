// fuzz_pfm.c - any bytes as a PFM picture.
#include "core/codec.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_image(pfm_read, data, size);
}

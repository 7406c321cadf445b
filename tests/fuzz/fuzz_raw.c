// fuzz_raw.c - any bytes as a camera raw file.
#include "core/codec.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_image(raw_read, data, size);
}

// fuzz_x3p.c - any bytes as an X3P surface.
#include "core/hcodec.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_hfield(x3p_read, data, size);
}

// fuzz_nanoscope.c - any bytes as a Nanoscope scan.
#include "core/hcodec.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_hfield(nanoscope_read, data, size);
}

// fuzz_gsf.c - any bytes as a Gwyddion Simple Field.
#include "core/hcodec.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_hfield(gsf_read, data, size);
}

// fuzz_dng.c - any bytes as a frame of a session.
#include "core/dng.h"
#include "tests/fuzz/fuzz.h"
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct dng d = {0};
    struct err e = {0};
    if (!dng_read(&d, fuzz_file(data, size), &e))
        fuzz_failed(&e);
    else if (d.w < 1 || d.h < 1 || !d.raw)
        abort();
    dng_finish(&d);
    return 0;
}

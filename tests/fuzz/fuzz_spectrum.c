// fuzz_spectrum.c - any bytes as a spectrum in CSV.
#include "core/spectrum.h"
#include "tests/fuzz/fuzz.h"
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct spectrum s = {0};
    struct err e = {0};
    if (!spectrum_read_csv(&s, fuzz_file(data, size), &e))
        fuzz_failed(&e);
    else if (s.n < 2 || !(s.lambda_m[0] < s.lambda_m[s.n - 1]))
        abort();
    spectrum_finish(&s);
    return 0;
}

// fuzz_picture.c - any bytes as a PNG, JPEG or TIFF picture.
#include "core/codec.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_image(picture_read, data, size);
}

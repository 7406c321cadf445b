// fuzz.h - what a parser must do with any bytes: succeed with a sane result, or fail with a reason.
//
// A harness is one LLVMFuzzerTestOneInput(). With clang and -DNACRE_FUZZ=ON libFuzzer drives it;
// otherwise replay.c runs it over the corpus in the tree, as a test.
#pragma once
#include "core/err.h"
#include <stddef.h>
#include <stdint.h>

struct image;
struct hfield;
struct hfield_hints;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

// The bytes as a file in memory; its path lives until the next call.
const char *fuzz_file(const uint8_t *data, size_t size);

void fuzz_failed(const struct err *e); // aborts unless the error says why

int fuzz_image(bool (*read)(struct image *im, const char *path, struct err *e), const uint8_t *data,
               size_t size);
int fuzz_hfield(bool (*read)(struct hfield *hf, const char *path, const struct hfield_hints *hints,
                             struct err *e),
                const uint8_t *data, size_t size);

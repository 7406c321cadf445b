// fuzz_x3p_doc.c - any bytes as the XML document of an X3P surface.
#include "core/mem.h"
#include "core/x3p.h"
#include "tests/fuzz/fuzz.h"
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct x3p_doc *d = xcalloc(1, sizeof *d);
    struct err e = {0};
    if (!x3p_doc_parse(d, (const char *)data, size, &e))
        fuzz_failed(&e);
    free(d);
    return 0;
}

// x3p.h - the XML document of an X3P file (ISO 25178-72): what nacre reads of it, and writing it.
#pragma once
#include "core/hfield.h"
#include <stddef.h>

struct x3p_doc { // texts as they stand, "" when absent
    char feature[8], x_axis[8], y_axis[8], z_axis[8], z_type[8];
    char dx[40], dy[40], dz[40], x_offset[40], y_offset[40], z_offset[40];
    char nx[16], ny[16], nz[16];
    char data_link[128], data_md5[40], valid_link[128], valid_md5[40];
    char checksum_link[128];
    char comment[1 << 16]; // "key = value" lines, ours
    bool has_list;         // samples as text inside the document
};

bool x3p_doc_parse(struct x3p_doc *d, const char *xml, size_t size, struct err *e);

// The document for float32 samples with this MD5 (32 hex digits); free() it.
char *x3p_doc_text(const struct hfield *hf, const char *data_md5);

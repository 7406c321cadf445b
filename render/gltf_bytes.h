// gltf_bytes.h - where glTF keeps its bytes: parts of a .glb, files beside, data within the text.
#pragma once
#include "core/err.h"
#include <stddef.h>

struct gltf_bytes {
    unsigned char *at;
    size_t size;
};

// The JSON and the binary part of a .glb, within the file's own bytes; `binary` is empty where
// there is none. ERR_DATA unless the parts fill the file. A file that is not binary is all text.
bool gltf_split(struct gltf_bytes file, struct gltf_bytes *text, struct gltf_bytes *binary,
                struct err *e);

// What a buffer's URI names: base64 after "data:...;base64,", else a file beside `path`. Free `at`.
bool gltf_uri(const char *path, const char *uri, struct gltf_bytes *out, struct err *e);

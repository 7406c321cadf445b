// product.h - a file made from a session, with all that is needed to make it once more.
//
// Records are facts of the session's ledger, so they travel with it. Within a session all paths are
// relative to its folder: a session that was moved or copied can still be proven.
#pragma once
#include "core/session.h"

struct product_input {
    char *path; // as the command has it; owned
    char sha256[SHA256_TEXT];
};

struct product {
    char *path;    // "products/radiance.exr"; absolute when it lies elsewhere
    char *folder;  // where the command ran; "" is the session's folder
    char *command; // "nacre hdr . -o products/radiance.exr"
    char *version;
    char sha256[SHA256_TEXT];
    int64_t utc_ns; // when
    int n_inputs;
    struct product_input *input; // [n_inputs], owned
};

void product_add_input(struct product *p, const char *path, const char *sha256);
void product_finish(struct product *p); // accepts a zeroed struct

// SHA-256 of an input: a file, or of a session what was photographed: its rig and its good frames.
// ERR_FILE: neither.
bool product_hash(const char *path, char hex[SHA256_TEXT], struct err *e);

// Replaces what the ledger says of the same path. Also while a capture is writing the session.
bool product_record(const char *session, const struct product *p, struct err *e);

// All of a session, in the order in which they were made. Free each and the array.
bool product_list(struct session *s, struct product **product, int *n, struct err *e);

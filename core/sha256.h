// sha256.h - SHA-256 of memory and of files, as 64 hexadecimal digits.
#pragma once
#include "core/err.h"
#include <stddef.h>

enum { SHA256_TEXT = 65 }; // with the closing zero

struct sha256; // a sum in progress

struct sha256 *sha256_new(void);
void sha256_add(struct sha256 *s, const void *data, size_t size);
void sha256_end(struct sha256 *s, char hex[SHA256_TEXT]); // frees s; hex may be NULL

void sha256_of(const void *data, size_t size, char hex[SHA256_TEXT]);
bool sha256_file(const char *path, char hex[SHA256_TEXT], struct err *e); // ERR_FILE

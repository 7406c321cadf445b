// mem.h - memory: small things abort when there is none, image-sized ones are checked.
#pragma once
#include "core/err.h"
#include <stddef.h>

// Zeroed; aborts when there is no memory. For things of a few kB whose size no file decides.
void *xcalloc(size_t count, size_t size);
char *xstrdup(const char *s);
char *xasprintf(const char *fmt, ...) __attribute__((format(printf, 1, 2)));
void *xrealloc(void *p, size_t count, size_t size); // aborts on overflow or no memory

// 64-byte aligned, zeroed, for samples; free() it. NULL and ERR_FILE when it does not fit in memory
// or count * size overflows; `what` names the thing in the message.
void *sample_alloc(size_t count, size_t size, const char *what, struct err *e);

// mem.c - allocation with a stated reaction to failure.
#define _GNU_SOURCE
#include "core/mem.h"
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

static void *or_abort(void *p)
{
    if (!p) {
        fputs("nacre: out of memory\n", stderr);
        abort();
    }
    return p;
}

void *xcalloc(size_t count, size_t size)
{
    return or_abort(calloc(count ? count : 1, size ? size : 1));
}

char *xstrdup(const char *s)
{
    return or_abort(strdup(s));
}

char *xasprintf(const char *fmt, ...)
{
    char *s = NULL;
    va_list ap;
    va_start(ap, fmt);
    int n = vasprintf(&s, fmt, ap);
    va_end(ap);
    return or_abort(n < 0 ? NULL : s);
}

void *xrealloc(void *p, size_t count, size_t size)
{
    size_t bytes;
    return or_abort(__builtin_mul_overflow(count, size, &bytes) ? NULL
                                                                : realloc(p, bytes + !bytes));
}

void *sample_alloc(size_t count, size_t size, const char *what, struct err *e)
{
    size_t bytes = 0;
    const size_t machine = (size_t)sysconf(_SC_PHYS_PAGES) * (size_t)sysconf(_SC_PAGESIZE);
    const bool overflow = __builtin_mul_overflow(count, size, &bytes) || bytes > SIZE_MAX - 64;
    if (overflow || bytes > machine) {
        err_set(e, ERR_FILE, "%s: needs %.3g GB, this machine has %.3g GB", what,
                (double)count * (double)size * 1e-9, (double)machine * 1e-9);
        return NULL;
    }
    const size_t huge = (size_t)2 << 20, unit = bytes >= 2 * huge ? huge : 64;
    const size_t whole = (bytes + unit - 1 + !bytes) / unit * unit;
    void *p = aligned_alloc(unit, whole);
    if (!p) {
        err_set(e, ERR_FILE, "%s: no memory for %.3g GB", what, (double)bytes * 1e-9);
        return NULL;
    }
    if (unit == huge) // 2 MB pages: zeroing fresh memory is then three times faster
        madvise(p, whole, MADV_HUGEPAGE);
    return memset(p, 0, whole);
}

// err.c - errors as one line of text and a code that says how to react.
#include "core/err.h"
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

// A message is one line, whatever a file name or a header put into it.
static bool one_line(struct err *e)
{
    for (char *c = e->msg; *c; c++)
        *c = (unsigned char)*c < ' ' || *c == 0x7f ? '?' : *c;
    return false;
}

bool err_set(struct err *e, enum err_code code, const char *fmt, ...)
{
    va_list ap;
    va_start(ap, fmt);
    e->code = code;
    vsnprintf(e->msg, sizeof e->msg, fmt, ap);
    va_end(ap);
    return one_line(e);
}

bool err_in(struct err *e, const char *fmt, ...)
{
    char old[sizeof e->msg], context[sizeof e->msg];
    memcpy(old, e->msg, sizeof old);
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(context, sizeof context, fmt, ap);
    va_end(ap);
    snprintf(e->msg, sizeof e->msg, "%.150s: %.240s", context, old);
    return one_line(e);
}

bool err_errno(struct err *e, const char *fmt, ...)
{
    const char *reason = strerror(errno);
    char what[sizeof e->msg];
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(what, sizeof what, fmt, ap);
    va_end(ap);
    return err_set(e, ERR_FILE, "%.300s: %s", what, reason);
}

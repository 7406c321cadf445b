// log.c - notes, warnings, progress bars on stderr.
#define _GNU_SOURCE
#include "core/log.h"
#include <stdarg.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

bool log_quiet, log_no_color;

static bool is_terminal(void)
{
    return isatty(STDERR_FILENO);
}

static void say(const char *color, const char *mark, const char *fmt, va_list ap)
{
    const bool colored = is_terminal() && !log_no_color;
    fprintf(stderr, "%s%s%s", colored ? color : "", mark, colored ? "\033[0m" : "");
    vfprintf(stderr, fmt, ap);
    fputc('\n', stderr);
}

void log_note(const char *fmt, ...)
{
    if (log_quiet)
        return;
    va_list ap;
    va_start(ap, fmt);
    say("", "", fmt, ap);
    va_end(ap);
}

void log_warn(const char *fmt, ...)
{
    if (log_quiet)
        return;
    va_list ap;
    va_start(ap, fmt);
    say("\033[33m", "warning: ", fmt, ap);
    va_end(ap);
}

void log_error(const char *fmt, ...)
{
    va_list ap;
    va_start(ap, fmt);
    say("\033[31m", "nacre: ", fmt, ap);
    va_end(ap);
}

double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void progress_start(struct progress *p, const char *what, long total)
{
    *p = (struct progress){.what = what, .total = total > 0 ? total : 1, .start_s = now_s()};
}

static void draw(struct progress *p, double now)
{
    enum { WIDTH = 32 };
    static const char *const eighths[] = {" ",      "\u258f", "\u258e", "\u258d",
                                          "\u258c", "\u258b", "\u258a", "\u2589"};
    const double part = (double)p->done / (double)p->total;
    const int filled = (int)(part * WIDTH * 8);
    const double left = part > 0 ? (now - p->start_s) * (1 - part) / part : 0;
    fprintf(stderr, "\r\033[K%-14s ", p->what);
    for (int k = 0; k < WIDTH; k++)
        fputs(filled >= 8 * (k + 1) ? "\u2588"
              : filled > 8 * k      ? eighths[filled - 8 * k]
                                    : "\u00b7",
              stderr);
    fprintf(stderr, " %3d%%  %4.1f s left", (int)(100 * part), left);
    fflush(stderr);
    p->drawn_s = now;
}

void progress_step(struct progress *p, long by)
{
    const long done = __atomic_add_fetch(&p->done, by, __ATOMIC_RELAXED);
    if (log_quiet || !is_terminal())
        return;
#pragma omp critical(nacre_progress)
    {
        const double now = now_s();
        if (now - p->drawn_s > 0.05 || done >= p->total)
            draw(p, now);
    }
}

void progress_end(struct progress *p)
{
    if (!log_quiet && is_terminal() && p->drawn_s > 0)
        fputs("\r\033[K", stderr);
}

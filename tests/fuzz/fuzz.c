// fuzz.c - bytes as a file, and what is asked of every reader.
#define _GNU_SOURCE
#include "tests/fuzz/fuzz.h"
#include "core/hfield_file.h"
#include "core/image.h"
#include "core/log.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

const char *fuzz_file(const uint8_t *data, size_t size)
{
    static int fd = -1;
    static char path[64];
    log_quiet = true;
    if (fd < 0)
        fd = memfd_create("fuzz", MFD_CLOEXEC);
    snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
    if (ftruncate(fd, 0) || pwrite(fd, data, size, 0) != (ssize_t)size)
        abort();
    return path;
}

void fuzz_failed(const struct err *e)
{
    if ((e->code != ERR_DATA && e->code != ERR_FILE) || !*e->msg || strchr(e->msg, '\n'))
        abort();
}

int fuzz_image(bool (*read)(struct image *im, const char *path, struct err *e), const uint8_t *data,
               size_t size)
{
    struct image im = {0};
    struct err e = {0};
    if (!read(&im, fuzz_file(data, size), &e))
        fuzz_failed(&e);
    else if (im.w < 1 || im.h < 1 || im.nc < 1 || !im.px || image_flaws(&im).n < 0)
        abort();
    image_finish(&im);
    return 0;
}

int fuzz_hfield(bool (*read)(struct hfield *hf, const char *path, const struct hfield_hints *hints,
                             struct err *e),
                const uint8_t *data, size_t size)
{
    struct hfield hf = {0};
    struct err e = {0};
    if (!read(&hf, fuzz_file(data, size), NULL, &e))
        fuzz_failed(&e);
    else if (hf.nx < 2 || hf.ny < 2 || !hf.z || !(hf.dx_m > 0 && hf.dy_m > 0) ||
             hfield_missing(&hf) < 0)
        abort();
    hfield_finish(&hf);
    return 0;
}

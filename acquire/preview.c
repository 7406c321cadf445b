// preview.c - a sequence lock over two pictures in a memfd.
#define _GNU_SOURCE
#include "acquire/preview.h"
#include "core/mem.h"
#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

struct preview {
    int fd;
    struct preview_memory *memory;
};

struct preview *preview_new(struct err *e)
{
    struct preview *p = xcalloc(1, sizeof *p);
    const size_t size = sizeof *p->memory;
    p->fd = memfd_create("nacre-preview", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    if (p->fd >= 0 && !ftruncate(p->fd, (off_t)size) &&
        !fcntl(p->fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW))
        p->memory = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED, p->fd, 0);
    if (!p->memory || p->memory == MAP_FAILED) {
        err_errno(e, "preview");
        p->memory = NULL;
        preview_free(p);
        return NULL;
    }
#ifdef F_SEAL_FUTURE_WRITE
    fcntl(p->fd, F_ADD_SEALS, F_SEAL_FUTURE_WRITE); // lookers-on only look
#endif
    p->memory->magic = PREVIEW_MAGIC;
    p->memory->version = 1;
    return p;
}

void preview_free(struct preview *p)
{
    if (!p)
        return;
    if (p->memory)
        munmap(p->memory, sizeof *p->memory);
    if (p->fd >= 0)
        close(p->fd);
    free(p);
}

int preview_fd(const struct preview *p)
{
    return p->fd;
}

void preview_show(struct preview *p, const struct cam_frame *f, const struct cam_caps *caps)
{
    const uint32_t next = 1 - atomic_load(&p->memory->current);
    struct preview_picture *to = &p->memory->picture[next];
    const int side = f->w > f->h ? f->w : f->h, every = (side + PREVIEW_SIDE - 1) / PREVIEW_SIDE;
    const int cell = caps->pattern == CAM_MONO ? 1 : 2;
    atomic_fetch_add(&to->serial, 1);
    to->w = f->w / every / cell * cell;
    to->h = f->h / every / cell * cell;
    to->pattern = (int32_t)caps->pattern;
    to->white = (1 << caps->bits) - 1;
    to->black = caps->black;
    to->exposure_ns = f->exposure_ns;
    to->device_ns = f->device_ns;
    to->seq = f->seq;
    for (int j = 0; j < to->h; j++) {
        const uint16_t *row = f->raw + (size_t)(j / cell * cell * every + j % cell) * (size_t)f->w;
        for (int i = 0; i < to->w; i++)
            to->px[j * to->w + i] = row[i / cell * cell * every + i % cell];
    }
    atomic_fetch_add(&to->serial, 1);
    atomic_store(&p->memory->current, next);
}

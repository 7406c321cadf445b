// outfile.c - write beside, sync, rename: readers never see half a file.
#define _GNU_SOURCE
#include "core/outfile.h"
#include "core/mem.h"
#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char *folder_of(const char *path)
{
    char *copy = xstrdup(path), *dir = xstrdup(dirname(copy));
    free(copy);
    return dir;
}

bool outfile_open(struct outfile *o, const char *path, struct err *e)
{
    char *dir = folder_of(path);
    struct stat st;
    bool ok = true;
    if (stat(dir, &st) || !S_ISDIR(st.st_mode))
        ok = err_set(e, ERR_FILE, "%s: cannot write: no folder '%s'", path, dir);
    else if (!stat(path, &st) && S_ISDIR(st.st_mode))
        ok = err_set(e, ERR_FILE, "%s: cannot write: it is a folder", path);
    else if (access(dir, W_OK))
        ok = err_errno(e, "%s: cannot write in '%s'", path, dir);
    if (ok) {
        const char *slash = strrchr(path, '/'), *base = slash ? slash + 1 : path;
        const char *ext = strrchr(base, '.');
        o->path = xstrdup(path);
        o->tmp = xasprintf("%s/.%.*s.%ld%s", dir, ext ? (int)(ext - base) : (int)strlen(base), base,
                           (long)getpid(), ext ? ext : "");
    }
    free(dir);
    return ok;
}

static bool sync_path(const char *path, int flags)
{
    int fd = open(path, flags | O_CLOEXEC);
    if (fd < 0)
        return false;
    bool ok = !fsync(fd) || errno == EINVAL; // some file systems cannot sync a folder
    close(fd);
    return ok;
}

bool outfile_commit(struct outfile *o, struct err *e)
{
    bool ok = sync_path(o->tmp, O_RDONLY) && !rename(o->tmp, o->path);
    if (!ok)
        err_errno(e, "%s: cannot write", o->path);
    if (ok) {
        char *dir = folder_of(o->path);
        ok = sync_path(dir, O_RDONLY | O_DIRECTORY) ||
             err_errno(e, "%s: cannot sync the folder", o->path);
        free(dir);
        free(o->tmp);
        o->tmp = NULL;
    }
    outfile_drop(o);
    return ok;
}

void outfile_drop(struct outfile *o)
{
    if (o->tmp)
        unlink(o->tmp);
    free(o->tmp);
    free(o->path);
    *o = (struct outfile){0};
}

bool outfile_write(const char *path, const void *data, size_t size, struct err *e)
{
    struct outfile o;
    if (!outfile_open(&o, path, e))
        return false;
    FILE *f = fopen(o.tmp, "wb");
    const bool written = f && fwrite(data, 1, size, f) == size;
    const bool closed = f && !fclose(f);
    if (!written || !closed) {
        err_errno(e, "%s: cannot write", path);
        outfile_drop(&o);
        return false;
    }
    return outfile_commit(&o, e);
}

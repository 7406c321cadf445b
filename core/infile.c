// infile.c - files opened for reading.
#define _GNU_SOURCE
#include "core/infile.h"
#include <errno.h>
#include <stdlib.h>
#include <sys/stat.h>

bool infile_open(struct infile *in, const char *path, struct err *e)
{
    struct stat st;
    if (stat(path, &st))
        return err_errno(e, "cannot open");
    if (!S_ISREG(st.st_mode)) // opening a pipe would wait for its writer
        return err_set(e, ERR_FILE, "cannot open: %s",
                       S_ISDIR(st.st_mode) ? "it is a folder" : "not a regular file");
    FILE *f = fopen(path, "rbe");
    if (!f)
        return err_errno(e, "cannot open");
    setvbuf(f, NULL, _IOFBF, 1 << 16);
    *in = (struct infile){f, st.st_size};
    return true;
}

void infile_close(struct infile *in)
{
    if (in->f)
        fclose(in->f);
    *in = (struct infile){0};
}

char *infile_slurp(const char *path, int64_t max, size_t *size, struct err *e)
{
    struct infile in = {0};
    if (!infile_open(&in, path, e))
        return NULL;
    char *data = NULL;
    if (in.size > max) {
        err_set(e, ERR_FILE, "%.4g MB: too large, at most %.4g MB", (double)in.size * 1e-6,
                (double)max * 1e-6);
    } else if (!(data = malloc((size_t)in.size + 1))) {
        err_set(e, ERR_FILE, "no memory for %.4g MB", (double)in.size * 1e-6);
    } else {
        *size = fread(data, 1, (size_t)in.size, in.f);
        data[*size] = 0;
        if (ferror(in.f)) {
            err_errno(e, "cannot read");
            free(data);
            data = NULL;
        }
    }
    infile_close(&in);
    return data;
}

bool infile_claim(int64_t size, double samples, struct err *e)
{
    // Deflate reaches 1032 one-byte samples a byte, a bilevel picture eight times that.
    enum { ALWAYS = 1 << 24, PER_BYTE = 8192 };
    if (samples <= ALWAYS || samples <= (double)PER_BYTE * (double)size)
        return true;
    return err_set(e, ERR_DATA, "claims %.4g million samples in a file of %lld bytes",
                   samples * 1e-6, (long long)size);
}

bool infile_holds(const struct infile *in, double need, struct err *e)
{
    const double left = (double)(in->size - ftello(in->f));
    if (left == need)
        return true;
    return err_set(e, ERR_DATA, "%s: the header asks for %.0f bytes of samples, %.0f follow",
                   left < need ? "cut short" : "wrong size", need, left);
}

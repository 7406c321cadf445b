// rgbe.c - Radiance pictures (.hdr): three 8-bit mantissas and one exponent a pixel.
//
// A value is mantissa * 2^(exponent - 136), as in Ward's later code; his first reader added half a
// step. EXPOSURE lines stay in meta ("nacre.hdr_exposure"), the samples are as stored.
#define _GNU_SOURCE
#include "core/codec.h"
#include "core/infile.h"
#include "core/mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RLE_MIN = 8, RLE_MAX = 32767 }; // row lengths that the new run-length code can hold

// "-Y 512 +X 1024": the slow axis first; "+Y" counts from the bottom, "-X" from the right.
struct order {
    char slow, fast;
    bool slow_up, fast_up; // along rising image coordinates (Y down, X right)
    int n_slow, n_fast;
};

static bool parse_order(const char *line, struct order *o, struct err *e)
{
    char sign[2], axis[2];
    long n[2];
    if (sscanf(line, "%c%c %ld %c%c %ld", &sign[0], &axis[0], &n[0], &sign[1], &axis[1], &n[1]) !=
            6 ||
        !((axis[0] == 'Y' && axis[1] == 'X') || (axis[0] == 'X' && axis[1] == 'Y')) ||
        !strchr("+-", sign[0]) || !strchr("+-", sign[1]))
        return err_set(e, ERR_DATA, "bad Radiance header: size line '%.40s', must be '-Y H +X W'",
                       line);
    if (n[0] < 1 || n[1] < 1 || n[0] > IMAGE_MAX_SIDE || n[1] > IMAGE_MAX_SIDE)
        return err_set(e, ERR_DATA, "bad size %ld x %ld: each side must be 1 to %d pixels",
                       axis[0] == 'Y' ? n[1] : n[0], axis[0] == 'Y' ? n[0] : n[1], IMAGE_MAX_SIDE);
    bool up[2];
    for (int k = 0; k < 2; k++)
        up[k] = (axis[k] == 'Y') == (sign[k] == '-');
    *o = (struct order){axis[0], axis[1], up[0], up[1], (int)n[0], (int)n[1]};
    return true;
}

static bool parse_header(FILE *f, struct order *o, struct meta *m, struct err *e)
{
    char line[512];
    double exposure = 1;
    bool is_xyz = false;
    if (!fgets(line, sizeof line, f) || strncmp(line, "#?", 2))
        return err_set(e, ERR_DATA, "not a Radiance picture: must begin with #?");
    for (;;) {
        if (!fgets(line, sizeof line, f))
            return err_set(e, ERR_DATA, "bad Radiance header: it has no end");
        line[strcspn(line, "\r\n")] = 0;
        double value;
        if (!*line)
            break;
        if (sscanf(line, "EXPOSURE=%lf", &value) == 1)
            exposure *= value;
        if (!strncmp(line, "FORMAT=", 7)) {
            is_xyz = !strcmp(line, "FORMAT=32-bit_rle_xyze");
            if (!is_xyz && strcmp(line, "FORMAT=32-bit_rle_rgbe"))
                return err_set(e, ERR_DATA, "unknown Radiance format '%.60s'", line + 7);
        }
    }
    if (!fgets(line, sizeof line, f))
        return err_set(e, ERR_DATA, "bad Radiance header: no size line");
    line[strcspn(line, "\r\n")] = 0;
    meta_set_text(m, "channels", is_xyz ? "X,Y,Z" : "R,G,B");
    if (exposure != 1)
        meta_set_num(m, "nacre.hdr_exposure", exposure);
    return parse_order(line, o, e);
}

// The new code: each of the four planes of a row by itself; count > 128 is a run of count - 128.
static bool read_planes(FILE *f, uint8_t (*row)[4], int n)
{
    for (int c = 0; c < 4; c++)
        for (int i = 0; i < n;) {
            const int count = getc(f);
            const bool run = count > 128;
            const int len = run ? count - 128 : count;
            if (count <= 0 || len > n - i)
                return false;
            int v = run ? getc(f) : 0;
            for (int k = 0; k < len; k++) {
                v = run ? v : getc(f);
                if (v == EOF)
                    return false;
                row[i++][c] = (uint8_t)v;
            }
        }
    return true;
}

// Flat pixels, or the old code: a pixel 1,1,1,n repeats the one before n << 8 (times so far) times.
static bool read_pixels(FILE *f, uint8_t (*row)[4], int n, const uint8_t first[4])
{
    int shift = 0;
    for (int i = 0; i < n;) {
        uint8_t px[4];
        if (i == 0 && shift == 0)
            memcpy(px, first, 4);
        else if (fread(px, 1, 4, f) != 4)
            return false;
        if (px[0] == 1 && px[1] == 1 && px[2] == 1) {
            const long count = (long)px[3] << shift;
            if (i == 0 || count > n - i)
                return false;
            for (long k = 0; k < count; k++, i++)
                memcpy(row[i], row[i - 1], 4);
            if ((shift += 8) > 16)
                return false;
        } else {
            memcpy(row[i++], px, 4);
            shift = 0;
        }
    }
    return true;
}

static bool read_row(FILE *f, uint8_t (*row)[4], int n)
{
    uint8_t head[4];
    if (fread(head, 1, 4, f) != 4)
        return false;
    const bool planes = n >= RLE_MIN && n <= RLE_MAX && head[0] == 2 && head[1] == 2 &&
                        head[2] < 128 && head[2] * 256 + head[3] == n;
    return planes ? read_planes(f, row, n) : read_pixels(f, row, n, head);
}

static bool read_file(struct infile *in, struct image *im, struct err *e)
{
    struct order o;
    struct meta m = {0};
    if (!parse_header(in->f, &o, &m, e)) {
        meta_finish(&m);
        return false;
    }
    const bool rows = o.slow == 'Y';
    const int w = rows ? o.n_fast : o.n_slow, h = rows ? o.n_slow : o.n_fast;
    const bool ok = infile_claim(in->size, 3.0 * w * h, e) && image_init(im, w, h, 3, e);
    meta_copy(&im->meta, &m);
    meta_finish(&m);
    if (!ok)
        return false;
    uint8_t(*row)[4] = xcalloc((size_t)o.n_fast, sizeof *row);
    int s = 0;
    for (; s < o.n_slow && read_row(in->f, row, o.n_fast); s++) {
        const int slow = o.slow_up ? s : o.n_slow - 1 - s;
        for (int k = 0; k < o.n_fast; k++) {
            const int fast = o.fast_up ? k : o.n_fast - 1 - k;
            const int i = rows ? fast : slow, j = rows ? slow : fast;
            float *px = im->px + ((size_t)j * (size_t)w + (size_t)i) * 3;
            for (int c = 0; c < 3; c++)
                px[c] = row[k][3] ? ldexpf(row[k][c], row[k][3] - 136) : 0;
        }
    }
    free(row);
    return s == o.n_slow ||
           err_set(e, ERR_DATA, "damaged or cut short: row %d of %d cannot be read", s, o.n_slow);
}

bool rgbe_read(struct image *im, const char *path, struct err *e)
{
    struct infile in = {0};
    const bool ok = infile_open(&in, path, e) && read_file(&in, im, e);
    infile_close(&in);
    return ok;
}

static void encode(const float v[3], uint8_t rgbe[4])
{
    const float top = fmaxf(v[0], fmaxf(v[1], v[2]));
    int exponent;
    frexpf(top, &exponent);
    if (lroundf(ldexpf(top, 8 - exponent)) == 256)
        exponent++;
    if (exponent + 128 < 1) {
        memset(rgbe, 0, 4);
        return;
    }
    for (int c = 0; c < 3; c++)
        rgbe[c] = (uint8_t)lroundf(ldexpf(v[c], 8 - exponent));
    rgbe[3] = (uint8_t)(exponent + 128);
}

// Runs of 4 and more as runs, all else as counted copies.
static void write_plane(FILE *f, const uint8_t (*row)[4], int n, int c)
{
    for (int i = 0; i < n;) {
        int run = 1, from = i; // the next run begins at `from`
        for (; from < n; from += run) {
            for (run = 1; run < 127 && from + run < n && row[from + run][c] == row[from][c];)
                run++;
            if (run >= 4)
                break;
        }
        while (i < from) {
            const int len = from - i < 128 ? from - i : 128;
            putc(len, f);
            for (int k = 0; k < len; k++)
                putc(row[i++][c], f);
        }
        if (from < n) {
            putc(128 + run, f);
            putc(row[from][c], f);
            i += run;
        }
    }
}

static bool storable(const struct image *im, struct err *e)
{
    if (im->nc != 3)
        return err_set(e, ERR_DATA, ".hdr holds 3 channels, not %d: write .exr", im->nc);
    const size_t row = (size_t)im->w * 3, n = row * (size_t)im->h;
    for (size_t k = 0; k < n; k++)
        if (!(im->px[k] >= 0 && im->px[k] < 0x1.fep126f))
            return err_set(e, ERR_DATA, "pixel (%d, %d) is %g, which .hdr cannot hold: write .exr",
                           (int)(k % row) / 3, (int)(k / row), (double)im->px[k]);
    return true;
}

bool rgbe_write(const struct image *im, const char *path, struct err *e)
{
    if (!storable(im, e))
        return false;
    FILE *f = fopen(path, "wbe");
    if (!f)
        return err_errno(e, "cannot write");
    const char *names = meta_text(&im->meta, "channels");
    fprintf(f, "#?RADIANCE\nFORMAT=32-bit_rle_%s\n\n-Y %d +X %d\n",
            names && !strcmp(names, "X,Y,Z") ? "xyze" : "rgbe", im->h, im->w);
    uint8_t(*row)[4] = xcalloc((size_t)im->w, sizeof *row);
    for (int j = 0; j < im->h; j++) {
        for (int i = 0; i < im->w; i++)
            encode(im->px + ((size_t)j * (size_t)im->w + (size_t)i) * 3, row[i]);
        if (im->w < RLE_MIN || im->w > RLE_MAX) {
            fwrite(row, sizeof *row, (size_t)im->w, f);
            continue;
        }
        const uint8_t head[4] = {2, 2, (uint8_t)(im->w >> 8), (uint8_t)im->w};
        fwrite(head, 1, 4, f);
        for (int c = 0; c < 4; c++)
            write_plane(f, (const uint8_t(*)[4])row, im->w, c);
    }
    free(row);
    const bool written = !ferror(f);
    return (!fclose(f) && written) || err_errno(e, "cannot write");
}

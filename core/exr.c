// exr.c - OpenEXR pictures through the OpenEXRCore C API.
//
// OpenEXR keeps channels in the order of their names; ours is kept in the attribute
// "nacre.channels". Metadata: the standard attributes with their own types, texts as string,
// numbers as double, lists of numbers as "doublevector" (float64, little-endian).
#define _GNU_SOURCE
#include "core/codec.h"
#include "core/infile.h"
#include "core/mem.h"
#include <endian.h>
#include <errno.h>
#include <fcntl.h>
#include <openexr.h>
#include <stdlib.h>
#include <string.h>

static const char CHANNELS[] = "nacre.channels", DOUBLES[] = "doublevector";

// What the library is told of a file, and tells of it.
struct talk {
    char reason[sizeof((struct err *)0)->msg]; // its first complaint
    FILE *out;
    uint64_t at, begun; // place of the next byte in `out`; on their way to the disk
};

static void note_error(exr_const_context_t ctxt, exr_result_t code, const char *msg)
{
    void *talk = NULL;
    (void)code;
    if (!exr_get_user_data(ctxt, &talk) && talk && !*((struct talk *)talk)->reason)
        snprintf(((struct talk *)talk)->reason, sizeof((struct talk *)0)->reason, "%.200s", msg);
}

enum { EARLY = 1 << 22 }; // bytes sent to the disk at a time

// The library writes row by row; stdio joins them.
static int64_t put(exr_const_context_t ctxt, void *user, const void *from, uint64_t n, uint64_t at,
                   exr_stream_error_func_ptr_t complain)
{
    struct talk *t = user;
    if ((at != t->at && fseeko(t->out, (off_t)at, SEEK_SET)) || fwrite(from, 1, n, t->out) != n) {
        complain(ctxt, EXR_ERR_WRITE_IO, "%s", strerror(errno));
        return -1;
    }
    t->at = at + n;
    if (t->at >= t->begun + EARLY) { // the disk takes rows while others are packed
        sync_file_range(fileno(t->out), (off_t)t->begun, EARLY, SYNC_FILE_RANGE_WRITE);
        t->begun += EARLY;
    }
    return (int64_t)n;
}

static exr_context_initializer_t settings(struct talk *talk)
{
    exr_context_initializer_t s = EXR_DEFAULT_CONTEXT_INITIALIZER;
    s.error_handler_fn = note_error;
    s.user_data = talk;
    s.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
    s.max_image_width = s.max_image_height = IMAGE_MAX_SIDE;
    s.max_tile_width = s.max_tile_height = IMAGE_MAX_SIDE;
    return s;
}

static bool is_structure(const char *name)
{
    static const char *const names[] = {
        "channels",           "compression",       "dataWindow", "displayWindow", "lineOrder",
        "pixelAspectRatio",   "screenWindowWidth", "tiles",      "type",          "name",
        "screenWindowCenter", "version",           "chunkCount", "preview",       CHANNELS};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        if (!strcmp(names[k], name))
            return true;
    return false;
}

static bool is_float(const char *name) // scalar attributes that OpenEXR defines as float
{
    return !strcmp(name, "expTime") || !strcmp(name, "isoSpeed") || !strcmp(name, "aperture") ||
           !strcmp(name, "whiteLuminance");
}

static void take_floats(struct meta *m, const char *key, const float *v, int n)
{
    double *d = xcalloc((size_t)n, sizeof *d);
    for (int k = 0; k < n; k++)
        d[k] = (double)v[k];
    meta_set_nums(m, key, d, n);
    free(d);
}

static void take_doubles(struct meta *m, const char *key, const void *bytes, int size)
{
    const int n = size / 8;
    uint64_t *bits = xcalloc((size_t)n, sizeof *bits);
    memcpy(bits, bytes, (size_t)n * 8);
    for (int k = 0; k < n; k++)
        bits[k] = le64toh(bits[k]);
    meta_set_nums(m, key, (double *)bits, n);
    free(bits);
}

static void take_attribute(struct meta *m, const exr_attribute_t *a)
{
    switch (a->type) {
    case EXR_ATTR_STRING:
        if (a->string->str)
            meta_set_text(m, a->name, a->string->str);
        break;
    case EXR_ATTR_INT: meta_set_num(m, a->name, a->i); break;
    case EXR_ATTR_FLOAT: meta_set_num(m, a->name, (double)a->f); break;
    case EXR_ATTR_DOUBLE: meta_set_num(m, a->name, a->d); break;
    case EXR_ATTR_FLOAT_VECTOR:
        take_floats(m, a->name, a->floatvector->arr, a->floatvector->length);
        break;
    case EXR_ATTR_CHROMATICITIES:
        take_floats(m, a->name, (const float *)(const void *)a->chromaticities, 8);
        break;
    case EXR_ATTR_OPAQUE:
        if (!strcmp(a->type_name, DOUBLES) && a->opaque->packed_data)
            take_doubles(m, a->name, a->opaque->packed_data, a->opaque->size);
        break;
    default: break; // of no use to us
    }
}

static void read_meta(exr_const_context_t f, struct meta *m)
{
    int32_t count = 0;
    exr_get_attribute_count(f, 0, &count);
    for (int32_t k = 0; k < count; k++) {
        const exr_attribute_t *a;
        if (!exr_get_attribute_by_index(f, 0, EXR_ATTR_LIST_FILE_ORDER, k, &a) &&
            !is_structure(a->name))
            take_attribute(m, a);
    }
}

static exr_result_t put_nums(exr_context_t f, const struct meta_item *it)
{
    if (!strcmp(it->key, "chromaticities") && it->n == 8) {
        float v[8];
        for (int k = 0; k < 8; k++)
            v[k] = (float)it->num[k];
        exr_attr_chromaticities_t c;
        memcpy(&c, v, sizeof c);
        return exr_attr_set_chromaticities(f, 0, it->key, &c);
    }
    if (it->n == 1)
        return is_float(it->key) ? exr_attr_set_float(f, 0, it->key, (float)it->num[0])
                                 : exr_attr_set_double(f, 0, it->key, it->num[0]);
    uint64_t *bits = xcalloc((size_t)it->n, sizeof *bits);
    memcpy(bits, it->num, (size_t)it->n * 8);
    for (int k = 0; k < it->n; k++)
        bits[k] = htole64(bits[k]);
    const exr_result_t r = exr_attr_set_user(f, 0, it->key, DOUBLES, it->n * 8, bits);
    free(bits);
    return r;
}

static exr_result_t write_meta(exr_context_t f, const struct meta *m)
{
    exr_result_t r = 0;
    for (int k = 0; k < m->n && !r; k++) {
        const struct meta_item *it = &m->item[k];
        if (!is_structure(it->key))
            r = it->text ? exr_attr_set_string(f, 0, it->key, it->text) : put_nums(f, it);
    }
    return r;
}

// Position of `name` in a list "a,b,c"; -1 when it is not there.
static int list_index(const char *list, const char *name)
{
    const size_t len = strlen(name);
    for (int k = 0;; k++) {
        const char *end = strchrnul(list, ',');
        if ((size_t)(end - list) == len && !strncmp(list, name, len))
            return k;
        if (!*end)
            return -1;
        list = end + 1;
    }
}

static int list_count(const char *list)
{
    int n = 1;
    for (; *list; list++)
        n += *list == ',';
    return n;
}

// The order of the picture's channels: our attribute where it fits, R, G, B first, else by name.
static char *channel_order(exr_const_context_t f, const exr_attr_chlist_t *ch)
{
    int32_t len;
    const char *ours = NULL;
    int found = 0;
    if (!exr_attr_get_string(f, 0, CHANNELS, &len, &ours) && ours)
        for (int c = 0; c < ch->num_channels; c++)
            found += list_index(ours, ch->entries[c].name.str) >= 0;
    if (found == ch->num_channels && list_count(ours) == found)
        return xstrdup(ours);
    char *list = xstrdup("");
    for (int pass = 0; pass < 4; pass++) // R, G, B, then the rest
        for (int c = 0; c < ch->num_channels; c++) {
            const char *name = ch->entries[c].name.str;
            const int place = !strcmp(name, "R")   ? 0
                              : !strcmp(name, "G") ? 1
                              : !strcmp(name, "B") ? 2
                                                   : 3;
            if (place != pass)
                continue;
            char *longer = xasprintf("%s%s%s", list, *list ? "," : "", name);
            free(list);
            list = longer;
        }
    return list;
}

struct reader {
    exr_const_context_t f;
    struct image *im;
    int *place;   // [nc] the picture's channel of each of the file's
    float *plane; // [nc][lines][width] of one chunk
    exr_decode_pipeline_t pipe;
    bool started, is_foreign; // is_foreign: the library has no code for this compression
};

// One chunk (rows, or a tile) as float32 into its place. It is unpacked channel by channel first:
// OpenEXR 3.1 puts half floats of four channels into the wrong ones when it interleaves.
static bool decode_chunk(struct reader *r, const exr_chunk_info_t *chunk, int left, int top)
{
    const struct image *im = r->im;
    exr_decode_pipeline_t *d = &r->pipe;
    if (chunk->width < 1 || chunk->height < 1 || chunk->width > im->w - left ||
        chunk->height > im->h - top)
        return false;
    if (r->started ? exr_decoding_update(r->f, 0, chunk, d)
                   : exr_decoding_initialize(r->f, 0, chunk, d))
        return false;
    const size_t w = (size_t)chunk->width, h = (size_t)chunk->height, nc = (size_t)im->nc;
    for (size_t c = 0; c < nc; c++) {
        exr_coding_channel_info_t *ch = &d->channels[c];
        ch->decode_to_ptr = (uint8_t *)(r->plane + c * w * h);
        ch->user_data_type = EXR_PIXEL_FLOAT;
        ch->user_bytes_per_element = 4;
        ch->user_pixel_stride = 4;
        ch->user_line_stride = chunk->width * 4;
    }
    if (!r->started && exr_decoding_choose_default_routines(r->f, 0, d))
        return false;
    r->started = true;
    const exr_result_t result = exr_decoding_run(r->f, 0, d);
    r->is_foreign = result == EXR_ERR_FEATURE_NOT_IMPLEMENTED;
    if (result)
        return false;
    for (size_t j = 0; j < h; j++) {
        float *row = im->px + (((size_t)top + j) * (size_t)im->w + (size_t)left) * nc;
        for (size_t c = 0; c < nc; c++)
            for (size_t i = 0; i < w; i++)
                row[i * nc + (size_t)r->place[c]] = r->plane[(c * h + j) * w + i];
    }
    return true;
}

static bool reader_init(struct reader *r, int w, int h, struct err *e)
{
    const size_t n = (size_t)w * (size_t)h * (size_t)r->im->nc;
    r->plane = sample_alloc(n, sizeof *r->plane, "OpenEXR chunk", e);
    return r->plane != NULL;
}

static bool read_rows(struct reader *r, int y0, struct err *e)
{
    const int w = r->im->w, h = r->im->h;
    int32_t lines = 1;
    if (exr_get_scanlines_per_chunk(r->f, 0, &lines) || lines < 1)
        return err_set(e, ERR_DATA, "bad OpenEXR header: rows of a chunk");
    if (!reader_init(r, w, lines < h ? lines : h, e))
        return false;
    int j = 0;
    for (; j < h; j += lines) {
        exr_chunk_info_t chunk;
        if (exr_read_scanline_chunk_info(r->f, 0, y0 + j, &chunk) || chunk.height > lines ||
            !decode_chunk(r, &chunk, 0, j))
            break;
    }
    return j >= h ||
           err_set(e, ERR_DATA, "damaged or cut short: row %d of %d cannot be read", j, h);
}

static bool read_tiles(struct reader *r, struct err *e)
{
    const int w = r->im->w, h = r->im->h;
    int32_t tw = 0, th = 0;
    if (exr_get_tile_sizes(r->f, 0, 0, 0, &tw, &th) || tw < 1 || th < 1)
        return err_set(e, ERR_DATA, "bad OpenEXR header: tile size");
    if (!reader_init(r, tw < w ? tw : w, th < h ? th : h, e))
        return false;
    for (int j = 0; j < h; j += th)
        for (int i = 0; i < w; i += tw) {
            exr_chunk_info_t chunk;
            if (exr_read_tile_chunk_info(r->f, 0, i / tw, j / th, 0, 0, &chunk) ||
                chunk.width > tw || chunk.height > th || !decode_chunk(r, &chunk, i, j))
                return err_set(e, ERR_DATA,
                               "damaged or cut short: the tile at (%d, %d) cannot be read", i, j);
        }
    return true;
}

static bool check_channels(const exr_attr_chlist_t *ch, struct err *e)
{
    if (ch->num_channels < 1 || ch->num_channels > IMAGE_MAX_CHANNELS)
        return err_set(e, ERR_DATA, "%d channels: must be 1 to %d", ch->num_channels,
                       IMAGE_MAX_CHANNELS);
    for (int c = 0; c < ch->num_channels; c++) {
        const exr_attr_chlist_entry_t *one = &ch->entries[c];
        if (one->x_sampling != 1 || one->y_sampling != 1)
            return err_set(e, ERR_DATA, "channel %s is subsampled, which is not supported",
                           one->name.str);
        if (strchr(one->name.str, ','))
            return err_set(e, ERR_DATA, "channel name '%s' holds a comma", one->name.str);
    }
    return true;
}

static bool read_part(exr_const_context_t f, struct image *im, int64_t size, struct err *e)
{
    exr_storage_t storage;
    exr_attr_box2i_t win;
    const exr_attr_chlist_t *ch;
    if (exr_get_storage(f, 0, &storage) || exr_get_data_window(f, 0, &win) ||
        exr_get_channels(f, 0, &ch))
        return err_set(e, ERR_DATA, "bad OpenEXR header: no data window or no channels");
    if (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED)
        return err_set(e, ERR_DATA, "a deep OpenEXR picture: must be flat");
    const int64_t w = (int64_t)win.max.x - win.min.x + 1, h = (int64_t)win.max.y - win.min.y + 1;
    if (!check_channels(ch, e))
        return false;
    if (w < 1 || h < 1 || w > IMAGE_MAX_SIDE || h > IMAGE_MAX_SIDE)
        return err_set(e, ERR_DATA, "bad size %lld x %lld: each side must be 1 to %d pixels",
                       (long long)w, (long long)h, IMAGE_MAX_SIDE);
    if (!infile_claim(size, (double)w * (double)h * ch->num_channels, e) ||
        !image_init(im, (int)w, (int)h, ch->num_channels, e))
        return false;
    char *names = channel_order(f, ch);
    read_meta(f, &im->meta);
    meta_set_text(&im->meta, "channels", names);
    struct reader r = {.f = f, .im = im};
    r.place = xcalloc((size_t)im->nc, sizeof *r.place);
    for (int c = 0; c < im->nc; c++)
        r.place[c] = list_index(names, ch->entries[c].name.str);
    const bool ok = storage == EXR_STORAGE_TILED ? read_tiles(&r, e) : read_rows(&r, win.min.y, e);
    if (r.is_foreign) // DWAA and DWAB with OpenEXR 3.1
        err_set(e, ERR_DATA, "the installed OpenEXR cannot decode its compression: use ZIP or PIZ");
    exr_decoding_destroy(f, &r.pipe);
    free(r.place);
    free(r.plane);
    free(names);
    return ok;
}

bool exr_read(struct image *im, const char *path, struct err *e)
{
    struct infile in = {0};
    unsigned char magic[4] = {0};
    if (!infile_open(&in, path, e))
        return false;
    const bool is_exr = fread(magic, 1, 4, in.f) == 4 && !memcmp(magic, "\x76\x2f\x31\x01", 4);
    const int64_t size = in.size;
    infile_close(&in);
    if (!is_exr)
        return err_set(e, ERR_DATA, "not an OpenEXR file");
    struct talk talk = {0};
    const exr_context_initializer_t set = settings(&talk);
    exr_context_t f = NULL;
    if (exr_start_read(&f, path, &set)) {
        exr_finish(&f);
        return err_set(e, ERR_DATA, "bad OpenEXR header: %s",
                       *talk.reason ? talk.reason : "damaged");
    }
    const bool ok = read_part(f, im, size, e);
    exr_finish(&f);
    return ok;
}

static const char *default_names(int nc)
{
    return nc == 1 ? "Y" : nc == 2 ? "Y,A" : nc == 3 ? "R,G,B" : nc == 4 ? "R,G,B,A" : NULL;
}

static exr_result_t add_channels(exr_context_t f, const char *names)
{
    exr_result_t r = 0;
    char *copy = xstrdup(names), *rest = copy;
    for (char *name; !r && (name = strsep(&rest, ","));)
        r = exr_add_channel(f, 0, name, EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    free(copy);
    return r ? r : exr_attr_set_string(f, 0, CHANNELS, names);
}

static exr_result_t write_rows(exr_context_t f, const struct image *im, const char *names)
{
    int32_t lines = 1;
    exr_result_t r = exr_get_scanlines_per_chunk(f, 0, &lines);
    exr_encode_pipeline_t p = EXR_ENCODE_PIPELINE_INITIALIZER;
    for (int j = 0; j < im->h && !r; j += lines) {
        exr_chunk_info_t chunk;
        if ((r = exr_write_scanline_chunk_info(f, 0, j, &chunk)) ||
            (r = j ? exr_encoding_update(f, 0, &chunk, &p)
                   : exr_encoding_initialize(f, 0, &chunk, &p)))
            break;
        for (int c = 0; c < p.channel_count; c++) {
            exr_coding_channel_info_t *ch = &p.channels[c];
            const size_t row = (size_t)im->w * (size_t)im->nc;
            const int place = list_index(names, ch->channel_name);
            ch->encode_from_ptr = (const uint8_t *)(im->px + (size_t)j * row + place);
            ch->user_data_type = EXR_PIXEL_FLOAT;
            ch->user_bytes_per_element = 4;
            ch->user_pixel_stride = im->nc * 4;
            ch->user_line_stride = im->w * im->nc * 4;
        }
        if (j == 0)
            r = exr_encoding_choose_default_routines(f, 0, &p);
        if (!r)
            r = exr_encoding_run(f, 0, &p);
    }
    exr_encoding_destroy(f, &p);
    return r;
}

static bool names_fit(const char *names, int nc, struct err *e)
{
    if (!names)
        return err_set(e, ERR_DATA, "%d channels without names (meta \"channels\")", nc);
    if (list_count(names) != nc)
        return err_set(e, ERR_DATA, "%d channels, but the names %.80s", nc, names);
    char *copy = xstrdup(names), *rest = copy;
    bool ok = true;
    int c = 0;
    for (char *name; ok && (name = strsep(&rest, ",")); c++)
        if (!*name || list_index(names, name) != c)
            ok = err_set(e, ERR_DATA, "channel name '%s' is empty or stands twice in %.80s", name,
                         names);
    free(copy);
    return ok;
}

bool exr_write(const struct image *im, const char *path, struct err *e)
{
    const char *names = meta_text(&im->meta, "channels");
    names = names ? names : default_names(im->nc);
    if (!names_fit(names, im->nc, e))
        return false;
    struct talk talk = {.out = fopen(path, "wbe")};
    if (!talk.out)
        return err_errno(e, "cannot write");
    setvbuf(talk.out, NULL, _IOFBF, 1 << 20);
    exr_context_initializer_t set = settings(&talk);
    set.write_fn = put;
    exr_context_t f = NULL;
    exr_result_t r = exr_start_write(&f, path, EXR_WRITE_FILE_DIRECTLY, &set);
    const char *wanted = meta_text(&im->meta, "compression");
    const exr_compression_t compression =
        wanted && !strcmp(wanted, "none") ? EXR_COMPRESSION_NONE : EXR_COMPRESSION_ZIP;
    int part;
    if (!r && !(r = exr_set_longname_support(f, 1)) &&
        !(r = exr_add_part(f, NULL, EXR_STORAGE_SCANLINE, &part)) &&
        !(r = exr_initialize_required_attr_simple(f, 0, im->w, im->h, compression)) &&
        !(r = add_channels(f, names)) && !(r = write_meta(f, &im->meta)) &&
        !(r = exr_write_header(f)))
        r = write_rows(f, im, names);
    const exr_result_t closed = exr_finish(&f);
    const bool kept = fclose(talk.out) == 0 || err_errno(e, "cannot write");
    if (r || closed)
        return err_set(e, ERR_FILE, "cannot write: %s",
                       *talk.reason ? talk.reason : exr_get_default_error_message(r ? r : closed));
    return kept;
}

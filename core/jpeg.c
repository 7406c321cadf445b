// jpeg.c - JPEG by libjpeg.
#include "core/mem.h"
#include "core/raster.h"
#include <jerror.h>
#include <jpeglib.h>
#include <setjmp.h>
#include <stdlib.h>

struct verdict {
    struct jpeg_error_mgr base;
    jmp_buf out;
    bool is_damaged;
};

static _Noreturn void give_up(j_common_ptr j)
{
    longjmp(((struct verdict *)j->err)->out, 1);
}

// libjpeg makes up what it cannot read and only warns. Bytes too many between segments, as some
// cameras write, lose nothing.
static void note(j_common_ptr j, int level)
{
    struct verdict *v = (struct verdict *)j->err;
    v->is_damaged |= level < 0 && v->base.msg_code != JWRN_EXTRANEOUS_DATA;
}

static struct jpeg_error_mgr *judged_by(struct verdict *v)
{
    jpeg_std_error(&v->base);
    v->base.error_exit = give_up;
    v->base.emit_message = note;
    return &v->base;
}

static bool read_rows(struct jpeg_decompress_struct *j, struct image *im, uint8_t **row,
                      struct err *e)
{
    jpeg_read_header(j, TRUE);
    if (j->num_components != 1 && j->num_components != 3)
        return err_set(e, ERR_DATA, "a JPEG of %d channels: must be grey or RGB",
                       j->num_components);
    j->out_color_space = j->num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_start_decompress(j);
    const size_t n = (size_t)j->output_width * (size_t)j->output_components;
    if (!image_init(im, (int)j->output_width, (int)j->output_height, j->output_components, e) ||
        !(*row = sample_alloc(n, 1, "a JPEG", e)))
        return false;
    while (j->output_scanline < j->output_height) {
        float *to = im->px + j->output_scanline * n;
        jpeg_read_scanlines(j, row, 1);
        raster_row(to, *row, n, 1);
    }
    jpeg_finish_decompress(j);
    meta_set_num(&im->meta, "nacre.encoded", 1);
    return true;
}

bool jpeg_decode(struct image *im, const uint8_t *data, size_t n, struct err *e)
{
    struct jpeg_decompress_struct j;
    struct verdict v = {.is_damaged = false};
    uint8_t *row[1] = {NULL};
    volatile bool ok = false;
    j.err = judged_by(&v);
    jpeg_create_decompress(&j);
    if (setjmp(v.out))
        ok = raster_damaged(e);
    else {
        jpeg_mem_src(&j, data, n);
        ok = read_rows(&j, im, row, e) && (!v.is_damaged || raster_damaged(e));
    }
    free(*row);
    jpeg_destroy_decompress(&j);
    return ok;
}

bool jpeg_encode(const struct raster *r, FILE *f)
{
    struct jpeg_compress_struct j;
    struct verdict v = {.is_damaged = false};
    volatile bool ok = false;
    j.err = judged_by(&v);
    jpeg_create_compress(&j);
    if (!setjmp(v.out)) {
        jpeg_stdio_dest(&j, f);
        j.image_width = (JDIMENSION)r->w;
        j.image_height = (JDIMENSION)r->h;
        j.input_components = r->nc;
        j.in_color_space = r->nc == 1 ? JCS_GRAYSCALE : JCS_RGB;
        jpeg_set_defaults(&j);
        jpeg_set_quality(&j, 95, TRUE);
        jpeg_start_compress(&j, TRUE);
        while (j.next_scanline < j.image_height) {
            JSAMPROW row = (uint8_t *)r->px + (size_t)j.next_scanline * (size_t)(r->w * r->nc);
            jpeg_write_scanlines(&j, &row, 1);
        }
        jpeg_finish_compress(&j);
        ok = true;
    }
    jpeg_destroy_compress(&j);
    return ok;
}

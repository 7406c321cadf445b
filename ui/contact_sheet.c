// contact_sheet.c - thumbnails of a session's frames.
#define _GNU_SOURCE
#include "ui/contact_sheet.h"
#include "core/session.h"
#include <stdlib.h>

enum { GAP = 4 };

static int by_exposure(const void *a, const void *b)
{
    const double x = session_exposure_s(a), y = session_exposure_s(b);
    return (x > y) - (x < y);
}

// Means over blocks; a block with a saturated sample is red.
static void shrink(const struct dng *d, struct image *sheet, int left, int top, int w, int h)
{
    for (int j = 0; j < h; j++)
        for (int i = 0; i < w; i++) {
            const int i0 = i * d->w / w, i1 = (i + 1) * d->w / w, j0 = j * d->h / h,
                      j1 = (j + 1) * d->h / h;
            double sum = 0;
            bool white = false;
            for (int q = j0; q < j1; q++)
                for (int p = i0; p < i1; p++) {
                    const uint16_t v = d->raw[(size_t)q * (size_t)d->w + (size_t)p];
                    sum += v;
                    white |= v >= d->white;
                }
            const double y = (sum / ((i1 - i0) * (j1 - j0)) - d->black) / (d->white - d->black);
            float *px = sheet->px + ((size_t)(top + j) * (size_t)sheet->w + (size_t)(left + i)) * 3;
            px[0] = white ? 0.85f : (float)y;
            px[1] = px[2] = white ? 0.05f : (float)y;
        }
}

static bool draw(struct session *s, const struct session_frame *frame, int n, int thumb_w,
                 int columns, struct image *out, struct err *e)
{
    const int rows = (n + columns - 1) / columns;
    const int thumb_h = (int)((double)thumb_w * frame[0].h / frame[0].w);
    struct image sheet;
    if (!image_init(&sheet, columns * (thumb_w + GAP) - GAP, rows * (thumb_h + GAP) - GAP, 3, e))
        return false;
    const size_t samples = (size_t)sheet.w * (size_t)sheet.h * 3;
    for (size_t k = 0; k < samples; k++)
        sheet.px[k] = 0.25f; // the gaps
    bool ok = true;
    for (int k = 0; ok && k < n; k++) {
        struct dng d = {0};
        char *path = session_path(s, frame[k].path);
        ok = dng_read(&d, path, e);
        if (ok)
            shrink(&d, &sheet, k % columns * (thumb_w + GAP), k / columns * (thumb_h + GAP),
                   thumb_w, thumb_h);
        dng_finish(&d);
        free(path);
    }
    if (ok)
        *out = sheet;
    else
        image_finish(&sheet);
    return ok;
}

bool contact_sheet(const char *folder, int thumb_w, int columns, struct image *out, struct err *e)
{
    struct session *s = NULL;
    struct session_frame *frame = NULL;
    int n = 0, kept = 0;
    bool ok = session_open(&s, folder, SESSION_READ, e) && session_frames(s, true, &frame, &n, e);
    for (int k = 0; ok && k < n; k++)
        if (frame[k].step.kind == SESSION_LIGHT &&
            (!kept || frame[k].step.group == frame[0].step.group))
            frame[kept++] = frame[k];
    if (ok && !kept)
        ok = err_set(e, ERR_DATA, "%s: no good frame with the light on", folder);
    if (ok) {
        qsort(frame, (size_t)kept, sizeof *frame, by_exposure);
        ok = draw(s, frame, kept, thumb_w, columns, out, e);
    }
    free(frame);
    session_close(s);
    return ok;
}

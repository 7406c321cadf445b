// bracket.c - which pixels of a bracket tell most about the camera's response.
#include "calib/bracket.h"
#include "core/mem.h"
#include <stdlib.h>

enum { PICK_MAX = 12000, PICK_MIN = 100, TRIES = 6 }; // TRIES x TRIES candidates a tile

static int range3x3(const uint8_t *code, int w, int nc, int i, int j, int c)
{
    int lo = 255, hi = 0;
    for (int y = j - 1; y <= j + 1; y++)
        for (int x = i - 1; x <= i + 1; x++) {
            const int z = code[((size_t)y * (size_t)w + (size_t)x) * (size_t)nc + (size_t)c];
            lo = z < lo ? z : lo;
            hi = z > hi ? z : hi;
        }
    return hi - lo;
}

// Unevenness of a pixel's neighbourhood over the frames, or -1 when fewer than two frames show it.
static int unevenness(const struct bracket *b, const struct response *r, int i, int j)
{
    int sum = 0, usable = 0;
    const size_t at = ((size_t)j * (size_t)b->w + (size_t)i) * (size_t)b->nc;
    for (int k = 0; k < b->n; k++)
        for (int c = 0; c < b->nc; c++)
            if (response_code_ok(r, b->code[k][at + (size_t)c])) {
                sum += range3x3(b->code[k], b->w, b->nc, i, j, c);
                usable++;
            }
    return usable >= 2 * b->nc ? 100 * sum / usable : -1;
}

bool bracket_pick(struct bracket_pixels *px, const struct bracket *b, const struct response *r,
                  struct err *e)
{
    if (b->n < 2 || b->n > BRACKET_MAX)
        return err_set(e, ERR_DATA, "a bracket needs 2 to %d frames, not %d", BRACKET_MAX, b->n);
    if (b->w < 3 || b->h < 3 || b->nc > RESPONSE_CHANNELS)
        return err_set(e, ERR_DATA, "a response needs frames of 3 x 3 pixels or more");
    int tile = 2;
    while ((long)((b->w - 2) / tile) * ((b->h - 2) / tile) > PICK_MAX)
        tile++;
    const int tries = tile < TRIES ? tile : TRIES;
    const int across = (b->w - 2) / tile, down = (b->h - 2) / tile;
    const size_t per_pixel = (size_t)b->nc * (size_t)b->n;
    *px = (struct bracket_pixels){.n = b->n, .nc = b->nc};
    px->code = xcalloc((size_t)across * (size_t)down * per_pixel, 1);
    for (int t = 0; t < across * down; t++) {
        int best = -1, best_i = 0, best_j = 0;
        for (int k = 0; k < tries * tries; k++) {
            const int i = 1 + t % across * tile + k % tries * tile / tries;
            const int j = 1 + t / across * tile + k / tries * tile / tries;
            const int u = unevenness(b, r, i, j);
            if (u >= 0 && (best < 0 || u < best)) {
                best = u;
                best_i = i;
                best_j = j;
            }
        }
        if (best < 0)
            continue;
        const size_t at = ((size_t)best_j * (size_t)b->w + (size_t)best_i) * (size_t)b->nc;
        uint8_t *to = px->code + (size_t)px->count++ * per_pixel;
        for (int c = 0; c < b->nc; c++)
            for (int k = 0; k < b->n; k++)
                to[c * b->n + k] = b->code[k][at + (size_t)c];
    }
    if (px->count >= PICK_MIN || (px->count > 0 && px->count * 2 >= across * down))
        return true;
    const int count = px->count;
    bracket_pixels_finish(px);
    return err_set(e, ERR_DATA,
                   "no response can be recovered: only %d pixels are neither black nor saturated "
                   "in two frames",
                   count);
}

void bracket_pixels_finish(struct bracket_pixels *px)
{
    free(px->code);
    *px = (struct bracket_pixels){0};
}

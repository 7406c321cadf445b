// linear.c - the sRGB curve off 8-bit pictures.
#include "ui/linear.h"
#include "core/log.h"
#include "core/spectrum.h"
#include <stddef.h>

void make_linear(struct image *im, const char *path)
{
    double encoded = 0;
    if (!meta_num(&im->meta, "nacre.encoded", &encoded) || !(encoded > 0))
        return;
    const size_t n = (size_t)im->w * (size_t)im->h * (size_t)im->nc;
    for (size_t k = 0; k < n; k++)
        if (im->nc != 4 || k % 4 != 3)
            im->px[k] = (float)srgb_decode((double)im->px[k]);
    meta_set_num(&im->meta, "nacre.encoded", 0);
    if (path)
        log_note("%s: 8-bit samples taken as sRGB and made linear", path);
}

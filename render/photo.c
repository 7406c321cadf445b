// photo.c - patterns read, tables summed from them.
#include "render/photo.h"
#include "core/imgfile.h"
#include <math.h>

bool photo_read(struct photo *p, const char *path, const char *channel, double scale,
                const double center_px[2], struct err *e)
{
    struct image im = {0};
    if (!image_read(&im, path, e))
        return false;
    const int c = im.nc == 1 && !channel ? 0 : image_channel_index(&im, channel ? channel : "g");
    bool ok = c >= 0 || err_set(e, ERR_DATA, "has no channel '%s'", channel ? channel : "g");
    ok = ok && lut_pattern_init(&p->pattern, &im, c, scale, e);
    if (ok && isnan(center_px[0]))
        ok = lut_pattern_center(&p->pattern, e);
    else if (ok) {
        p->pattern.cx = center_px[0];
        p->pattern.cy = center_px[1];
    }
    image_finish(&im);
    return ok || err_in(e, "%s", path);
}

void photo_finish(struct photo *p)
{
    if (p)
        lut_pattern_finish(&p->pattern);
}

struct lut_preview photo_preview(const struct photo *p, const struct spectrum *light)
{
    struct lut_preview preview = {.request = p->request};
    preview.request.light = light;
    lut_preview_frame(&preview, &p->pattern);
    return preview;
}

bool photo_table(const struct photo *p, const struct spectrum *light, struct table *t,
                 struct err *e)
{
    struct lut_request r = p->request;
    struct lut_report report;
    r.pattern = &p->pattern;
    r.light = light;
    return lut_build(&r, t, &report, e);
}

// bokeh_heights.c - a height field straight from a bokeh photograph or a session of them.
#define _GNU_SOURCE
#include "ui/bokeh_heights.h"
#include "core/imgfile.h"
#include "core/mem.h"
#include "process/bokeh.h"
#include "ui/child.h"
#include "ui/linear.h"
#include "ui/words.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static bool is_folder(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && S_ISDIR(st.st_mode);
}

static bool merge(struct image *im, const char *session, const char *scratch, struct err *e)
{
    char *merged = xasprintf("%s.bokeh.exr", scratch);
    char *words = words_expand("hdr @ -o %", session, merged);
    struct child c = {0};
    bool ok = child_run(words, &c, e);
    if (ok && c.status)
        ok = err_set(e, (enum err_code)c.status,
                     "%s: not one bracket: merge it with nacre hdr and give the picture", session);
    ok = ok && image_read(im, merged, e);
    unlink(merged);
    child_finish(&c);
    free(words);
    free(merged);
    return ok;
}

bool bokeh_heights(struct hfield *hf, const char *source, const char *record, const char *scratch,
                   struct err *e)
{
    struct bokeh_record rec;
    struct image im = {0};
    struct bokeh_result result;
    const struct bokeh_options opt = {
        .level = true, .lines = BOKEH_1D_IF_LINES, .lattice = true, .f_number = NAN};
    bool ok =
        bokeh_record_read(&rec, record, e) &&
        (is_folder(source) ? merge(&im, source, scratch, e)
                           : image_read(&im, source, e) && image_check_finite(&im, source, e)) &&
        bokeh_record_fits(&rec, record, &im, e);
    if (ok)
        make_linear(&im, source);
    if (ok && !bokeh_height(&im, &rec, &opt, hf, &result, e))
        ok = err_in(e, "%s", source);
    image_finish(&im);
    return ok;
}

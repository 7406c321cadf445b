// view_shots.c - pictures of the window, of what it shows, and of a whole turn.
#define _GNU_SOURCE
#include "core/imgfile.h"
#include "core/spectrum.h"
#include "render/display.h"
#include "ui/view.h"
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

void view_name_shot(char *path, size_t size, const char *ext)
{
    int k = 1;
    do
        snprintf(path, size, "nacre-view-%03d.%s", k++, ext);
    while (!access(path, F_OK) && k < 1000);
}

bool view_screenshot(struct view *v, const char *path, struct err *e)
{
    int w, h;
    struct image im;
    view_draw(v); // the back buffer is undefined after it was shown
    window_size(v->window, &w, &h);
    if (!image_init(&im, w, h, 3, e))
        return false;
    unsigned char *row = malloc((size_t)w * 3);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    for (int j = 0; j < h && row; j++) {
        glReadPixels(0, h - 1 - j, w, 1, GL_RGB, GL_UNSIGNED_BYTE, row);
        for (int k = 0; k < 3 * w; k++)
            im.px[(size_t)j * (size_t)w * 3 + (size_t)k] = (float)srgb_decode(row[k] / 255.0);
    }
    free(row);
    window_show(v->window);
    const bool ok = image_write(&im, path, e);
    image_finish(&im);
    return ok;
}

// The material as radiance, else the picture as it is; display values for .png and .jpg.
bool view_save(struct view *v, const char *path, struct err *e)
{
    const char *ext = path_ext(path);
    struct image im;
    if (!v->has_stage)
        return v->picture.px ? image_write(&v->picture, path, e)
                             : err_set(e, ERR_DATA, "there is no picture to save");
    if (!stage_read(&v->stage, &im, e))
        return false;
    if (!strcmp(ext, ".png") || !strcmp(ext, ".jpg")) {
        display_map(&im, v->params->v[PARAM_EXPOSURE]);
        display_dither(&im);
    }
    meta_set_text(&im.meta, "nacre.version", NACRE_VERSION);
    meta_set_text(&im.meta, "nacre.command", "nacre-view");
    meta_set_num(&im.meta, "nacre.exposure_ev", v->params->v[PARAM_EXPOSURE]);
    const bool ok = image_write(&im, path, e);
    image_finish(&im);
    return ok;
}

void view_turntable(struct view *v, int count, const char *folder)
{
    if (!v->has_stage || count < 2)
        return;
    if (mkdir(folder, 0777) && errno != EEXIST) {
        view_say(v, "%s: %s", folder, strerror(errno));
        return;
    }
    snprintf(v->turn_folder, sizeof v->turn_folder, "%s", folder);
    v->turn_left = v->turn_count = count;
    v->stale = true;
}

void view_turn_next(struct view *v)
{
    char path[400];
    struct err e;
    const int k = v->turn_count - v->turn_left;
    snprintf(path, sizeof path, "%s/%04d.png", v->turn_folder, k);
    if (!view_save(v, path, &e)) {
        view_say(v, "%s", e.msg);
        v->turn_left = 0;
        return;
    }
    param_set(v->params, PARAM_YAW, v->params->v[PARAM_YAW] + 2 * M_PI / v->turn_count);
    v->turn_left--;
    if (v->turn_left)
        view_say(v, "%s: frame %d of %d, Esc stops", v->turn_folder, k + 1, v->turn_count);
    else
        view_say(v, "%d frames: ffmpeg -i %s/%%04d.png turn.mp4", v->turn_count, v->turn_folder);
}

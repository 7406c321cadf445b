// view_item.c - telling files apart, and reading them.
#define _GNU_SOURCE
#include "ui/view_item.h"
#include "core/datapath.h"
#include "core/hfield_file.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "core/mem.h"
#include "ui/session_frames.h"
#include <dirent.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

const char *const item_kind_name[] = {"scene", "table", "picture", "session", "camera"};

static const char *last_part(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash && slash[1] ? slash + 1 : path;
}

static void add(struct items *l, enum item_kind kind, const char *path, const char *name)
{
    struct item *it = xcalloc(1, sizeof *it);
    *it = (struct item){
        .kind = kind, .path = xstrdup(path), .name = xstrdup(name), .params = params_start()};
    undo_start(&it->undo, &it->params);
    l->item = xrealloc(l->item, (size_t)l->n + 1, sizeof(struct item *));
    l->item[l->n++] = it;
}

void items_add_live(struct items *l)
{
    add(l, ITEM_LIVE, "", "camera of nacred");
}

static bool is_picture(const char *ext)
{
    static const char known[] = ".exr .pfm .hdr .png .jpg .jpeg .tif .tiff .dng .cr2 .nef .arw ";
    char word[20];
    snprintf(word, sizeof word, "%s ", ext);
    return *ext && strlen(ext) < 8 && strstr(known, word);
}

// A table says so itself.
static enum item_kind kind_of_picture(const char *path)
{
    struct table t;
    struct err ignored;
    if (strcmp(path_ext(path), ".exr") || !table_read(&t, path, NULL, &ignored))
        return ITEM_PICTURE;
    table_finish(&t);
    return ITEM_TABLE;
}

static bool add_file(struct items *l, const char *path)
{
    const char *ext = path_ext(path);
    if (!strcmp(ext, ".yaml") || !strcmp(ext, ".yml")) {
        char *name = xstrdup(last_part(path));
        *strrchr(name, '.') = 0;
        add(l, ITEM_SCENE, path, name);
        free(name);
    } else if (is_picture(ext) || path_is_height(path))
        add(l, kind_of_picture(path), path, last_part(path));
    else
        return false;
    return true;
}

static int visible(const struct dirent *d)
{
    return d->d_name[0] != '.';
}

static bool add_folder(struct items *l, const char *path)
{
    struct dirent **entry;
    const int n = scandir(path, &entry, visible, alphasort), before = l->n;
    for (int k = 0; k < n; k++) {
        char *inside = xasprintf("%s/%s", path, entry[k]->d_name);
        if (is_session(inside))
            add(l, ITEM_SESSION, inside, entry[k]->d_name);
        else
            add_file(l, inside);
        free(inside);
        free(entry[k]);
    }
    if (n >= 0)
        free(entry);
    return l->n > before;
}

bool items_add(struct items *l, const char *path, struct err *e)
{
    struct stat st;
    if (stat(path, &st))
        return err_errno(e, "%s", path);
    if (is_session(path))
        add(l, ITEM_SESSION, path, last_part(path));
    else if (S_ISDIR(st.st_mode) ? !add_folder(l, path) : !add_file(l, path))
        return err_set(e, ERR_DATA,
                       "%s: is no scene (.yaml), table, picture, height field, session, nor a "
                       "folder of them",
                       path);
    return true;
}

void items_finish(struct items *l)
{
    for (int k = 0; k < l->n; k++) {
        free(l->item[k]->path);
        free(l->item[k]->name);
        free(l->item[k]);
    }
    free(l->item);
    *l = (struct items){0};
}

struct load *load_new(const struct item *it, const struct scene_options *o, struct err *e)
{
    char *stand = data_path("rigs/scenes/plane.yaml", e);
    if (!stand)
        return NULL;
    struct load *l = xcalloc(1, sizeof *l);
    *l = (struct load){.kind = it->kind, .path = xstrdup(it->path), .options = *o, .stand = stand};
    return l;
}

// Heights as a picture, in nanometres above the lowest.
static bool read_heights(struct image *im, const char *path, struct err *e)
{
    struct hfield h;
    if (!hfield_read(&h, path, NULL, e))
        return false;
    double low = INFINITY;
    const bool ok = image_init(im, h.nx, h.ny, 1, e);
    const size_t n = (size_t)h.nx * (size_t)h.ny;
    for (size_t k = 0; k < n; k++)
        low = fmin(low, (double)h.z[k]);
    for (size_t k = 0; k < n && ok; k++) {
        const size_t i = k % (size_t)h.nx, j = (size_t)h.ny - 1 - k / (size_t)h.nx;
        im->px[k] = (float)(1e9 * ((double)h.z[j * (size_t)h.nx + i] - low));
    }
    hfield_finish(&h);
    return ok;
}

static bool read(struct load *l, struct err *e)
{
    struct scene_options o = l->options;
    switch (l->kind) {
    case ITEM_SCENE: return scene_read(&l->scene, l->path, &o, e);
    case ITEM_TABLE: o.table = l->path; return scene_read(&l->scene, l->stand, &o, e);
    case ITEM_PICTURE:
        return path_is_height(l->path) ? read_heights(&l->picture, l->path, e)
                                       : image_read(&l->picture, l->path, e);
    case ITEM_SESSION:
    case ITEM_LIVE: return scene_read(&l->scene, l->stand, &o, e);
    }
    return false;
}

void load_run(void *job)
{
    struct load *l = job;
    const double start_s = now_s();
    l->ok = read(l, &l->e);
    l->seconds = now_s() - start_s;
}

void load_free(struct load *l)
{
    if (!l)
        return;
    scene_finish(&l->scene);
    image_finish(&l->picture);
    free(l->path);
    free(l->stand);
    free(l);
}

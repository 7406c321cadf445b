// rig.c - reads a rig file; what its lights, filters and camera let through together.
#define _GNU_SOURCE
#include "core/rig.h"
#include "core/mem.h"
#include "core/outfile.h"
#include "core/yaml.h"
#include <errno.h>
#include <libgen.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { MAX_LIGHTS = 32, MAX_FILTERS = 64, GRID_FIRST_NM = 300, GRID_LAST_NM = 1100 };
static const double DARK = 1e-9; // less of a band's peak than this is no light

static bool get_text(struct ynode *map, const char *key, enum yneed need, char **out, struct err *e)
{
    const char *text = NULL;
    if (!ymap_text(map, key, need, &text, e))
        return false;
    *out = text ? xstrdup(text) : NULL;
    return true;
}

// Names end up in ledgers, file names and command lines.
static bool get_name(struct ynode *map, char **out, struct err *e)
{
    enum { LONGEST = 40 };
    if (!get_text(map, "name", Y_NEEDED, out, e))
        return false;
    const size_t n = strlen(*out);
    return (n >= 1 && n <= LONGEST &&
            strspn(*out, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRST"
                         "UVWXYZ0123456789._+-") == n) ||
           yaml_bad(ymap_find(map, "name"), e, "must be 1 to %d letters, digits and . _ + -",
                    LONGEST);
}

static bool get_band(struct ynode *map, struct rig_band *b, struct err *e)
{
    struct ynode *csv = ymap_find(map, "csv"), *centre = ymap_find(map, "centre");
    b->line = ynode_line(csv ? csv : centre ? centre : map);
    if (!get_text(map, "csv", Y_OPTIONAL, &b->csv, e) ||
        !ymap_num(map, "centre", Y_OPTIONAL, UNIT_M, 100e-9, 3e-6, &b->centre_m, e) ||
        !ymap_num(map, "width", centre ? Y_NEEDED : Y_OPTIONAL, UNIT_M, 0.1e-9, 1e-6, &b->fwhm_m,
                  e))
        return false;
    if (csv && centre)
        return yaml_bad(csv, e, "give either a csv or a centre and width");
    if (!centre && b->fwhm_m > 0)
        return yaml_bad(map, e, "a width needs a centre");
    if (csv && (b->csv[0] == '/' || strstr(b->csv, "..") || !*b->csv))
        return yaml_bad(csv, e,
                        "must be a path below the rig's folder, so that a session can "
                        "carry it along");
    return true;
}

static bool get_camera(struct ynode *root, struct rig *rig, struct err *e)
{
    struct ynode *map;
    rig->camera.gain = 1;
    rig->camera.black = rig->camera.focus_per_m = NAN;
    return ymap_map(root, "camera", Y_NEEDED, &map, e) &&
           get_text(map, "uri", Y_NEEDED, &rig->camera.uri, e) &&
           ymap_num(map, "gain", Y_OPTIONAL, UNIT_NONE, 1e-3, 1e4, &rig->camera.gain, e) &&
           ymap_num(map, "focus", Y_OPTIONAL, UNIT_NONE, 0, 1e3, &rig->camera.focus_per_m, e) &&
           ymap_num(map, "responsivity", Y_OPTIONAL, UNIT_NONE, 1e-12, 1e18,
                    &rig->camera.responsivity, e) &&
           ymap_num(map, "black", Y_OPTIONAL, UNIT_NONE, 0, 65535, &rig->camera.black, e) &&
           ymap_int(map, "bits", Y_OPTIONAL, 8, 16, &rig->camera.bits, e) &&
           get_band(map, &rig->camera.band, e);
}

static bool get_light(struct ynode *map, struct rig_light *l, struct err *e)
{
    *l = (struct rig_light){.max_on_s = 10, .max_duty = 1};
    return get_name(map, &l->name, e) &&
           ymap_int(map, "line", Y_NEEDED, 0, MAX_LIGHTS - 1, &l->line, e) &&
           ymap_num(map, "irradiance", Y_OPTIONAL, UNIT_NONE, 1e-12, 1e12, &l->irradiance, e) &&
           ymap_num(map, "max_on", Y_NEEDED, UNIT_S, 1e-5, 3600, &l->max_on_s, e) &&
           ymap_num(map, "max_duty", Y_OPTIONAL, UNIT_NONE, 1e-3, 1, &l->max_duty, e) &&
           ymap_num(map, "lead", Y_OPTIONAL, UNIT_S, -1, 1, &l->lead_s, e) &&
           ymap_num(map, "lag", Y_OPTIONAL, UNIT_S, -1, 1, &l->lag_s, e) &&
           get_band(map, &l->band, e);
}

static bool get_filter(struct ynode *map, struct rig_filter *f, struct err *e)
{
    *f = (struct rig_filter){.throughput = 1};
    return get_name(map, &f->name, e) &&
           ymap_int(map, "position", Y_NEEDED, 0, MAX_FILTERS - 1, &f->position, e) &&
           ymap_num(map, "throughput", Y_OPTIONAL, UNIT_NONE, 1e-9, 1, &f->throughput, e) &&
           get_band(map, &f->band, e);
}

// The "list" of "lights" or "filters"; *list NULL when the rig has none.
static bool get_list(struct ynode *root, const char *key, int max, char **uri, struct ynode **list,
                     struct err *e)
{
    struct ynode *map = NULL;
    *list = NULL;
    if (!ymap_map(root, key, Y_OPTIONAL, &map, e))
        return false;
    if (!map)
        return true;
    if (!get_text(map, "trigger", Y_NEEDED, uri, e) || !ymap_list(map, "list", Y_NEEDED, list, e))
        return false;
    const int n = ylist_count(*list);
    if (n < 1 || n > max)
        return yaml_bad(*list, e, "%d entries: must be 1 to %d", n, max);
    for (int k = 0; k < n; k++)
        if (!ynode_is_map(ylist_at(*list, k)))
            return yaml_bad(ylist_at(*list, k), e, "expected a map of 'key: value' lines");
    return true;
}

static bool get_lights(struct ynode *root, struct rig *rig, struct err *e)
{
    struct ynode *list;
    if (!get_list(root, "lights", MAX_LIGHTS, &rig->lights_uri, &list, e))
        return false;
    const int n = list ? ylist_count(list) : 0;
    rig->light = xcalloc((size_t)n + 1, sizeof *rig->light);
    for (; rig->n_lights < n; rig->n_lights++) {
        struct ynode *at = ylist_at(list, rig->n_lights);
        struct rig_light *l = &rig->light[rig->n_lights];
        if (!get_light(at, l, e)) {
            rig->n_lights++; // so that rig_finish() frees what was read of it
            return false;
        }
        for (int k = 0; k < rig->n_lights; k++)
            if (!strcmp(rig->light[k].name, l->name) || rig->light[k].line == l->line) {
                rig->n_lights++;
                return yaml_bad(at, e, "name '%s' or line %d is already taken", l->name, l->line);
            }
    }
    return true;
}

static bool get_filters(struct ynode *root, struct rig *rig, struct err *e)
{
    struct ynode *list;
    if (!get_list(root, "filters", MAX_FILTERS, &rig->filters_uri, &list, e))
        return false;
    const int n = list ? ylist_count(list) : 0;
    rig->filter = xcalloc((size_t)n + 1, sizeof *rig->filter);
    for (; rig->n_filters < n; rig->n_filters++) {
        struct ynode *at = ylist_at(list, rig->n_filters);
        struct rig_filter *f = &rig->filter[rig->n_filters];
        if (!get_filter(at, f, e)) {
            rig->n_filters++;
            return false;
        }
        for (int k = 0; k < rig->n_filters; k++)
            if (!strcmp(rig->filter[k].name, f->name) || rig->filter[k].position == f->position) {
                rig->n_filters++;
                return yaml_bad(at, e, "name '%s' or position %d is already taken", f->name,
                                f->position);
            }
    }
    return true;
}

bool rig_open(struct rig *rig, const char *path, struct err *e)
{
    struct yaml *y;
    struct err ignored;
    struct rig new = {.path = xstrdup(path)};
    if (!yaml_open(&y, path, e)) {
        free(new.path);
        return false;
    }
    struct ynode *root = yaml_root(y);
    const bool read = get_text(root, "name", Y_NEEDED, &new.name, e) &&
                      get_text(root, "sample", Y_OPTIONAL, &new.sample, e) &&
                      get_camera(root, &new, e) && get_lights(root, &new, e) &&
                      get_filters(root, &new, e);
    if (!yaml_close(y, read, read ? e : &ignored) || !read) {
        rig_finish(&new);
        return false;
    }
    *rig = new;
    return true;
}

void rig_finish(struct rig *rig)
{
    for (int k = 0; k < rig->n_lights; k++) {
        free(rig->light[k].name);
        free(rig->light[k].band.csv);
    }
    for (int k = 0; k < rig->n_filters; k++) {
        free(rig->filter[k].name);
        free(rig->filter[k].band.csv);
    }
    free(rig->light);
    free(rig->filter);
    free(rig->lights_uri);
    free(rig->filters_uri);
    free(rig->camera.uri);
    free(rig->camera.band.csv);
    free(rig->name);
    free(rig->sample);
    free(rig->path);
    *rig = (struct rig){0};
}

int rig_light_index(const struct rig *rig, const char *name)
{
    for (int k = 0; k < rig->n_lights; k++)
        if (!strcmp(rig->light[k].name, name))
            return k;
    return -1;
}

int rig_filter_index(const struct rig *rig, const char *name)
{
    for (int k = 0; k < rig->n_filters; k++)
        if (!strcmp(rig->filter[k].name, name))
            return k;
    return -1;
}

double rig_irradiance(const struct rig *rig, int light, int filter)
{
    return light < 0
               ? 0
               : rig->light[light].irradiance * (filter < 0 ? 1 : rig->filter[filter].throughput);
}

static char *beside(const char *path, const char *name)
{
    char *copy = xstrdup(path), *full = xasprintf("%s/%s", dirname(copy), name);
    free(copy);
    return full;
}

// Multiplies `value` [n] on the grid by a band, 1 at its peak; one that is not known is 1
// everywhere.
static bool through(const struct rig *rig, const struct rig_band *b, double *value, int n,
                    bool *known, struct err *e)
{
    struct spectrum csv = {0};
    double most = 1;
    if (b->csv) {
        char *path = beside(rig->path, b->csv);
        const bool ok = spectrum_read_csv(&csv, path, e);
        free(path);
        if (!ok)
            return false;
        most = 0;
        for (int k = 0; k < csv.n; k++)
            most = fmax(most, csv.value[k]);
        if (!(most > 0)) {
            spectrum_finish(&csv);
            return err_set(e, ERR_DATA,
                           "%s:%d: '%s' is 0 at every wavelength: no light gets through", rig->path,
                           b->line, b->csv);
        }
    }
    const double sigma_m = b->fwhm_m / (2 * sqrt(2 * log(2)));
    for (int k = 0; k < n; k++) {
        const double lambda_m = (GRID_FIRST_NM + k) * 1e-9;
        const double from_centre = sigma_m > 0 ? (lambda_m - b->centre_m) / sigma_m : 0;
        value[k] *=
            b->csv ? spectrum_at(&csv, lambda_m) / most : exp(-0.5 * from_centre * from_centre);
    }
    *known |= b->csv || sigma_m > 0;
    spectrum_finish(&csv);
    return true;
}

bool rig_spectrum(const struct rig *rig, int light, int filter, struct spectrum *s, struct err *e)
{
    enum { N = GRID_LAST_NM - GRID_FIRST_NM + 1 };
    struct spectrum p = {N, xcalloc(N, sizeof(double)), xcalloc(N, sizeof(double))};
    for (int k = 0; k < N; k++) {
        p.lambda_m[k] = (GRID_FIRST_NM + k) * 1e-9;
        p.value[k] = 1;
    }
    bool known = false;
    bool ok = through(rig, &rig->camera.band, p.value, N, &known, e) &&
              (light < 0 || through(rig, &rig->light[light].band, p.value, N, &known, e)) &&
              (filter < 0 || through(rig, &rig->filter[filter].band, p.value, N, &known, e));
    double peak = 0;
    for (int k = 0; k < N; k++)
        peak = fmax(peak, p.value[k]);
    if (ok && !known)
        ok = err_set(e, ERR_DATA, "%s: names no spectrum of this light, filter or camera",
                     rig->path);
    if (ok && !(peak > DARK))
        ok = err_set(e, ERR_DATA,
                     "%s:%d: light '%s', filter '%s' and the camera have no wavelength in common: "
                     "no light gets through",
                     rig->path,
                     filter >= 0  ? rig->filter[filter].band.line
                     : light >= 0 ? rig->light[light].band.line
                                  : rig->camera.band.line,
                     light < 0 ? "none" : rig->light[light].name,
                     filter < 0 ? "none" : rig->filter[filter].name);
    for (int k = 0; ok && k < N; k++)
        p.value[k] /= peak;
    if (ok)
        *s = p;
    else
        spectrum_finish(&p);
    return ok;
}

bool rig_wavelength(const struct rig *rig, int light, int filter, double *centre_m, double *sigma_m,
                    struct err *e)
{
    struct spectrum s;
    if (!rig_spectrum(rig, light, filter, &s, e))
        return false;
    double sum = 0, first = 0, second = 0;
    for (int k = 0; k < s.n; k++) {
        sum += s.value[k];
        first += s.value[k] * s.lambda_m[k];
    }
    for (int k = 0; k < s.n; k++)
        second += s.value[k] * pow(s.lambda_m[k] - first / sum, 2);
    *centre_m = first / sum;
    *sigma_m = sqrt(second / sum);
    spectrum_finish(&s);
    return true;
}

char *rig_uri(const struct rig *rig, const char *uri, const char *run)
{
    char *out = xstrdup("");
    while (*uri) {
        const bool is_run = !strncmp(uri, "@run", 4), is_rig = !strncmp(uri, "@rig", 4);
        const size_t plain = is_run || is_rig ? 0 : 1 + strcspn(uri + 1, "@");
        char *longer = xasprintf("%s%.*s%s", out, (int)plain, uri,
                                 is_run   ? run
                                 : is_rig ? rig->path
                                          : "");
        free(out);
        out = longer;
        uri += plain ? plain : 4;
    }
    return out;
}

// A small text file, whole.
static bool copy_file(const char *from, const char *to, struct err *e)
{
    enum { LIMIT = 4 << 20 };
    FILE *f = fopen(from, "rb");
    if (!f)
        return err_errno(e, "%s", from);
    char *text = xcalloc(LIMIT, 1);
    const size_t n = fread(text, 1, LIMIT, f);
    bool ok = !ferror(f) || err_errno(e, "%s", from);
    ok = ok && (n < LIMIT || err_set(e, ERR_DATA, "%s: longer than 4 MiB", from));
    fclose(f);
    ok = ok && outfile_write(to, text, n, e);
    free(text);
    return ok;
}

static bool make_folders(char *path, struct err *e) // of everything before the last '/'
{
    for (char *s = strchr(path + 1, '/'); s; s = strchr(s + 1, '/')) {
        *s = 0;
        const bool ok = !mkdir(path, 0777) || errno == EEXIST;
        if (!ok)
            err_errno(e, "%s", path);
        *s = '/';
        if (!ok)
            return false;
    }
    return true;
}

static bool copy_csv(const struct rig *rig, const struct rig_band *b, const char *folder,
                     struct err *e)
{
    if (!b->csv)
        return true;
    char *from = beside(rig->path, b->csv), *to = xasprintf("%s/%s", folder, b->csv);
    const bool ok = make_folders(to, e) && copy_file(from, to, e);
    free(from);
    free(to);
    return ok;
}

bool rig_copy(const struct rig *rig, const char *folder, struct err *e)
{
    char *to = xasprintf("%s/rig.yaml", folder);
    bool ok = copy_file(rig->path, to, e) && copy_csv(rig, &rig->camera.band, folder, e);
    for (int k = 0; ok && k < rig->n_lights; k++)
        ok = copy_csv(rig, &rig->light[k].band, folder, e);
    for (int k = 0; ok && k < rig->n_filters; k++)
        ok = copy_csv(rig, &rig->filter[k].band, folder, e);
    free(to);
    return ok;
}

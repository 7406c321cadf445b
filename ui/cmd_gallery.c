// cmd_gallery.c - nacre gallery: the figures of the papers again, from simulated samples.
//
// Each table and picture is one run of this program, whose words the page shows.
#define _GNU_SOURCE
#include "core/datapath.h"
#include "core/infile.h"
#include "core/log.h"
#include "core/mem.h"
#include "ui/child.h"
#include "ui/coil.h"
#include "ui/commands.h"
#include "ui/html.h"
#include "ui/lamp.h"
#include "ui/words.h"
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct args {
    const char *out, *environment, *size;
    bool fresh;
};

static const struct opt opts[] = {
    {"o", OPT_FILE, offsetof(struct args, out), "FOLDER", "gallery-out",
     "where tables, pictures and index.html go"},
    {"environment", OPT_FILE, offsetof(struct args, environment), "MAP",
     .help = "lat-long map in the place of the made-up room"},
    {"size", OPT_TEXT, offsetof(struct args, size), "WxH", "960x720", "of the pictures"},
    {"fresh", OPT_FLAG, offsetof(struct args, fresh),
     .help = "make tables that are there already once more"},
    {0},
};

// Words of a command; "@" is the folder of tables, "%" that of the shipped rigs. The file that they
// make comes last.
#define PHOTO "simulate %/samples/"
#define TABLE " --illuminant D65 --scale 0.25 --lambda 530nm "
static const struct {
    const char *words, *file;
} tables[] = {
    {PHOTO "lcd.yaml --what pattern --filter green -o", "phone-photo.exr"},
    {"lut @/phone-photo.exr" TABLE "--h-per-pixel 7.2e-4 --f0 0.2 --range 0.3 --power 3 --size 501 "
     "-o",
     "phone.exr"},
    {"lut @/phone-photo.exr" TABLE "--h-per-pixel 7.2e-4 --f0 0.2 --range 0.3 --power 3 --size 501 "
     "--psf @/lamp.exr -o",
     "phone-lamp.exr"},
    {PHOTO "phone-fine.yaml --what pattern --filter green -o", "fine-photo.exr"},
    {"lut @/fine-photo.exr" TABLE "--h-per-pixel 7.2e-4 --f0 0.2 --range 0.3 --power 3 --size 501 "
     "-o",
     "phone-fine.exr"},
    {PHOTO "holographic.yaml --what pattern --filter green -o", "paper-photo.exr"},
    {"lut @/paper-photo.exr" TABLE "--h-per-pixel 1.8e-3 --f0 0.894427 --range 1.2 --size 501 -o",
     "holographic.exr"},
    {PHOTO "tv.yaml --what pattern --filter green -o", "tv-photo.exr"},
    {"lut @/tv-photo.exr" TABLE "--h-per-pixel 1.5e-4 --f0 0.2 --range 0.1 --power 3 --size 501 -o",
     "tv.exr"},
    {PHOTO "laptop.yaml --what pattern --filter green -o", "laptop-photo.exr"},
    {"lut @/laptop-photo.exr --illuminant F1 --scale 0.25 --lambda 530nm --h-per-pixel 1.5e-3 --f0 "
     "0.2 --range 0.54 --power 3 --size 501 -o",
     "laptop.exr"},
    {PHOTO "blazed.yaml --what truth --illuminant D65 --range 1.6 --size 1001 -o", "blazed.exr"},
    {PHOTO "cd.yaml --what truth --illuminant D65 --range 0.9 --size 601 -o", "cd.exr"},
    {PHOTO "quasi-periodic.yaml --what height -o", "snake.gsf"},
    {"tables @/snake.gsf --illuminant D65 --absolute --range 0.74 --size 401 --power 1 --tolerance "
     "1e-3 -o",
     "snake.exr"},
    {"factor @/laptop.exr --rank 1 --kind composition -o", "rank-1.exr"},
    {"factor @/laptop.exr --rank 1 --align --kind composition -o", "rank-1-aligned.exr"},
    {"factor @/laptop.exr --rank 11 --kind composition -o", "rank-11.exr"},
    {"factor @/phone.exr --rank 1 --kind composition -o", "phone-1.exr"},
    {"factor @/phone.exr --rank 11 --kind composition -o", "phone-11.exr"},
    {"factor @/phone.exr --rank 21 --kind composition -o", "phone-21.exr"},
#define POLE "prefilter studio --lut @/phone.exr --tangent 1,0,0 --normal 0,1,0 --method separable "
    {POLE "--passes 2 --size 1536 -o", "pole-2.exr"},
    {POLE "--passes 4 --size 1536 -o", "pole-4.exr"},
};

enum { MOST_PICTURES = 4 };
static const struct figure {
    const char *title, *text;
    struct {
        const char *scene, *more, *file, *caption; // file NULL: the scene's name
    } picture[MOST_PICTURES];
} figures[] = {
    {"T17 figure 7: phones",
     "Tables measured from one simulated photograph each under a green filter (T17 eq. 15), lit by "
     "a small LED.",
     {{"phone", "", NULL, "Pixels of 25 um."},
      {"phone-fine", "", NULL, "Pixels of 16 x 20 um: the orders are farther apart."}}},
    {"T17 figure 8: holographic paper",
     "A crossed relief of 1.2 um on a rough foil.",
     {{"holographic", "", NULL, "Point light, sheet flat."}}},
    {"T17 figures 14 and 15: one photograph, four lights",
     "The photograph's table is summed anew for each spectrum.",
     {{"laptop", "", NULL, "F1, as in figure 14."},
      {"laptop", "--illuminant E", "laptop-e", "Full spectrum (E)."},
      {"laptop", "--illuminant A", "laptop-a", "Incandescent (A)."},
      {"laptop", "--illuminant inverse-A", "laptop-blue", "Cool blue (inverse of A)."}}},
    {"T17 figure 17: rolled to a cylinder",
     "The same table, read in the local frame of every point.",
     {{"cylinder", "", NULL, "The pattern is squeezed sideways."}}},
    {"T17 figure 18: a TV", "Chevron pixels.", {{"tv", "", NULL, "A torch beside the viewer."}}},
    {"T17 figure 19: from heights",
     "Tables of the height profiles of a disc's tracks and a ruled grating.",
     {{"cd-heights", "", NULL, "Tracks of 2 um."},
      {"blazed", "", NULL, "600 lines/mm, 13 degrees of blaze: the left side is brighter."}}},
    {"T17 figure 20: radial pattern in stripes",
     "One row of slits (T17 eq. 16) turned about the normal.",
     {{"radial-whole", "", NULL, "Without the mask."}, {"radial", "", NULL, "With it."}}},
    {"T17 figure 21: a compact disc",
     "21 slits of 0.5 um at 2 um, under a clear layer that mirrors the room.",
     {{"cd", "", NULL, "Slits, spectrally."},
      {"cd-g04", "", NULL, "GPU Gems ch. 8: Stam's shader with its rainbow of three bumps."}}},
    {"T17 figure 22: a lamp of several LEDs",
     "Four LEDs are four patterns.",
     {{"led-array", "", NULL, "2 x 2 LEDs, 14 mm apart, as lights of the scene."},
      {"phone", "--table @/phone-lamp.exr", "phone-lamp",
       "A ring of eight LEDs, warm and cool, and one in its middle: one look-up in the phone's "
       "table, "
       "convolved with the lamp's mirror image (T17 6.2)."}}},
    {"R17 figure 1: surroundings",
     "Flat samples show their exactly prefiltered map; the disc and the ball the room's lamps as "
     "lights and the rest of it around the directions that the cells of their pattern mirror.",
     {{"cd-room", "", NULL, "Compact disc."},
      {"tv-room", "", NULL, "TV."},
      {"holographic-room", "", NULL, "Holographic paper."}}},
    {"R17 figure 4: products of filters",
     "The laptop's askew pattern as one product along the table's own axes, one along the "
     "pattern's "
     "(R17's affine map), and 11: compare with figure 14 above.",
     {{"laptop", "--factors @/rank-1.exr", "rank-1", "Rank 1."},
      {"laptop", "--factors @/rank-1-aligned.exr", "rank-1-aligned", "Rank 1, aligned."},
      {"laptop", "--factors @/rank-11.exr", "rank-11", "Rank 11."}}},
    {"R17 figure 5: filters of different ranks",
     "The phone's table as sums of products, in surroundings: the room blurs what they miss.",
     {{"phone-room", "--factors @/phone-1.exr", "phone-rank-1", "Rank 1."},
      {"phone-room", "--factors @/phone-11.exr", "phone-rank-11", "Rank 11."},
      {"phone-room", "--factors @/phone-21.exr", "phone-rank-21", "Rank 21."}}},
    {"R17 figure 6: at the pole of the sphere",
     "R17's filtered map of a lamp overhead, looked at upwards: the pattern's lines.",
     {{"pole", "--environment @/pole-2.exr", "pole-2",
       "Two passes over the map: lines bend around its pole."},
      {"pole", "--environment @/pole-4.exr", "pole-4",
       "Four passes, the map turned to the sample before and back after: straight."}}},
    {"R17 figure 7: phones in surroundings",
     "The spots behind the viewer in the screen, with their orders.",
     {{"phone-room", "", NULL, "Pixels of 25 um. Exact for this orientation."},
      {"phone-room", "--table @/phone-fine.exr", "phone-fine-room", "Pixels of 16 x 20 um."}}},
    {"R17 figure 8: turned in its plane",
     "The phone turned by 30 degrees: the pattern turns with its pixels, the room's mirror image "
     "stays. T17's prefiltered maps cannot do that.",
     {{"phone-room-turned", "", NULL, "Prefiltered for this frame."}}},
    {"Two renderers",
     "OpenGL beside the CPU's reference in double.",
     {{"laptop", "--view difference --against cpu", "laptop-gl-cpu",
       "The difference, down to 1e-4 of the peak: nothing."}}},
    {"Snake scales (D14)",
     "Nearly periodic ridges on a mesh; tables over (u, v) with POD curves in w.",
     {{"snake", "", NULL, "All tables."},
      {"snake", "--tolerance 0.02", "snake-few", "As many as 2 % need."}}},
};

struct gallery {
    const struct args *args;
    char *tables, *rigs;
};

static bool run_words(const char *words, struct err *e)
{
    struct child c = {0};
    const bool ok = child_do(words, &c, e);
    if (ok)
        log_note("%6.2f s   nacre %s", c.wall_s, words);
    child_finish(&c);
    return ok;
}

static char *table_file(const struct gallery *g, size_t k)
{
    return xasprintf("%s/%s", g->tables, tables[k].file);
}

static char *table_words(const struct gallery *g, size_t k)
{
    char *begin = words_expand(tables[k].words, g->tables, g->rigs);
    char *file = table_file(g, k), *quoted = words_quote(file);
    char *words = xasprintf("%s %s", begin, quoted);
    free(quoted);
    free(file);
    free(begin);
    return words;
}

static bool make_tables(const struct gallery *g, struct err *e)
{
    char *lamp = xasprintf("%s/lamp.exr", g->tables);
    bool ok = lamp_write(lamp, e);
    free(lamp);
    for (size_t k = 0; ok && k < sizeof tables / sizeof *tables; k++) {
        char *file = table_file(g, k), *words = table_words(g, k);
        if (g->args->fresh || access(file, F_OK))
            ok = run_words(words, e);
        free(words);
        free(file);
    }
    char *coil = xasprintf("%s/snake.obj", g->tables);
    ok = ok && coil_write(coil, e);
    free(coil);
    return ok;
}

static char *picture_words(const struct gallery *g, const char *scene, const char *more,
                           const char *file)
{
    char *line =
        xasprintf("render %%/scenes/%s.yaml --tables @%s%s%s", scene, *more ? " " : "", more, "");
    char *begin = words_expand(line, g->tables, g->rigs);
    const bool other = g->args->environment && !strstr(more, "--environment");
    char *map = words_quote(other ? g->args->environment : "");
    char *size = words_quote(g->args->size);
    char *path = xasprintf("%s/%s.png", g->args->out, file), *png = words_quote(path);
    char *words = xasprintf("%s%s%s --size %s -o %s", begin, other ? " --environment " : "",
                            other ? map : "", size, png);
    free(line);
    free(begin);
    free(map);
    free(size);
    free(path);
    free(png);
    return words;
}

// The scene's file, to be opened below its picture.
static bool show_scene(const struct gallery *g, const char *scene, struct html *h, struct err *e)
{
    char *path = xasprintf("%s/scenes/%s.yaml", g->rigs, scene);
    size_t size;
    char *text = infile_slurp(path, 1 << 20, &size, e);
    if (text) {
        fputs("<details><summary>scene</summary><pre>", h->f);
        html_escape(h, text);
        fputs("</pre></details>", h->f);
    }
    const bool ok = text || err_in(e, "%s", path);
    free(text);
    free(path);
    return ok;
}

static bool make_figure(const struct gallery *g, const struct figure *f, struct html *h,
                        struct err *e)
{
    bool ok = true;
    html_section(h, f->title, f->text);
    fputs("<div class=row>", h->f);
    for (int k = 0; ok && k < MOST_PICTURES && f->picture[k].scene; k++) {
        const char *scene = f->picture[k].scene,
                   *file = f->picture[k].file ? f->picture[k].file : scene;
        char *words = picture_words(g, scene, f->picture[k].more, file);
        char *png = xasprintf("%s.png", file);
        fputs("<div>", h->f);
        html_picture(h, png, f->picture[k].caption);
        html_command(h, words);
        ok = run_words(words, e) && show_scene(g, scene, h, e);
        fputs("</div>", h->f);
        free(png);
        free(words);
    }
    fputs("</div>\n", h->f);
    return ok;
}

static bool make_folder(const char *path, struct err *e)
{
    return !mkdir(path, 0777) || errno == EEXIST || err_errno(e, "%s", path);
}

static bool write_page(const struct gallery *g, struct cli *cli, struct err *e)
{
    struct html h;
    html_open(&h, "The papers' figures again",
              "nacre " NACRE_VERSION ": every sample is simulated, every table and picture made by "
              "the command below it.");
    bool ok = true;
    for (size_t k = 0; ok && k < sizeof figures / sizeof *figures; k++)
        ok = make_figure(g, &figures[k], &h, e);
    html_section(&h, "Tables", "In the order in which they were made.");
    for (size_t k = 0; k < sizeof tables / sizeof *tables; k++) {
        char *words = table_words(g, k);
        html_command(&h, words);
        free(words);
    }
    char *path = xasprintf("%s/index.html", g->args->out);
    ok = html_close(&h, ok ? path : NULL, ok ? e : &(struct err){0}) && ok;
    if (ok)
        doc_text(cli->doc, "page", path);
    free(path);
    return ok;
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    struct gallery g = {.args = args};
    char *sim = data_path("rigs/sim.yaml", e);
    if (!sim)
        return false;
    g.rigs = xasprintf("%.*s", (int)(strlen(sim) - strlen("/sim.yaml")), sim);
    g.tables = xasprintf("%s/tables", g.args->out);
    const bool ok = make_folder(g.args->out, e) && make_folder(g.tables, e) && make_tables(&g, e) &&
                    write_page(&g, cli, e);
    free(g.tables);
    free(g.rigs);
    free(sim);
    return ok;
}

const struct command cmd_gallery = {
    .name = "gallery",
    .summary = "draw the papers' figures from simulated samples, as a page",
    .operands = "",
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes = "Open gallery-out/index.html. The tables stay for nacre render and nacre-view.",
    .run = run,
};

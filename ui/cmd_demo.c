// cmd_demo.c - nacre demo: the main job on the simulated rig, as the commands a user would type.
//
// Each step is one run of this program; the report shows its words, so that every figure in it can
// be made again by hand.
#define _GNU_SOURCE
#include "core/datapath.h"
#include "core/imgfile.h"
#include "core/log.h"
#include "core/mem.h"
#include "ui/child.h"
#include "ui/commands.h"
#include "ui/contact_sheet.h"
#include "ui/doc.h"
#include "ui/html.h"
#include "ui/words.h"
#include <errno.h>
#include <ftw.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct args {
    const char *out;
};

static const struct opt opts[] = {
    {"o", OPT_FILE, offsetof(struct args, out), "FOLDER", "demo-out",
     "where the products and report.html go; products of a demo before are replaced"},
    {0},
};

struct fact {
    const char *key, *label; // of the step's JSON document; for the report
    double scale;            // what is shown is value * scale, with `unit`
    const char *unit;
};

struct step {
    const char *title, *text;
    const char *words; // "@" stands for the output folder, "%" for the folder rigs/
    struct fact fact[3];
};

enum {
    NOISE_SHOTS,
    DARK,
    NOISE,
    CAPTURE,
    VERIFY,
    MERGE,
    TABLE,
    REPLAY,
    TRUTH,
    JUDGE,
    RENDER,
    GRATING,
    BOKEH_RECORD,
    HIGHLIGHT,
    HEIGHT,
    HEIGHT_TABLES,
    HEIGHT_RENDER,
    PICTURES,
    N_STEPS = PICTURES + 5
};

static const struct step plan[N_STEPS] = {
    [NOISE_SHOTS] =
        {"Calibrate",
         "Pairs of equal exposures, and dark frames: what the camera itself adds to a picture.",
         "capture --rig %/sim.yaml --plan %/plans/noise.yaml -o @/calibration",
         {{0}}},
    [DARK] = {"Dark",
              "Black level, read noise, dark current and hot pixels, pixel by pixel.",
              "calib dark @/calibration -o @/dark.exr",
              {{"read_noise", "read noise", 1, " counts"}}},
    [NOISE] = {"Noise",
               "Gain by photon transfer: how the variance of a pixel grows with its level.",
               "calib noise @/calibration --dark @/dark.exr -o @/noise.yaml",
               {{"electrons_per_count", "gain", 1, " e/count"}}},
    [CAPTURE] =
        {"Capture",
         "An LED flash, a narrow-band filter, one exposure after the other. The daemon's run "
         "drives the simulated camera and lights by the same driver tables as real ones.",
         "capture --rig %/sim.yaml --plan %/plans/bracket.yaml -o @/session",
         {{"frames", "frames acknowledged", 1, ""}}},
    [VERIFY] =
        {"Verify",
         "Complete or partial is checked, not believed: every frame's SHA-256 against the ledger.",
         "session verify @/session",
         {{0}}},
    [MERGE] =
        {"Merge",
         "Each pixel is the average of its exposures with weights of one over their variance: shot "
         "and read noise decide, saturated samples do not count.",
         "hdr @/session --dark @/dark.exr --noise @/noise.yaml -o @/session/products/radiance.exr",
         {{"range_stops", "dynamic range", 1, " stops"}}},
    [TABLE] =
        {"Table",
         "The photograph at one wavelength, rescaled and summed over all wavelengths, is the table "
         "of "
         "the surface under any light: here D65.",
         "lut @/session/products/radiance.exr --lambda 530nm --h-per-pixel 7.2e-4 --center "
         "499.5,499.5 --scale 0.25 "
         "--illuminant D65 --f0 0.2 --size 512 --range 0.24 --power 1 -o "
         "@/session/products/table.exr",
         {{0}}},
    [REPLAY] = {"Replay",
                "The ledger knows what the two products were made from, and how: made once more, "
                "they are the same bytes.",
                "session replay @/session --verify",
                {{"same", "products made again, the same bytes", 1, ""}}},
    [TRUTH] = {"Truth",
               "The simulator knows its sample: the same table from the formula of the diffraction "
               "pattern, "
               "in double precision, with no photograph in between. It shares no code with the "
               "step before.",
               "simulate %/sim.yaml --what truth --illuminant D65 --size 512 --range 0.24 --power "
               "1 -o @/truth.exr",
               {{0}}},
    [JUDGE] = {"Error",
               "What the camera's noise, its pixels and the method together cost.",
               "compare @/session/products/table.exr @/truth.exr -o @/error.png",
               {{"relative_l2", "table error, relative L2", 100, " %"},
                {"worst_of_peak", "worst of the peak", 100, " %"}}},
    [RENDER] = {"Render",
                "The measured table on a plane sample under one light, drawn by OpenGL.",
                "render %/scenes/plane.yaml --table @/session/products/table.exr -o @/render.png "
                "--size 1280x960",
                {{0}}},
    [GRATING] = {"Grating",
                 "Far out of focus the highlight is a disc, and in it the surface is seen. First "
                 "one that is known, for the scale: a ruled grating of 600 lines/mm.",
                 "simulate %/samples/blazed.yaml --what bokeh -o @/grating.exr",
                 {{0}}},
    [BOKEH_RECORD] = {"Bokeh",
                      "The disc, the turn, the scale, the blur, and from intensity to height.",
                      "calib bokeh @/grating.exr --lines 600/mm --blaze 13deg -o @/bokeh.yaml",
                      {{"um_per_px", "bokeh scale", 1, " um/px"}}},
    [HIGHLIGHT] = {"Highlight",
                   "Then the sample: ridges as on a snake's scale, 1.6 um apart.",
                   "simulate %/samples/quasi-periodic.yaml --what bokeh -o @/highlight.exr",
                   {{0}}},
    [HEIGHT] = {"Height",
                "Deblurred, scaled and levelled: a height field.",
                "bokeh @/highlight.exr --calibration @/bokeh.yaml -o @/height.gsf",
                {{"height_sd_m", "height, standard deviation", 1e9, " nm"}}},
    [HEIGHT_TABLES] = {"Tables",
                       "How that surface diffracts, for all angles: a few tables over the half "
                       "vector with a curve in w each, as many as the error asked for needs.",
                       "tables @/height.gsf --coherence 25um --illuminant D65 --tolerance 1e-2 "
                       "-o @/height-tables.exr",
                       {{"error_l2", "tables of the height field, error", 100, " %"}}},
    [HEIGHT_RENDER] = {"Surface",
                       "The same surface rolled to a cylinder, under one light.",
                       "render %/scenes/cylinder.yaml --table @/height-tables.exr "
                       "-o @/height-render.png --size 960x720",
                       {{0}}},
    [PICTURES] = {"Pictures",
                  "",
                  "look @/session/products/radiance.exr @/radiance.png --false-color 5",
                  {{0}}},
    {"Pictures", "", "look @/session/products/table.exr @/table.png", {{0}}},
    {"Pictures", "", "look @/truth.exr @/truth.png", {{0}}},
    {"Pictures", "", "look @/highlight.exr @/highlight.png --exposure 0", {{0}}},
    {"Pictures", "", "look @/height.gsf @/height.png", {{0}}},
};

struct run {
    struct doc *doc;
    double wall_s;
};

static bool run_step(const struct step *s, const char *out, const char *rigs, struct run *r,
                     struct err *e)
{
    char *words = words_expand(s->words, out, rigs);
    struct child c = {0};
    const bool ok = child_do(words, &c, e);
    if (ok) {
        r->wall_s = c.wall_s;
        r->doc = doc_parse(c.out);
        log_note("%-10s %6.2f s   nacre %s", s->title, r->wall_s, words);
    }
    child_finish(&c);
    free(words);
    return ok;
}

static bool write_contact_sheet(const char *out, struct err *e)
{
    char *session = xasprintf("%s/session", out), *png = xasprintf("%s/bracket.png", out);
    struct image sheet = {0};
    const bool ok = contact_sheet(session, 240, 5, &sheet, e) && image_write(&sheet, png, e);
    image_finish(&sheet);
    free(session);
    free(png);
    return ok;
}

static void write_cards(struct html *h, const struct run *run, double total_s)
{
    fputs("<div class=cards>", h->f);
    for (int k = 0; k < N_STEPS; k++)
        for (const struct fact *f = plan[k].fact; f < plan[k].fact + 3 && f->key; f++) {
            const double value = run[k].doc ? doc_get_num(run[k].doc, f->key) * f->scale : NAN;
            if (isfinite(value))
                fprintf(h->f, "<div class=card><b>%.3g%s</b><span>%s</span></div>", value, f->unit,
                        f->label);
        }
    fprintf(h->f, "<div class=card><b>%.1f s</b><span>all steps</span></div></div>\n", total_s);
}

static void write_times(struct html *h, const struct run *run, double total_s)
{
    html_section(h, "Time", "Wall time of each command, its start included.");
    fputs("<table>", h->f);
    for (int k = 0; k < N_STEPS; k++)
        fprintf(h->f,
                "<tr><td style=\"width:7rem\">%s<td class=n style=\"width:5rem\">%.2f s<td><div "
                "class=bar "
                "style=\"width:%.1f%%\"></div></tr>",
                plan[k].title, run[k].wall_s, 100 * run[k].wall_s / total_s);
    fputs("</table>\n", h->f);
}

static void section(struct html *h, int k, const char *out)
{
    char *words = words_expand(plan[k].words, out, "rigs");
    html_section(h, plan[k].title, plan[k].text);
    html_command(h, words);
    free(words);
}

static bool write_report(const char *out, const struct run *run, struct err *e)
{
    double total_s = 0;
    for (int k = 0; k < N_STEPS; k++)
        total_s += run[k].wall_s;
    struct html h;
    html_open(&h, "From a sample to a rendered picture",
              "nacre " NACRE_VERSION
              " on the simulated rig: a phone-like screen of 25 um pixels, photographed, "
              "merged, turned into a diffraction table, judged against the truth, and drawn; then "
              "a finely ridged surface, from its out-of-focus highlight to heights.");
    write_cards(&h, run, total_s);
    html_picture(&h, "render.png", "The rendered sample.");
    section(&h, NOISE_SHOTS, out);
    section(&h, DARK, out);
    section(&h, NOISE, out);
    section(&h, CAPTURE, out);
    html_picture(&h, "bracket.png", "The bracket, shortest exposure first. Red: saturated.");
    section(&h, VERIFY, out);
    section(&h, MERGE, out);
    html_picture(&h, "radiance.png",
                 "Merged radiance in false colour, logarithmic over five decades.");
    section(&h, TABLE, out);
    section(&h, REPLAY, out);
    section(&h, TRUTH, out);
    fputs("<div class=row>", h.f);
    html_picture(&h, "table.png", "Measured table.");
    html_picture(&h, "truth.png", "True table.");
    fputs("</div>", h.f);
    section(&h, JUDGE, out);
    html_picture(
        &h, "error.png",
        "Error of the table, logarithmic: bright is the worst, black 1e-4 of it; grey was not "
        "measured (rays through hot pixels).");
    section(&h, RENDER, out);
    section(&h, GRATING, out);
    section(&h, BOKEH_RECORD, out);
    section(&h, HIGHLIGHT, out);
    html_picture(&h, "highlight.png", "The sample in its own out-of-focus highlight.");
    section(&h, HEIGHT, out);
    html_picture(&h, "height.png", "The height field, dark is low.");
    section(&h, HEIGHT_TABLES, out);
    section(&h, HEIGHT_RENDER, out);
    html_picture(&h, "height-render.png", "What the height field makes of light.");
    write_times(&h, run, total_s);
    char *path = xasprintf("%s/report.html", out);
    const bool ok = html_close(&h, path, e);
    if (ok)
        log_note("report: %s", path);
    free(path);
    return ok;
}

static int remove_one(const char *path, const struct stat *st, int kind, struct FTW *ftw)
{
    (void)st;
    (void)kind;
    (void)ftw;
    return remove(path);
}

// Only what a demo makes: a session lies in a folder of its own, which capture would refuse.
static bool remove_session(const char *out, const char *name, struct err *e)
{
    char *session = xasprintf("%s/%s", out, name), *ledger = xasprintf("%s/ledger.db", session);
    const bool ok = access(ledger, F_OK) || !nftw(session, remove_one, 16, FTW_DEPTH | FTW_PHYS) ||
                    err_errno(e, "%s: cannot be removed", session);
    free(session);
    free(ledger);
    return ok;
}

static bool prepare(const char *out, struct err *e)
{
    if (mkdir(out, 0777) && errno != EEXIST)
        return err_errno(e, "%s", out);
    return remove_session(out, "calibration", e) && remove_session(out, "session", e);
}

static bool run(const void *args_, struct cli *cli, struct err *e)
{
    const struct args *args = args_;
    struct run done[N_STEPS] = {0};
    char *sim = data_path("rigs/sim.yaml", e),
         *rigs = sim ? xasprintf("%.*s", (int)(strlen(sim) - strlen("/sim.yaml")), sim) : NULL;
    setenv("NACRE_SOCKET", "own", false); // the service could not write to this folder
    bool ok = rigs && prepare(args->out, e);
    for (int k = 0; ok && k < N_STEPS; k++)
        ok = run_step(&plan[k], args->out, rigs, &done[k], e);
    ok = ok && write_contact_sheet(args->out, e) && write_report(args->out, done, e);
    if (ok) {
        char *path = xasprintf("%s/report.html", args->out);
        doc_text(cli->doc, "report", path);
        if (done[JUDGE].doc)
            doc_num(cli->doc, "table_error", doc_get_num(done[JUDGE].doc, "relative_l2"));
        free(path);
    }
    for (int k = 0; k < N_STEPS; k++)
        doc_free(done[k].doc);
    free(rigs);
    free(sim);
    return ok;
}

const struct command cmd_demo = {
    .name = "demo",
    .summary = "do the main job on the simulated rig and write a report",
    .operands = "",
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes = "Open demo-out/report.html. Every step of it is a command that can be run by hand.",
    .run = run,
};

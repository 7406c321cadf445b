// cmd_hdr.c - nacre hdr: the frames of a bracket into radiance.
#define _GNU_SOURCE
#include "calib/bracket.h"
#include "core/imgfile.h"
#include "core/mem.h"
#include "ui/commands.h"
#include "ui/hdr_job.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define AT(field) offsetof(struct hdr_options, field)
static const struct opt opts[] = {
    {"times", OPT_LIST, AT(times), "exif|nominal|T,..", "exif",
     "exposure times: from the files, snapped to the camera's third stops (1/15 is 1/16 s); as "
     "printed there; or given, in the order of the images"},
    {"linear", OPT_FLAG, AT(linear), .help = "8-bit samples are proportional to exposure"},
    {"response", OPT_FILE, AT(response), "auto|srgb|FILE", "auto",
     "curve of 8-bit samples: recovered from this bracket, sRGB, or a record of 'nacre calib "
     "response'"},
    {"method", OPT_CHOICE, AT(method), hdr_methods, "poisson",
     "weights: inverse variance, hat of ln X, or Gaussian times t^2"},
    {"scales", OPT_CHOICE, AT(scales), "auto|off", "auto",
     "correct every exposure by what neighbouring frames share (light drift, shutter)"},
    {"saturation", OPT_NUM, AT(saturation), "LEVEL", NULL,
     "linear samples above black from here on are saturated (default: the file's white level, or "
     "the plateau that the frames end in)"},
    {"dark", OPT_FILE, AT(dark), "FILE", NULL,
     "a dark record (default: the session's dark frames, else the files' black level)"},
    {"noise", OPT_FILE, AT(noise), "FILE", NULL,
     "a noise record (default: estimated from the bracket)"},
    {"flat", OPT_FILE, AT(flat), "FILE", NULL, "a flat record: divided out at the end"},
    {"max-shift", OPT_NUM, AT(max_shift_px), "PX", "2",
     "refuse a bracket whose frames are shifted by more", UNIT_PX},
    {"light", OPT_TEXT, AT(light), "NAME", NULL, "of a session: only frames under this light"},
    {"filter", OPT_TEXT, AT(filter), "NAME", NULL, "of a session: only frames through this filter"},
    {"group", OPT_INT, AT(group), "N", "-1", "of a session: only this bracket"},
    {"o", OPT_FILE, AT(out), "OUT", NULL,
     ".exr with variance and mask, or .pfm .hdr .png .tif with radiance alone", .needed = true},
    {0},
};

// Radiance alone, for files that hold no more than a picture.
static void keep_radiance(struct image *im)
{
    const size_t n = (size_t)im->w * (size_t)im->h, step = (size_t)im->nc, nc = step / 2;
    for (size_t k = 0; k < n; k++)
        memmove(im->px + k * nc, im->px + k * step, nc * sizeof(float));
    im->nc = (int)nc;
    meta_set_text(&im->meta, "channels", nc == 1 ? "Y" : "R,G,B");
}

static void add_line(char **text, const char *line)
{
    char *more = xasprintf("%s%s%s", *text, **text ? "\n" : "", line);
    free(*text);
    *text = more;
}

static void describe(struct hdr_job *job, const struct cli *cli)
{
    static const char *const kept[] = {"cameraModel", "lensModel", "capDate",
                                       "aperture",    "isoSpeed",  "nacre.distance_m"};
    const struct hdr_options *o = job->opt;
    const struct frames *f = &job->frames;
    struct meta *m = &job->out.meta;
    double scale[BRACKET_MAX], v;
    char *inputs = xstrdup(""), *records = xstrdup("");
    for (size_t k = 0; k < sizeof kept / sizeof *kept; k++) {
        const char *text = meta_text(&f->meta, kept[k]);
        if (text)
            meta_set_text(m, kept[k], text);
        else if (meta_num(&f->meta, kept[k], &v))
            meta_set_num(m, kept[k], v);
    }
    for (int k = 0; k < f->n; k++) {
        scale[k] = exp(job->log_scale[k]);
        add_line(&inputs, f->path[k]);
    }
    const char *const used[] = {o->dark, o->noise, o->flat,
                                f->code[0] && strcmp(o->response, "auto") ? o->response : NULL};
    for (int k = 0; k < 4; k++)
        if (used[k])
            add_line(&records, used[k]);
    meta_set_text(m, "nacre.version", NACRE_VERSION);
    meta_set_text(m, "nacre.command", cli->line);
    meta_set_text(m, "nacre.inputs", inputs);
    if (*records)
        meta_set_text(m, "nacre.records", records);
    if (o->flat)
        meta_set_text(m, "nacre.flat", o->flat);
    meta_set_text(m, "nacre.hdr.method", o->method);
    meta_set_nums(m, "nacre.hdr.time_s", f->time_s, f->n);
    meta_set_nums(m, "nacre.hdr.scale", scale, f->n);
    if (f->lambda_m > 0) {
        meta_set_num(m, "nacre.lambda_m", f->lambda_m);
        meta_set_num(m, "nacre.lambda_sigma_m", f->lambda_sigma_m);
        doc_num(cli->doc, "lambda_m", f->lambda_m);
    }
    if (!isnan(f->now.focus_per_m))
        meta_set_num(m, "nacre.focus_per_m", f->now.focus_per_m);
    free(inputs);
    free(records);

    if (*f->group)
        doc_text(cli->doc, "bracket", f->group);
    doc_int(cli->doc, "frames", f->n);
    doc_nums(cli->doc, "time_s", f->time_s, f->n);
    doc_nums(cli->doc, "scale", scale, f->n);
    doc_text(cli->doc, "unit", meta_text(m, "nacre.unit"));
    doc_num(cli->doc, "range_stops", hdr_range_stops(&job->out));
    const double all = (double)job->counts.samples, saturated = (double)job->counts.saturated,
                 black = (double)job->counts.black;
    doc_num(cli->doc, "valid_share", (all - saturated - black) / all);
    doc_num(cli->doc, "saturated_share", saturated / all);
    doc_num(cli->doc, "black_share", black / all);
}

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const struct hdr_options *o = args;
    struct hdr_job job;
    doc_text(cli->doc, "output", o->out);
    doc_text(cli->doc, "method", o->method);
    if (!hdr_job_run(&job, o, cli, e))
        return false;
    describe(&job, cli);
    if (strcmp(path_ext(o->out), ".exr"))
        keep_radiance(&job.out);
    const bool ok = image_write(&job.out, o->out, e);
    hdr_job_finish(&job);
    return ok;
}

const struct command cmd_hdr = {
    .name = "hdr",
    .summary = "merge the frames of a bracket into radiance",
    .operands = "IMAGE...|SESSION",
    .min_operands = 1,
    .max_operands = BRACKET_MAX,
    .opts = opts,
    .args_size = sizeof(struct hdr_options),
    .notes =
        "Writes radiance, its variance and a mask (1 where every channel was measured). A "
        "session's\n"
        "radiance is divided by the rig's responsivity and irradiance: L / E in 1/sr.\n"
        "  nacre hdr bracket/*.jpg --times exif -o radiance.exr\n"
        "  nacre hdr session --filter green -o green.exr\n"
        "  nacre hdr a.pfm b.pfm c.pfm --times 1/60s,1/15s,1/4s --saturation 4000 -o radiance.exr",
    .run = run,
};

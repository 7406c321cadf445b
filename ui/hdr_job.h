// hdr_job.h - one bracket on its way from frames to radiance, with every record it uses.
#pragma once
#include "calib/flat.h"
#include "calib/noise.h"
#include "process/align.h"
#include "process/hdr.h"
#include "ui/cli.h"
#include "ui/frames.h"

struct hdr_options {
    const char *times, *response, *method, *scales, *out;
    const char *dark, *noise, *flat, *light, *filter;
    bool linear;
    double saturation, max_shift_px;
    int group;
};

struct hdr_job {
    const struct hdr_options *opt;
    struct frames frames;
    double log_scale[BRACKET_MAX]; // of each frame's light: drift and shutter
    struct shift shift[BRACKET_MAX];
    struct image out; // process/hdr.h; L / E in 1/sr where the session knows how
    struct hdr_counts counts;
};

// Reads, checks, corrects, merges; what was found goes into cli->doc as it is known.
bool hdr_job_run(struct hdr_job *job, const struct hdr_options *opt, struct cli *cli,
                 struct err *e);
void hdr_job_finish(struct hdr_job *job); // accepts a zeroed struct

// report.h - what there is of a sample, and of a whole library of samples (docs/library.md).
#pragma once
#include "ui/cli.h"

struct report_args {
    const char *out;
};

// A card: of every STAGE=FILE its SHA-256 and the command that made it, and what the sample's
// errors are. It holds no time and nothing of this machine.
bool report_sample(const struct report_args *a, struct cli *cli, struct err *e);

// index.html and samples.csv from all cards that a list names. Samples without a card are named
// with the stage that failed and what it said: ERR_PARTIAL, once both files are written.
bool report_library(const struct report_args *a, struct cli *cli, struct err *e);

// cmd_report.c - nacre report: one sample's products on a card, a library of samples on a page.
#define _GNU_SOURCE
#include "ui/commands.h"
#include "ui/report.h"
#include <string.h>

static bool run(const void *args, struct cli *cli, struct err *e)
{
    const char *verb = cli->operand[0];
    if (!strcmp(verb, "sample"))
        return report_sample(args, cli, e);
    if (!strcmp(verb, "library"))
        return report_library(args, cli, e);
    return err_set(e, ERR_USAGE, "'%s' is not one of sample, library", verb);
}

static const struct opt options[] = {
    {"o", OPT_FILE, offsetof(struct report_args, out), "OUT", NULL,
     "of sample: the card, a JSON file; of library: the folder for index.html and samples.csv",
     .needed = true},
    {0},
};

static const struct verb verbs[] = {
    {"sample", "NAME STAGE=FILE...", "a card: how each file was made, its SHA-256, the errors"},
    {"library", "LIST", "a page and a CSV of all samples whose cards a list names"},
    {0},
};

enum { MOST_FILES = 200 };

const struct command cmd_report = {
    .name = "report",
    .summary = "put a sample's products on a card, a library of samples on a page",
    .operands = "sample|library NAME|LIST [STAGE=FILE...]",
    .min_operands = 2,
    .max_operands = MOST_FILES,
    .opts = options,
    .args_size = sizeof(struct report_args),
    .verbs = verbs,
    .notes =
        "library ends with 6 when a sample is not done: the page and the CSV name it, the stage\n"
        "that failed and why. workflows/run makes the list and calls both (docs/library.md).\n\n"
        "  nacre report sample lcd table=lcd.exr render=lcd.png error=lcd.json -o card.json\n"
        "  nacre report library samples.yaml -o library-out",
    .run = run,
};

// cmd_doctor.c - nacre doctor: what this machine has, and what to do about what it lacks.
#include "ui/commands.h"
#include <omp.h>

static bool run(const void *args, struct cli *cli, struct err *e)
{
    (void)args;
    (void)e;
    doc_text(cli->doc, "version", NACRE_VERSION);
    doc_int(cli->doc, "threads", omp_get_max_threads());
    return true;
}

const struct command cmd_doctor = {
    .name = "doctor",
    .summary = "check this machine: libraries, devices, GL, disk",
    .operands = "",
    .args_size = 1,
    .run = run,
};

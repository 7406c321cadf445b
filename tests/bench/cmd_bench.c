// cmd_bench.c - nacre bench: run time against error, for each stage.
#define _GNU_SOURCE
#include "core/log.h"
#include "tests/bench/bench_report.h"
#include <string.h>

struct args {
    bool quick, list;
    const char *out;
    int count, seed;
};

static const struct opt opts[] = {
    {"quick", OPT_FLAG, offsetof(struct args, quick), .help = "fewer and smaller settings"},
    {"list", OPT_FLAG, offsetof(struct args, list), .help = "name the benchmarks and stop"},
    {"count", OPT_INT, offsetof(struct args, count), "N", "0",
     "evaluations of `stability` (default: 2000000, quick 100000)"},
    {"seed", OPT_INT, offsetof(struct args, seed), "N", "1", "of its arguments"},
    {"o", OPT_FILE, offsetof(struct args, out), "FOLDER",
     .help = "write bench.html, bench.csv, bench.json and plots here"},
    {0},
};

static const struct bench *find(const char *name)
{
    for (const struct bench *const *b = bench_list; *b; b++)
        if (!strcmp((*b)->name, name))
            return *b;
    return NULL;
}

static bool wanted(const struct cli *cli, const struct bench *b)
{
    for (int k = 0; k < cli->n; k++)
        if (!strcmp(cli->operand[k], b->name))
            return true;
    return cli->n == 0;
}

static bool run(const void *args_, struct cli *cli, struct err *e)
{
    const struct args *args = args_;
    for (int k = 0; k < cli->n; k++)
        if (!find(cli->operand[k]))
            return err_set(e, ERR_USAGE, "no benchmark '%s'; nacre bench --list names them",
                           cli->operand[k]);
    if (args->list) {
        for (const struct bench *const *b = bench_list; *b; b++)
            doc_text(cli->doc, (*b)->name, (*b)->summary);
        return true;
    }
    if (args->count < 0 || args->seed < 0)
        return err_set(e, ERR_DATA, "--count and --seed must be 0 or more");
    struct bench_report *r = bench_report_new(args->quick, args->count, (uint64_t)args->seed);
    bool ok = true;
    for (const struct bench *const *b = bench_list; ok && *b; b++)
        if (wanted(cli, *b)) {
            bench_report_begin(r, *b);
            ok = (*b)->run(r, e) || err_in(e, "%s", (*b)->name);
            bench_report_end(r);
        }
    if (ok && args->out)
        ok = bench_report_write(r, args->out, e);
    if (ok && cli->json)
        bench_report_doc(r, cli->doc);
    bench_report_free(r);
    return ok;
}

const struct command cmd_bench = {
    .name = "bench",
    .summary = "measure run time against error, stage by stage",
    .operands = "[NAME...]",
    .max_operands = 50,
    .opts = opts,
    .args_size = sizeof(struct args),
    .notes = "The tables go to stderr, --json puts all rows on stdout.",
    .run = run,
};

// cli.c - finds the command, fills its struct from its option table, runs it.
#define _GNU_SOURCE
#include "ui/cli.h"
#include "core/log.h"
#include "core/mem.h"
#include "ui/cli_help.h"
#include "ui/doc.h"
#include "ui/provenance.h"
#include "ui/words.h"
#include <limits.h>
#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

struct global {
    bool help, json, quiet, no_color;
    int threads;
};

const struct opt cli_global_opts[] = {
    {"help", OPT_FLAG, offsetof(struct global, help), .help = "show this text"},
    {"json", OPT_FLAG, offsetof(struct global, json), .help = "print one JSON document on stdout"},
    {"threads", OPT_INT, offsetof(struct global, threads), "N", "0",
     "processor cores to use, 0 for all"},
    {"quiet", OPT_FLAG, offsetof(struct global, quiet),
     .help = "no notes and no progress, only errors"},
    {"no-color", OPT_FLAG, offsetof(struct global, no_color),
     .help = "plain text (also: NO_COLOR=1)"},
    {0},
};

static const struct opt *find_opt(const struct opt *opts, const char *name, size_t len)
{
    for (; opts && opts->name; opts++)
        if (strlen(opts->name) == len && !strncmp(opts->name, name, len))
            return opts;
    return NULL;
}

static bool is_choice(const char *choices, const char *text)
{
    const size_t len = strlen(text);
    for (const char *s = choices; len; s++) {
        const char *end = strchrnul(s, '|');
        if ((size_t)(end - s) == len && !strncmp(s, text, len))
            return true;
        if (!*(s = end))
            return false;
    }
    return false;
}

static bool store(void *args, const struct opt *o, const char *text, struct err *e)
{
    void *to = (char *)args + o->at;
    double value;
    switch (o->kind) {
    case OPT_FLAG: *(bool *)to = true; return true;
    case OPT_CHOICE:
        if (!is_choice(o->arg, text))
            return err_set(e, ERR_USAGE, "--%s: '%.60s' is not one of %s", o->name, text, o->arg);
        *(const char **)to = text;
        return true;
    case OPT_TEXT:
    case OPT_FILE:
    case OPT_LIST: *(const char **)to = text; return true;
    case OPT_INT: {
        char *end;
        const long n = strtol(text, &end, 10);
        if (end == text || *end || n < INT_MIN || n > INT_MAX)
            return err_set(e, ERR_USAGE, "--%s: '%.60s' is not a whole number", o->name, text);
        *(int *)to = (int)n;
        return true;
    }
    case OPT_NUM:
        if (!quantity_parse(text, o->unit, &value, e))
            return err_in(e, "--%s", o->name);
        *(double *)to = value;
        return true;
    }
    return false;
}

static bool set_defaults(void *args, const struct opt *opts, struct err *e)
{
    for (const struct opt *o = opts; o && o->name; o++) {
        if (o->kind == OPT_NUM && !o->def)
            *(double *)((char *)args + o->at) = NAN;
        if (o->def && !store(args, o, o->def, e))
            return false;
    }
    return true;
}

// A dash and a digit is a negative number, not an option.
static bool is_option(const char *a)
{
    return a[0] == '-' && a[1] && !strchr("0123456789.", a[1]);
}

const struct verb *cli_verb(const struct command *cmd, const char *operand)
{
    for (const struct verb *v = cmd->verbs; v && v->name; v++)
        if (!strcmp(v->name, operand))
            return v;
    return NULL;
}

static bool parse(int argc, char **argv, const struct command *cmd, void *args, struct global *g,
                  struct cli *cli, struct err *e)
{
    bool given[64] = {0}, only_operands = false;
    for (int k = 0; k < argc; k++) {
        char *a = argv[k];
        if (only_operands || !is_option(a)) {
            cli->operand[cli->n++] = a;
            continue;
        }
        if (!strcmp(a, "--")) {
            only_operands = true;
            continue;
        }
        const char *name = a + 1 + (a[1] == '-');
        const char *equals = strchr(name, '=');
        const size_t len = equals ? (size_t)(equals - name) : strlen(name);
        const struct opt *o = find_opt(cmd->opts, name, len);
        void *into = args;
        if (!o) {
            o = find_opt(cli_global_opts, name, len);
            into = g;
        }
        if (!o)
            return err_set(e, ERR_USAGE, "unknown option %s; see %s%s --help", a, cli_prefix(cmd),
                           cmd->name);
        const char *value = equals ? equals + 1 : NULL;
        if (o->kind == OPT_FLAG && value)
            return err_set(e, ERR_USAGE, "--%s takes no value", o->name);
        if (o->kind != OPT_FLAG && !value) {
            if (k + 1 >= argc)
                return err_set(e, ERR_USAGE, "%s needs a value: %s", a, o->arg ? o->arg : "VALUE");
            value = argv[++k];
        }
        if (!store(into, o, value, e))
            return false;
        if (into == args)
            given[o - cmd->opts] = true;
    }
    if (g->help)
        return true;
    const struct verb *verb = cli->n ? cli_verb(cmd, cli->operand[0]) : NULL;
    for (const struct opt *o = cmd->opts; o && o->name; o++)
        if (given[o - cmd->opts] && !cli_opt_is_of(o, verb))
            return err_set(e, ERR_USAGE, "%s%s is not an option of %s; see nacre %s %s --help",
                           o->name[1] ? "--" : "-", o->name, verb->name, cmd->name, verb->name);
    for (const struct opt *o = cmd->opts; o && o->name; o++)
        if (o->needed && !given[o - cmd->opts])
            return err_set(e, ERR_USAGE, "needs %s%s %s; see %s%s --help", o->name[1] ? "--" : "-",
                           o->name, o->arg ? o->arg : "", cli_prefix(cmd), cmd->name);
    if (cli->n < cmd->min_operands)
        return err_set(e, ERR_USAGE, "needs %s; see %s%s --help", cmd->operands, cli_prefix(cmd),
                       cmd->name);
    if (cli->n > cmd->max_operands)
        return err_set(e, ERR_USAGE, "'%s' is one operand too many; see %s%s --help",
                       cli->operand[cmd->max_operands], cli_prefix(cmd), cmd->name);
    if (g->threads < 0)
        return err_set(e, ERR_USAGE, "--threads: must be 0 or more");
    return true;
}

// The words that the command parses begin at argv[skip].
static int run(const struct command *cmd, int argc, char **argv, int skip)
{
    struct err e = {0};
    struct global g = {0};
    char *line = words_join(argc, argv);
    struct cli cli = {.command = cmd->name, .line = line};
    struct provenance *made = NULL;
    void *args = xcalloc(1, cmd->args_size);
    cli.operand = xcalloc((size_t)argc, sizeof *cli.operand);
    cli.doc = doc_new();
    bool ok = set_defaults(args, cmd->opts, &e) &&
              parse(argc - skip, argv + skip, cmd, args, &g, &cli, &e);
    if (ok && g.help) {
        cli_help_command(cmd, cli.n ? cli_verb(cmd, cli.operand[0]) : NULL, stdout);
    } else if (ok) {
        log_quiet = g.quiet;
        log_no_color = g.no_color || getenv("NO_COLOR");
        cli.json = g.json;
        cli.threads = g.threads;
        if (g.threads)
            omp_set_num_threads(g.threads);
        ok = provenance_begin(&made, cmd, args, &cli, argc, argv, &e) && cmd->run(args, &cli, &e);
        ok = provenance_end(made, ok, &e) && ok;
        if (ok || e.code == ERR_PARTIAL)
            doc_print(cli.doc, g.json, stdout);
        if (fflush(stdout))
            ok = err_errno(&e, "stdout");
    }
    if (!ok)
        log_error("%s: %s", cmd->name, e.msg);
    doc_free(cli.doc);
    free(cli.operand);
    free(args);
    free(line);
    return ok ? 0 : (int)e.code;
}

static const struct command *find_command(const struct command *const commands[], const char *name)
{
    for (const struct command *const *c = commands; *c; c++)
        if (!strcmp((*c)->name, name))
            return *c;
    return NULL;
}

static int man(const struct command *const commands[], const char *name)
{
    const struct command *cmd = name ? find_command(commands, name) : NULL;
    if (cmd)
        cli_man_command(cmd, stdout);
    else if (!name)
        cli_man(commands, stdout);
    else
        log_error("man: no command '%s'; nacre --help lists them", name);
    return cmd || !name ? 0 : ERR_USAGE;
}

int cli_main(int argc, char **argv, const struct command *const commands[])
{
    const char *name = argc > 1 ? argv[1] : "--help";
    const struct command *cmd = find_command(commands, name);
    if (cmd)
        return run(cmd, argc, argv, 2);
    if (!strcmp(name, "--help") || !strcmp(name, "help") || !strcmp(name, "-h")) {
        cli_help(commands, stdout);
        return argc > 1 ? 0 : ERR_USAGE;
    }
    if (!strcmp(name, "--version")) {
        puts("nacre " NACRE_VERSION);
        return 0;
    }
    if (!strcmp(name, "completion")) {
        cli_completion(commands, stdout);
        return 0;
    }
    if (!strcmp(name, "man"))
        return man(commands, argc > 2 ? argv[2] : NULL);
    log_error("unknown command '%s'; nacre --help lists them", name);
    return ERR_USAGE;
}

bool cli_degrees(const char *text, double *rad, struct err *e)
{
    char *end;
    const double degrees = strtod(text, &end);
    if (end == text || *end || !isfinite(degrees))
        return quantity_parse(text, UNIT_RAD, rad, e);
    *rad = degrees * M_PI / 180;
    return true;
}

int cli_program(int argc, char **argv, const struct command *cmd)
{
    if (argc == 2 && !strcmp(argv[1], "--version")) {
        printf("%s " NACRE_VERSION "\n", cmd->name);
        return 0;
    }
    if (argc == 2 && !strcmp(argv[1], "--completion")) {
        cli_completion_program(cmd, stdout);
        return 0;
    }
    if (argc == 2 && !strcmp(argv[1], "--man")) {
        cli_man_command(cmd, stdout);
        return 0;
    }
    return run(cmd, argc, argv, 1);
}

int cli_numbers(const char *text, enum unit unit, double *out, int max, struct err *e)
{
    char *copy = xstrdup(text), *save = NULL;
    int n = 0;
    bool ok = *text != 0;
    for (char *t = strtok_r(copy, ",", &save); ok && t; t = strtok_r(NULL, ",", &save)) {
        ok = n < max ? quantity_parse(t, unit, &out[n], e)
                     : err_set(e, ERR_USAGE, "'%.60s' has more than %d values", text, max);
        n += ok;
    }
    if (ok && !n)
        ok = err_set(e, ERR_USAGE, "'%.60s' holds no value", text);
    free(copy);
    if (!*text)
        err_set(e, ERR_USAGE, "an empty list");
    return ok ? n : -1;
}

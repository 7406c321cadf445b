// cli_man.c - manual pages, made from the option tables as --help is.
#define _GNU_SOURCE
#include "ui/cli_help.h"
#include <ctype.h>
#include <string.h>

// Text as roff shows it unchanged; a line of its own must not begin as a request does.
static void put(const char *text, FILE *to)
{
    bool at_start = true;
    for (const char *s = text; *s; s++) {
        if (at_start && (*s == '.' || *s == '\''))
            fputs("\\&", to);
        if (*s == '\\')
            fputs("\\e", to);
        else if (*s == '-')
            fputs("\\-", to);
        else
            fputc(*s, to);
        at_start = *s == '\n';
    }
}

static void title(const char *prefix, const char *name, const char *summary, FILE *to)
{
    fputs(".TH ", to);
    for (const char *part = prefix; part; part = part == prefix ? name : NULL)
        for (const char *s = part; *s; s++)
            fputc(toupper((unsigned char)*s), to);
    fputs(" 1 \"\" \"nacre " NACRE_VERSION "\" \"nacre\"\n.SH NAME\n", to);
    put(prefix, to);
    put(name, to);
    fputs(" \\- ", to);
    put(summary, to);
    fputc('\n', to);
}

static void usage(const char *words, const char *operands, FILE *to)
{
    fputs(".B ", to);
    put(words, to);
    fputc('\n', to);
    put(operands, to);
    fputs(*operands ? " [options]\n" : "[options]\n", to);
}

static void options(const struct opt *opts, const struct verb *verb, FILE *to)
{
    for (; opts && opts->name; opts++) {
        if (!cli_opt_is_of(opts, verb))
            continue;
        fprintf(to, ".TP\n\\fB%s", opts->name[1] ? "\\-\\-" : "\\-");
        put(opts->name, to);
        fputs("\\fR", to);
        if (*cli_opt_value(opts)) {
            fputs(" \\fI", to);
            put(cli_opt_value(opts), to);
            fputs("\\fR", to);
        }
        fputc('\n', to);
        put(opts->help, to);
        if (opts->needed)
            fputs(" (needed)", to);
        if (cli_opt_default(opts)) {
            fputs(" [", to);
            put(cli_opt_default(opts), to);
            fputc(']', to);
        }
        fputc('\n', to);
    }
}

static void verbs(const struct command *cmd, FILE *to)
{
    for (const struct verb *v = cmd->verbs; v->name; v++) {
        fputs(".SS ", to);
        put(v->name, to);
        fputc('\n', to);
        put(v->summary, to);
        fputs(".\n.PP\n", to);
        char words[80];
        snprintf(words, sizeof words, "nacre %s %s", cmd->name, v->name);
        usage(words, v->operands, to);
        options(cmd->opts, v, to);
    }
}

static void plain(const char *heading, const char *text, FILE *to)
{
    fprintf(to, ".SH %s\n.nf\n", heading);
    put(text, to);
    fputs("\n.fi\n", to);
}

static void ending(const char *see, FILE *to)
{
    plain("EXIT STATUS", "0  done\n2  usage\n3  bad data\n4  hardware\n5  file system\n6  partial",
          to);
    fprintf(to, ".SH SEE ALSO\n%s\n.br\nThe guides in /usr/share/doc/nacre.\n", see);
}

void cli_man_command(const struct command *cmd, FILE *to)
{
    const bool of_nacre = *cli_prefix(cmd);
    char words[80];
    snprintf(words, sizeof words, "%s%s", cli_prefix(cmd), cmd->name);
    title(of_nacre ? "nacre-" : "", cmd->name, cmd->summary, to);
    fputs(".SH SYNOPSIS\n", to);
    usage(words, cmd->verbs ? "VERB" : cmd->operands, to);
    if (cmd->verbs) {
        fputs(".SH VERBS\n", to);
        verbs(cmd, to);
    } else if (cmd->opts && cmd->opts->name) {
        fputs(".SH OPTIONS\n", to);
        options(cmd->opts, NULL, to);
    }
    fputs(".SH OPTIONS OF EVERY COMMAND\n", to);
    options(cli_global_opts, NULL, to);
    if (cmd->notes)
        plain("NOTES", cmd->notes, to);
    ending(".BR nacre (1)", to);
}

void cli_man(const struct command *const commands[], FILE *to)
{
    title("", "nacre", "measure how a surface diffracts light, and see it rendered", to);
    fputs(".SH SYNOPSIS\n", to);
    usage("nacre", "COMMAND [operands]", to);
    fputs(".SH COMMANDS\n", to);
    for (const struct command *const *c = commands; *c; c++) {
        fputs(".TP\n.BR nacre\\-", to);
        put((*c)->name, to);
        fputs(" (1)\n", to);
        put((*c)->summary, to);
        fputc('\n', to);
    }
    fputs(".SH QUANTITIES\nQuantities carry units (530nm, 0.25um, 13deg, 1/60s); bare numbers are "
          "SI.\n.SH ENVIRONMENT\n.TP\n.B NACRE_DATA\nthe folder that holds rigs/\n.TP\n"
          ".B NACRE_SOCKET\nwhere nacred listens\n.TP\n.B NO_COLOR\nplain text\n",
          to);
    ending(".BR nacred (8), \" nacre\\-lights\" (8), \" nacre\\-view\" (1)", to);
}

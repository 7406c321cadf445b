// cli_help.c - --help and bash completion, made from the option tables so that they cannot drift.
#define _GNU_SOURCE
#include "ui/cli_help.h"
#include "core/mem.h"
#include <stdlib.h>
#include <string.h>

// Is the word one of a list's, which blanks part?
static bool is_of(const char *list, const char *word)
{
    const size_t n = strlen(word);
    for (const char *at = list; (at = strstr(at, word)); at += n)
        if ((at == list || at[-1] == ' ') && (!at[n] || at[n] == ' '))
            return true;
    return false;
}

bool cli_opt_is_of(const struct opt *o, const struct verb *verb)
{
    return !verb || !o->verbs || is_of(o->verbs, verb->name);
}

const char *cli_opt_value(const struct opt *o)
{
    return o->kind == OPT_FLAG ? "" : o->arg ? o->arg : "VALUE";
}

const char *cli_opt_default(const struct opt *o)
{
    return !o->needed && o->def && strcmp(o->def, "0") ? o->def : NULL;
}

static void print_opts(const struct opt *opts, const struct verb *verb, FILE *to)
{
    for (; opts && opts->name; opts++) {
        if (!cli_opt_is_of(opts, verb))
            continue;
        const char *value = cli_opt_value(opts), *def = cli_opt_default(opts);
        char *left =
            xasprintf("%s%s%s%s", opts->name[1] ? "--" : "-", opts->name, *value ? " " : "", value);
        fprintf(to, strlen(left) > 26 ? "  %s\n%30s" : "  %-28s", left, "");
        free(left);
        fputs(opts->help, to);
        if (opts->needed)
            fputs(" (needed)", to);
        else if (def)
            fprintf(to, " [%s]", def);
        fputc('\n', to);
    }
}

const char *cli_prefix(const struct command *cmd)
{
    return strncmp(cmd->name, "nacre-", 6) ? "nacre " : "";
}

// The examples of a verb: the lines of the notes that run it, with those they are continued on.
static void print_examples(const struct command *cmd, const struct verb *verb, FILE *to)
{
    char *start = xasprintf("  nacre %s %s ", cmd->name, verb->name);
    bool any = false, goes_on = false;
    for (const char *line = cmd->notes; line && *line;) {
        const size_t n = strcspn(line, "\n");
        if (goes_on || !strncmp(line, start, strlen(start))) {
            fprintf(to, "%s%.*s\n", any ? "" : "\n", (int)n, line);
            any = true;
            goes_on = n && line[n - 1] == '\\';
        }
        line += n + (line[n] != 0);
    }
    free(start);
}

void cli_help_command(const struct command *cmd, const struct verb *verb, FILE *to)
{
    const char *blank = verb ? " " : "", *name = verb ? verb->name : "";
    const char *operands = verb ? verb->operands : cmd->operands;
    const char *prefix = cli_prefix(cmd);
    fprintf(to, "%s%s%s%s - %s\n\nusage: %s%s%s%s%s%s [options]\n", prefix, cmd->name, blank, name,
            verb ? verb->summary : cmd->summary, prefix, cmd->name, blank, name,
            *operands ? " " : "", operands);
    if (!verb && cmd->verbs) {
        fputc('\n', to);
        size_t wide = 0;
        for (const struct verb *v = cmd->verbs; v->name; v++)
            wide = strlen(v->operands) > wide ? strlen(v->operands) : wide;
        for (const struct verb *v = cmd->verbs; v->name; v++)
            fprintf(to, "  %-9s %-*s  %s\n", v->name, (int)wide, v->operands, v->summary);
        fprintf(to, "\nnacre %s VERB --help tells the options of one.\n", cmd->name);
    }
    if (cmd->opts && cmd->opts->name && (verb || !cmd->verbs)) {
        fputs("\noptions\n", to);
        print_opts(cmd->opts, verb, to);
    }
    fputs("\neverywhere\n", to);
    print_opts(cli_global_opts, NULL, to);
    if (verb)
        print_examples(cmd, verb, to);
    else if (cmd->notes)
        fprintf(to, "\n%s\n", cmd->notes);
}

void cli_help(const struct command *const commands[], FILE *to)
{
    fputs("nacre " NACRE_VERSION " - measure how a surface diffracts light, and see it rendered\n\n"
          "usage: nacre COMMAND [operands] [options]\n\n",
          to);
    for (const struct command *const *c = commands; *c; c++)
        fprintf(to, "  %-12s %s\n", (*c)->name, (*c)->summary);
    fputs("  completion   print the bash completion script\n"
          "  man          print a command's manual page: nacre man lut | man -l -\n\n"
          "nacre COMMAND --help tells the options. Quantities carry units (530nm, 0.25um, 13deg, "
          "1/60s);\n"
          "bare numbers are SI. Exit: 0 done, 2 usage, 3 bad data, 4 hardware, 5 file system, 6 "
          "partial.\n",
          to);
}

static void print_words(const struct opt *opts, FILE *to)
{
    for (; opts && opts->name; opts++)
        fprintf(to, "%s%s ", opts->name[1] ? "--" : "-", opts->name);
}

void cli_completion(const struct command *const commands[], FILE *to)
{
    fputs("# bash completion for nacre: source <(nacre completion)\n_nacre() {\n"
          "    local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} opts=\n"
          "    if [ \"$COMP_CWORD\" = 1 ]; then\n        COMPREPLY=($(compgen -W \"",
          to);
    for (const struct command *const *c = commands; *c; c++)
        fprintf(to, "%s ", (*c)->name);
    fputs("completion man\" -- \"$cur\"))\n        return\n    fi\n    case \"${COMP_WORDS[1]} "
          "$prev\" "
          "in\n",
          to);
    for (const struct command *const *c = commands; *c; c++)
        for (const struct opt *o = (*c)->opts; o && o->name; o++)
            if (o->kind == OPT_CHOICE) {
                fprintf(to, "    '%s --%s') COMPREPLY=($(compgen -W \"", (*c)->name, o->name);
                for (const char *s = o->arg; *s; s++)
                    fputc(*s == '|' ? ' ' : *s, to);
                fputs("\" -- \"$cur\")); return;;\n", to);
            }
    fputs("    esac\n    case \"${COMP_WORDS[1]}\" in\n", to);
    for (const struct command *const *c = commands; *c; c++) {
        fprintf(to, "    %s) opts=\"", (*c)->name);
        print_words((*c)->opts, to);
        fputs("\";;\n", to);
    }
    fputs("    esac\n    if [[ $cur == -* ]]; then\n        COMPREPLY=($(compgen -W \"$opts ", to);
    print_words(cli_global_opts, to);
    fputs("\" -- \"$cur\"))\n    else\n        COMPREPLY=($(compgen -f -- \"$cur\"))\n    fi\n}\n"
          "complete -o filenames -F _nacre nacre\n",
          to);
}

void cli_completion_program(const struct command *cmd, FILE *to)
{
    fprintf(to,
            "# bash completion for %s: source <(%s --completion)\n"
            "complete -o filenames -f -W \"",
            cmd->name, cmd->name);
    print_words(cmd->opts, to);
    print_words(cli_global_opts, to);
    fprintf(to, "\" %s\n", cmd->name);
}

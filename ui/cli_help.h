// cli_help.h - what the option tables say to people and shells.
#pragma once
#include "ui/cli.h"

extern const struct opt cli_global_opts[];

void cli_help(const struct command *const commands[], FILE *to);
void cli_help_command(const struct command *cmd, const struct verb *verb, FILE *to); // NULL: all
const char *cli_opt_value(const struct opt *o);   // what its value is called, "" for a flag
const char *cli_opt_default(const struct opt *o); // worth telling, else NULL
bool cli_opt_is_of(const struct opt *o, const struct verb *verb);
void cli_completion(const struct command *const commands[], FILE *to); // a bash script
void cli_completion_program(const struct command *cmd, FILE *to);      // of one that stands alone
void cli_man(const struct command *const commands[], FILE *to);        // the page nacre(1), roff
void cli_man_command(const struct command *cmd, FILE *to);             // nacre-COMMAND(1)

// What is typed before a command's name: "nacre ", or "" for a program of its own.
const char *cli_prefix(const struct command *cmd);

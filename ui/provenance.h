// provenance.h - what a command makes from a session is written down in that session's ledger.
//
// A product is the file that -o names: in a session's products/, or elsewhere when the command
// reads a session. In the first case the command runs as if it had been typed in the session's
// folder: the paths that it writes into the file are relative to that, so that the same command
// makes the same bytes wherever the session lies.
#pragma once
#include "ui/cli.h"

// A variable of the environment: where the file that -o names shall really be written. Nothing is
// recorded then, and only errors are said.
#define PROVENANCE_INSTEAD "NACRE_OUTPUT_INSTEAD"

struct provenance;

// After the command line was understood; may change words of args and cli, the working folder and
// cli->line. *p is to be ended, also after a failure.
bool provenance_begin(struct provenance **p, const struct command *cmd, void *args, struct cli *cli,
                      int argc, char **argv, struct err *e);
// `done`: the command did its work. Records its product; frees p, which may be NULL.
bool provenance_end(struct provenance *p, bool done, struct err *e);

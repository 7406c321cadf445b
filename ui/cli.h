// cli.h - the command line as data: one table per command makes the parser, --help and completion.
//
// A command's options are a table of struct opt that fills a struct of the command's own.
// Rule for exit codes: what cannot be understood is 2 (ERR_USAGE), what is understood but
// impossible is 3.
#pragma once
#include "core/err.h"
#include "core/units.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

enum opt_kind {
    OPT_FLAG,   // bool
    OPT_TEXT,   // const char *
    OPT_FILE,   // const char *, completes to files
    OPT_INT,    // int
    OPT_NUM,    // double, SI, in `unit`
    OPT_CHOICE, // const char *, one of arg "a|b|c"
    OPT_LIST,   // const char *, comma-separated; the command takes it apart (cli_numbers)
};

struct opt {
    const char *name; // without the dashes; one letter means -x
    enum opt_kind kind;
    size_t at;       // offsetof in the command's struct
    const char *arg; // how --help calls the value; for OPT_CHOICE the choices
    const char *def; // default as text, parsed like an argument; NULL: zero, false, NAN for OPT_NUM
    const char *help;
    enum unit unit; // OPT_NUM
    bool needed;
    const char *verbs; // "lens board": of these verbs alone; NULL: of all
};

// What a command can do, named by its first operand.
struct verb {
    const char *name, *operands, *summary;
};

struct doc; // the result: printed as aligned lines, or as one JSON document under --json

struct cli {
    const char *command; // "lut"
    int n;               // operands
    char **operand;
    bool json;
    int threads; // 0: all cores; already told to OpenMP
    struct doc *doc;
    const char *line; // the whole command line, for provenance
};

struct command {
    const char *name, *summary; // "nacre-view": a program of its own, else "nacre NAME"
    const char *operands; // "PATTERN", "IMAGE...", "" for none, "[NAME...]"
    int min_operands, max_operands;
    const struct opt *opts; // ends with a zeroed one; -o is an option like any other
    size_t args_size;
    const char *notes;        // behind the options in --help; examples
    const struct verb *verbs; // ends with a zeroed one; NULL: the first operand is an operand
    bool (*run)(const void *args, struct cli *cli, struct err *e);
};

// The verb that the first operand names; NULL when the command has none or not that one.
const struct verb *cli_verb(const struct command *cmd, const char *operand);

// Programs call this from main(): finds the command, parses, runs, prints error or document.
int cli_main(int argc, char **argv, const struct command *const commands[]);
// The same for a program that is one command, whose name is the program's.
int cli_program(int argc, char **argv, const struct command *cmd);

// "1,2.5,3" (each with a unit) into out[0..max): count, or -1 with ERR_USAGE.
int cli_numbers(const char *text, enum unit unit, double *out, int max, struct err *e);

// An angle in which a bare number is degrees ("13", "13deg", "0.2rad"); ERR_USAGE.
bool cli_degrees(const char *text, double *rad, struct err *e);

// Results. Keys may hold dots to nest ("error.l2"); each call prints in order.
void doc_num(struct doc *d, const char *key, double value); // NAN becomes null
void doc_int(struct doc *d, const char *key, long value);
void doc_bool(struct doc *d, const char *key, bool value);
void doc_text(struct doc *d, const char *key, const char *value);
void doc_nums(struct doc *d, const char *key, const double *value, int n);
// Append an object to the list `key`; fill it with the calls above. Lives as long as the document.
struct doc *doc_item(struct doc *d, const char *key);
void doc_list(struct doc *d, const char *key); // an empty list, when nothing is appended later

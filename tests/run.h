// run.h - runs the built nacre as a user would and keeps what it said.
#pragma once
#include "tests/test.h"
#include <sys/wait.h>

struct run {
    int status;
    char out[16384], err[8192];
};

// "nacre <words>" through the shell, in the current folder; no terminal, stdin empty.
static inline struct run run_nacre(const char *words)
{
    struct run r = {0};
    char line[4096];
    snprintf(line, sizeof line, "%s/nacre %s >run.out 2>run.err </dev/null", BIN_DIR, words);
    const int status = system(line);
    r.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    FILE *f = fopen("run.out", "r");
    r.out[f ? fread(r.out, 1, sizeof r.out - 1, f) : 0] = 0;
    if (f)
        fclose(f);
    f = fopen("run.err", "r");
    r.err[f ? fread(r.err, 1, sizeof r.err - 1, f) : 0] = 0;
    if (f)
        fclose(f);
    return r;
}

static inline int count_lines(const char *text)
{
    int n = 0;
    for (; *text; text++)
        n += *text == '\n';
    return n;
}

// Lines that tell of an error; notes may stand before them.
static inline int count_errors(const char *text)
{
    int n = !strncmp(text, "nacre: ", 7);
    while ((text = strstr(text, "\nnacre: "))) {
        n++;
        text++;
    }
    return n;
}

// A run that must succeed.
static inline struct run do_run(const char *words)
{
    const struct run r = run_nacre(words);
    if (r.status)
        fail_msg("nacre %s: %s", words, r.err);
    return r;
}

// A run that must end with this status and one error that holds the sentence.
static inline void assert_refuses(const char *words, int status, const char *sentence)
{
    const struct run r = run_nacre(words);
    if (r.status != status || !strstr(r.err, sentence) || count_errors(r.err) != 1)
        fail_msg("nacre %s: exit %d, '%s' lacks '%s'", words, r.status, r.err, sentence);
}

// A folder of the test's own below the build tree, made empty and entered.
static inline void enter_scratch(const char *name)
{
    char line[1200];
    snprintf(line, sizeof line, "rm -rf %s/../scratch/%s && mkdir -p %s/../scratch/%s", BIN_DIR,
             name, BIN_DIR, name);
    assert_int_equal(system(line), 0);
    snprintf(line, sizeof line, "%s/../scratch/%s", BIN_DIR, name);
    assert_int_equal(chdir(line), 0);
}

// report_library.h - what is known of every sample of a library, for its page and its table.
#pragma once
#include "core/err.h"

struct stage {
    const char *name, *file; // live with the list
    double seconds;          // wall time of the job that made it; NAN: not known
    double peak_mb;          // its resident memory; NAN: not known
    char *sha256, *command;  // as the card says; NULL: it does not
};

struct entry {
    const char *name;
    struct stage *stage; // [n_stages], the last one is the card
    int n_stages;
    bool done;          // it has its card
    const char *failed; // the stage that failed; NULL: done, or nothing failed yet
    char *reason;       // what it said last; NULL: nothing
    double error, tables_error, seconds, peak_mb; // NAN: not known
};

struct library {
    const char *title;
    struct entry *entry; // [n]
    int n, n_done;
};

const struct stage *entry_stage(const struct entry *s, const char *name); // NULL: it has none

// index.html and samples.csv in a folder; pictures and products are named relative to it.
bool library_write_page(const struct library *l, const char *folder, struct err *e);
bool library_write_csv(const struct library *l, const char *folder, struct err *e);

// err.h - how a function says that it failed, and how a program should react.
//
// A function that can fail returns bool and takes a struct err last. On failure its outputs are
// untouched and the error holds one line, outermost context first, that names the file, the reason
// and what would be right. An error is printed once, where it is handled. Threads: one err each.
#pragma once
#include <stdbool.h>

// The codes say how to react; their values are the exit codes of every program of nacre.
enum err_code {
    ERR_NONE = 0,
    ERR_USAGE = 2,   // the command line cannot be understood
    ERR_DATA = 3,    // understood, but the value or the file's content is impossible
    ERR_DEVICE = 4,  // a camera, light or filter failed or is missing
    ERR_FILE = 5,    // a file cannot be opened, read, written; no memory, no space
    ERR_PARTIAL = 6, // something was done and kept, but not all that was asked
};

struct err {
    enum err_code code;
    char msg[400];
};

// Sets the error; returns false, so that `return err_set(...)` is the failure path.
bool err_set(struct err *e, enum err_code code, const char *fmt, ...)
    __attribute__((format(printf, 3, 4)));

// Puts context in front of the message ("frames/3.dng: " + old); returns false.
bool err_in(struct err *e, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

// As err_set with ERR_FILE, with ": " and the text of errno behind; returns false.
bool err_errno(struct err *e, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

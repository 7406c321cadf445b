// infile.h - a file opened for reading, with its size: what a header claims can be judged by it.
//
// Messages do not name the file: the function that was given the path puts it in front.
#pragma once
#include "core/err.h"
#include <stdint.h>
#include <stdio.h>

struct infile {
    FILE *f;
    int64_t size; // bytes
};

// ERR_FILE when there is no such file, it cannot be read, or it is not a regular file.
bool infile_open(struct infile *in, const char *path, struct err *e);
void infile_close(struct infile *in); // accepts a zeroed struct

// The whole file with a zero byte behind it; free() it. ERR_FILE, also when over `max` bytes.
char *infile_slurp(const char *path, int64_t max, size_t *size, struct err *e);

// Refuses a header that asks for far more samples than a file of this size can hold under any
// compression in use, before memory is taken for them: ERR_DATA.
bool infile_claim(int64_t size, double samples, struct err *e);

// Exactly `need` bytes of samples stand behind what was read so far, or ERR_DATA.
bool infile_holds(const struct infile *in, double need, struct err *e);

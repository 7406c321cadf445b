// replay.c - runs a harness over the files of the folders it is given: the corpus as a test.
#define _GNU_SOURCE
#include "core/infile.h"
#include "tests/fuzz/fuzz.h"
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>

static int replay(const char *folder)
{
    struct dirent **entry;
    const int n = scandir(folder, &entry, NULL, alphasort);
    int done = 0;
    for (int k = 0; k < n; k++) {
        char path[4096];
        struct err e;
        size_t size;
        snprintf(path, sizeof path, "%s/%s", folder, entry[k]->d_name);
        char *data = *entry[k]->d_name == '.' ? NULL : infile_slurp(path, 1 << 20, &size, &e);
        if (data) {
            fprintf(stderr, "%s\n", entry[k]->d_name);
            LLVMFuzzerTestOneInput((const uint8_t *)data, size);
            for (size_t cut = 0; cut < size;
                 cut += 1 + size / 50) // and what is left when it is cut
                LLVMFuzzerTestOneInput((const uint8_t *)data, cut);
            done++;
        }
        free(data);
        free(entry[k]);
    }
    free(n >= 0 ? entry : NULL);
    return done;
}

int main(int argc, char **argv)
{
    int done = 0;
    for (int k = 1; k < argc; k++)
        done += replay(argv[k]);
    fprintf(stderr, "%d files replayed\n", done);
    return done ? EXIT_SUCCESS : EXIT_FAILURE;
}

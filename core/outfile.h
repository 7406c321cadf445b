// outfile.h - a file that appears whole or not at all.
//
// Write to outfile.tmp (same folder, same extension), then commit: fsync, rename, fsync the folder.
// outfile_drop() removes the temporary file; after a commit it does nothing, so it can always be
// called.
#pragma once
#include "core/err.h"
#include <stddef.h>

struct outfile {
    char *path; // the final name, owned
    char *tmp;  // where to write, owned; NULL after commit or drop
};

// ERR_FILE when the folder does not exist or is not writable.
bool outfile_open(struct outfile *o, const char *path, struct err *e);
bool outfile_commit(struct outfile *o, struct err *e);
void outfile_drop(struct outfile *o);

bool outfile_write(const char *path, const void *data, size_t size, struct err *e); // all at once

// datapath.c - shipped data, found from where the program lies.
#define _GNU_SOURCE
#include "core/datapath.h"
#include "core/mem.h"
#include <libgen.h>
#include <limits.h>
#include <stdlib.h>
#include <unistd.h>

char *self_path(void)
{
    char path[PATH_MAX];
    const ssize_t n = readlink("/proc/self/exe", path, sizeof path - 1);
    path[n > 0 ? n : 0] = 0;
    return xstrdup(path);
}

char *data_path(const char *name, struct err *e)
{
    char *self = self_path();
    const char *below = dirname(self), *given = getenv("NACRE_DATA");
    char *place[] = {given ? xasprintf("%s/%s", given, name) : NULL,
                     xasprintf("%s/../../%s", below, name),
                     xasprintf("%s/../share/nacre/%s", below, name)};
    char *found = NULL;
    for (int k = 0; k < 3; k++)
        if (place[k] && !found && !access(place[k], R_OK))
            found = realpath(place[k], NULL);
    if (!found)
        err_set(e, ERR_FILE, "%s: not found in %s nor in %s; set NACRE_DATA", name, place[1],
                place[2]);
    for (int k = 0; k < 3; k++)
        free(place[k]);
    free(self);
    return found;
}

char *data_file(const char *given)
{
    struct err ignored;
    char *shipped = access(given, F_OK) ? data_path(given, &ignored) : NULL;
    return shipped ? shipped : xstrdup(given);
}

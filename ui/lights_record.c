// lights_record.c - a file of two lines for every nacre-lights that runs: rig and run.
#define _GNU_SOURCE
#include "ui/lights_record.h"
#include "core/log.h"
#include "core/mem.h"
#include <dirent.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char prefix[] = "lights-";

static const char *folder(void)
{
    const char *path = getenv("RUNTIME_DIRECTORY");
    return path && *path ? path : NULL;
}

char *lights_record_begin(const char *rig, const char *run)
{
    char full[PATH_MAX];
    if (!folder() || !realpath(rig, full))
        return NULL;
    char *path = xasprintf("%s/%s%d", folder(), prefix, (int)getpid());
    FILE *f = fopen(path, "w");
    if (!f) {
        log_warn("%s: cannot be written: after a crash --off needs --rig", path);
        free(path);
        return NULL;
    }
    fprintf(f, "%s\n%s\n", full, run);
    fclose(f);
    return path;
}

void lights_record_end(char *record)
{
    if (record)
        unlink(record);
    free(record);
}

static bool read_line(FILE *f, char *line, int size)
{
    if (!fgets(line, size, f))
        return false;
    line[strcspn(line, "\n")] = 0;
    return true;
}

bool lights_record_each(bool (*call)(const char *rig, const char *run, struct err *e),
                        struct err *e)
{
    DIR *dir = folder() ? opendir(folder()) : NULL;
    bool ok = true;
    for (struct dirent *d; dir && (d = readdir(dir));) {
        char rig[PATH_MAX], run[256];
        if (strncmp(d->d_name, prefix, strlen(prefix)) != 0)
            continue;
        char *path = xasprintf("%s/%s", folder(), d->d_name);
        FILE *f = fopen(path, "r");
        const bool whole = f && read_line(f, rig, sizeof rig) && read_line(f, run, sizeof run);
        if (f)
            fclose(f);
        if (whole && !call(rig, run, e))
            ok = false;
        else
            unlink(path);
        free(path);
    }
    if (dir)
        closedir(dir);
    return ok;
}

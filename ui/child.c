// child.c - a command of nacre in a process of its own.
#define _GNU_SOURCE
#include "ui/child.h"
#include "core/datapath.h"
#include "core/log.h"
#include "core/mem.h"
#include <errno.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>
#include <wordexp.h>

extern char **environ;

static char *read_all(int fd)
{
    size_t n = 0, room = 4096;
    char *text = xcalloc(room, 1);
    for (ssize_t got; (got = read(fd, text + n, room - n - 1)) != 0;) {
        if (got < 0 && errno != EINTR)
            break;
        n += got > 0 ? (size_t)got : 0;
        if (n + 1 == room)
            text = xrealloc(text, room *= 2, 1);
    }
    text[n] = 0;
    return text;
}

bool child_run_in(const char *folder, const char *words, struct child *c, struct err *e)
{
    wordexp_t args = {.we_offs = 1}; // one place in front, for the program
    if (wordexp(words, &args, WRDE_DOOFFS | WRDE_NOCMD))
        return err_set(e, ERR_USAGE, "nacre %s: cannot be split into words", words);
    char *self = self_path(), **argv = args.we_wordv;
    argv[0] = self;
    int pipe_fd[2];
    bool ok = !pipe(pipe_fd) || err_errno(e, "pipe");
    if (ok) {
        posix_spawn_file_actions_t act;
        posix_spawn_file_actions_init(&act);
        posix_spawn_file_actions_adddup2(&act, pipe_fd[1], STDOUT_FILENO);
        posix_spawn_file_actions_addclose(&act, pipe_fd[0]);
        posix_spawn_file_actions_addclose(&act, pipe_fd[1]);
        posix_spawn_file_actions_addchdir_np(&act, folder);
        pid_t pid;
        const double start = now_s();
        const int failed = posix_spawn(&pid, self, &act, NULL, argv, environ);
        posix_spawn_file_actions_destroy(&act);
        close(pipe_fd[1]);
        if (failed) {
            errno = failed;
            ok = err_errno(e, "%s", self);
        } else {
            int status = 0;
            struct child got = {.out = read_all(pipe_fd[0])};
            waitpid(pid, &status, 0);
            got.wall_s = now_s() - start;
            got.status = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
            ok = WIFEXITED(status) ||
                 err_set(e, ERR_PARTIAL, "nacre %s: ended by signal %d", words, WTERMSIG(status));
            if (ok)
                *c = got;
            else
                child_finish(&got);
        }
        close(pipe_fd[0]);
    }
    argv[0] = NULL;
    wordfree(&args);
    free(self);
    return ok;
}

bool child_run(const char *words, struct child *c, struct err *e)
{
    return child_run_in(".", words, c, e);
}

bool child_do(const char *words, struct child *c, struct err *e)
{
    char *quiet = xasprintf("%s --json --quiet", words);
    struct child got = {0};
    bool ok = child_run(quiet, &got, e);
    if (ok && got.status)
        ok = err_set(e, (enum err_code)got.status, "nacre %s failed with exit code %d", words,
                     got.status);
    if (ok)
        *c = got;
    else
        child_finish(&got);
    free(quiet);
    return ok;
}

void child_finish(struct child *c)
{
    free(c->out);
    *c = (struct child){0};
}

// endpoint.c - finds or starts nacred.
#define _GNU_SOURCE
#include "acquire/endpoint.h"
#include "core/datapath.h"
#include "core/mem.h"
#include "core/sha256.h"
#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

static const char service[] = "/run/nacre/nacred.sock";
extern char **environ;

static char *daemon_program(void)
{
    char *self = self_path(), *path = xasprintf("%s/nacred", dirname(self));
    free(self);
    return path;
}

// A folder that only this user can write in: others must not be able to pose as nacred.
static char *runtime_folder(struct err *e)
{
    const char *xdg = getenv("XDG_RUNTIME_DIR");
    char *path =
        xdg && *xdg ? xasprintf("%s/nacre", xdg) : xasprintf("/tmp/nacre-%u", (unsigned)getuid());
    struct stat st;
    if (mkdir(path, 0700) && errno != EEXIST)
        err_errno(e, "%s", path);
    else if (lstat(path, &st) || !S_ISDIR(st.st_mode) || st.st_uid != getuid() || st.st_mode & 077)
        err_set(e, ERR_FILE, "%s: must be a folder that only you can use; set NACRE_SOCKET", path);
    else
        return path;
    free(path);
    return NULL;
}

char *endpoint_path(struct err *e)
{
    const char *given = getenv("NACRE_SOCKET");
    const bool own = given && !strcmp(given, "own");
    if (given && *given && !own)
        return xstrdup(given);
    if (!own && !access(service, W_OK))
        return xstrdup(service);
    char *folder = runtime_folder(e), *program = daemon_program();
    char *path = NULL;
    struct stat st = {0};
    if (folder) {
        char hex[SHA256_TEXT];
        stat(program, &st);
        char *identity = xasprintf("%s %lld %lld %ld", program, (long long)st.st_size,
                                   (long long)st.st_mtim.tv_sec, st.st_mtim.tv_nsec);
        sha256_of(identity, strlen(identity), hex);
        path = xasprintf("%s/nacred-%.12s.sock", folder, hex);
        free(identity);
    }
    free(folder);
    free(program);
    return path;
}

// -1 when nobody listens there, or (*hangs) who listens has not taken a client for so long.
static int try_connect(const char *path, bool *hangs)
{
    static const struct timeval patience = {.tv_sec = 10};
    struct sockaddr_un a = {.sun_family = AF_UNIX};
    *hangs = false;
    if (strlen(path) >= sizeof a.sun_path)
        return -1;
    strcpy(a.sun_path, path);
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd < 0)
        return -1;
    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience); // of connect, too
    if (!connect(fd, (struct sockaddr *)&a, sizeof a))
        return fd;
    *hangs = errno == EAGAIN;
    close(fd);
    return -1;
}

static bool start_daemon(const char *path, struct err *e)
{
    char *program = daemon_program(), *log = xasprintf("%s.log", path);
    char *args[] = {program,          (char *)"--socket", (char *)path,
                    (char *)"--idle", (char *)"5s",       NULL};
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attr;
    sigset_t none;
    pid_t pid;
    const char *terminal = ttyname(STDERR_FILENO); // where a person can be asked for filters
    if (terminal)
        setenv("NACRE_TTY", terminal, true);
    sigemptyset(&none);
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log, O_WRONLY | O_CREAT | O_TRUNC,
                                     0600);
    posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
    posix_spawnattr_init(&attr);
    posix_spawnattr_setflags(&attr, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSID);
    posix_spawnattr_setsigmask(&attr, &none);
    const int rc = posix_spawn(&pid, program, &files, &attr, args, environ);
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attr);
    if (rc)
        err_set(e, ERR_DEVICE, "%s: %s", program, strerror(rc));
    free(program);
    free(log);
    return rc == 0;
}

char *endpoint_file(const char *path)
{
    char cwd[PATH_MAX];
    return path[0] == '/' || !getcwd(cwd, sizeof cwd) ? xstrdup(path)
                                                      : xasprintf("%s/%s", cwd, path);
}

int endpoint_connect(struct err *e)
{
    enum { TRIES = 500, EACH_US = 20000 };
    bool hangs;
    char *path = endpoint_path(e);
    if (!path)
        return -1;
    int fd = try_connect(path, &hangs);
    if (fd < 0 && !hangs && start_daemon(path, e)) {
        for (int k = 0; fd < 0 && !hangs && k < TRIES; k++) {
            usleep(EACH_US);
            fd = try_connect(path, &hangs);
        }
        if (fd < 0 && !hangs)
            err_set(e, ERR_DEVICE, "nacred did not start; %s.log may say why", path);
    }
    if (hangs)
        err_set(e, ERR_DEVICE, "%s: nacred listens there but does not answer", path);
    free(path);
    return fd;
}

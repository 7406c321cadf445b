// server.c - accept, gather lines, send what fits, drop who does not keep up.
#define _GNU_SOURCE
#include "acquire/server.h"
#include "core/mem.h"
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

struct server_client {
    struct server *server;
    struct server_client *next;
    int fd;
    struct ucred who;
    struct loop_source *source;
    char *in, *out; // [n_in] of SERVER_LINE + 1; [n_out]
    size_t n_in, n_out;
    bool dead; // freed when no callback can be on it
};

struct server {
    struct loop *loop;
    struct loop_source *source, *reaper;
    int fd;
    struct server_calls calls;
    struct server_client *first;
};

static bool address(const char *path, struct sockaddr_un *a, struct err *e)
{
    *a = (struct sockaddr_un){.sun_family = AF_UNIX};
    if (strlen(path) >= sizeof a->sun_path)
        return err_set(e, ERR_FILE, "%s: too long for a socket's name", path);
    strcpy(a->sun_path, path);
    return true;
}

static bool is_living(const struct sockaddr_un *a)
{
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const bool living =
        fd >= 0 && (!connect(fd, (const struct sockaddr *)a, sizeof *a) || errno == EAGAIN);
    if (fd >= 0)
        close(fd);
    return living;
}

static int listen_at(const struct sockaddr_un *a, struct err *e)
{
    if (is_living(a)) {
        err_set(e, ERR_FILE, "%s: another nacred listens there", a->sun_path);
        return -1;
    }
    unlink(a->sun_path);
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const mode_t before = umask(0117);
    const bool ok = fd >= 0 && !bind(fd, (const struct sockaddr *)a, sizeof *a) && !listen(fd, 16);
    umask(before);
    if (ok)
        return fd;
    err_errno(e, "%s", a->sun_path);
    if (fd >= 0)
        close(fd);
    return -1;
}

// The file locked by us alone. Who holds it takes it away: it counts only while it is still there.
static int hold(const char *name, struct err *e)
{
    for (;;) {
        struct stat held, there;
        const int fd = open(name, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
        if (fd < 0 || flock(fd, LOCK_EX) || fstat(fd, &held)) {
            err_errno(e, "%s", name);
            if (fd >= 0)
                close(fd);
            return -1;
        }
        if (!stat(name, &there) && held.st_ino == there.st_ino && held.st_dev == there.st_dev)
            return fd;
        close(fd);
    }
}

// Two that start at the same time must not unlink each other's socket.
int server_listen(const char *path, struct err *e)
{
    struct sockaddr_un a;
    if (!address(path, &a, e))
        return -1;
    char *name = xasprintf("%s.lock", path);
    const int lock = hold(name, e), fd = lock < 0 ? -1 : listen_at(&a, e);
    if (lock >= 0) {
        unlink(name);
        close(lock);
    }
    free(name);
    return fd;
}

static void drop(struct server_client *c)
{
    if (c->dead)
        return;
    c->dead = true;
    loop_drop(c->source);
    close(c->fd);
    if (c->server->calls.gone)
        c->server->calls.gone(c->server->calls.ctx, c);
    loop_arm(c->server->reaper, 1); // at once, but not from inside a callback on it
}

static void reap(void *ctx)
{
    struct server *s = ctx;
    for (struct server_client **at = &s->first; *at;) {
        struct server_client *c = *at;
        if (!c->dead) {
            at = &c->next;
            continue;
        }
        *at = c->next;
        free(c->in);
        free(c->out);
        free(c);
    }
}

static void flush(struct server_client *c)
{
    while (c->n_out && !c->dead) {
        const ssize_t n = send(c->fd, c->out, c->n_out, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (n < 0 && (errno == EAGAIN || errno == EINTR))
            break;
        if (n < 0) {
            drop(c);
            return;
        }
        c->n_out -= (size_t)n;
        memmove(c->out, c->out + n, c->n_out);
    }
    if (!c->dead)
        loop_want_write(c->source, c->n_out > 0);
}

void server_send(struct server_client *c, const char *line)
{
    const size_t n = strlen(line);
    if (c->dead)
        return;
    if (c->n_out + n > SERVER_BACKLOG) {
        drop(c);
        return;
    }
    c->out = xrealloc(c->out, c->n_out + n, 1);
    memcpy(c->out + c->n_out, line, n);
    c->n_out += n;
    flush(c);
}

void server_send_fd(struct server_client *c, const char *line, int fd)
{
    union {
        struct cmsghdr align;
        char space[CMSG_SPACE(sizeof(int))];
    } control = {0};
    flush(c);
    if (c->dead)
        return;
    struct iovec part = {(void *)line, strlen(line)};
    struct msghdr m = {.msg_iov = &part,
                       .msg_iovlen = 1,
                       .msg_control = control.space,
                       .msg_controllen = sizeof control.space};
    struct cmsghdr *h = CMSG_FIRSTHDR(&m);
    h->cmsg_level = SOL_SOCKET;
    h->cmsg_type = SCM_RIGHTS;
    h->cmsg_len = CMSG_LEN(sizeof(int));
    memcpy(CMSG_DATA(h), &fd, sizeof fd);
    // A reader so far behind that not even this fits is dropped like any slow one.
    if (c->n_out || sendmsg(c->fd, &m, MSG_NOSIGNAL | MSG_DONTWAIT) != (ssize_t)part.iov_len)
        drop(c);
}

static void take_lines(struct server_client *c)
{
    char *start = c->in, *end;
    c->in[c->n_in] = 0;
    while (!c->dead && (end = memchr(start, '\n', c->n_in - (size_t)(start - c->in)))) {
        *end = 0;
        if (*start)
            c->server->calls.line(c->server->calls.ctx, c, start);
        start = end + 1;
    }
    c->n_in -= (size_t)(start - c->in);
    memmove(c->in, start, c->n_in);
}

static void ready(void *ctx)
{
    struct server_client *c = ctx;
    flush(c);
    while (!c->dead) {
        const ssize_t n = recv(c->fd, c->in + c->n_in, SERVER_LINE - c->n_in, MSG_DONTWAIT);
        if (n < 0 && (errno == EAGAIN || errno == EINTR))
            return;
        if (n <= 0) {
            drop(c);
            return;
        }
        c->n_in += (size_t)n;
        take_lines(c);
        if (c->n_in == SERVER_LINE)
            drop(c);
    }
}

static void knock(void *ctx)
{
    struct server *s = ctx;
    const int fd = accept4(s->fd, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0)
        return;
    struct ucred who = {.uid = (uid_t)-1};
    socklen_t size = sizeof who;
    if (server_clients(s) >= SERVER_CLIENTS ||
        getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &who, &size)) {
        close(fd);
        return;
    }
    struct server_client *c = xcalloc(1, sizeof *c);
    *c = (struct server_client){.server = s, .next = s->first, .fd = fd, .who = who};
    c->in = xcalloc(SERVER_LINE + 1, 1);
    c->source = loop_watch(s->loop, fd, ready, c);
    s->first = c;
}

struct server *server_new(struct loop *l, int listening, const struct server_calls *calls)
{
    struct server *s = xcalloc(1, sizeof *s);
    *s = (struct server){.loop = l, .fd = listening, .calls = *calls};
    s->source = loop_watch(l, listening, knock, s);
    s->reaper = loop_timer(l, reap, s);
    return s;
}

void server_free(struct server *s)
{
    if (!s)
        return;
    s->calls.gone = NULL;
    for (struct server_client *c = s->first; c; c = c->next)
        drop(c);
    reap(s);
    loop_drop(s->source);
    loop_drop(s->reaper);
    close(s->fd);
    free(s);
}

int server_clients(const struct server *s)
{
    int n = 0;
    for (const struct server_client *c = s->first; c; c = c->next)
        n += !c->dead;
    return n;
}

uid_t server_uid(const struct server_client *c)
{
    return c->who.uid;
}
pid_t server_pid(const struct server_client *c)
{
    return c->who.pid;
}

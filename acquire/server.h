// server.h - lines over a Unix socket: many clients, none of which can hold up the loop.
//
// A line longer than SERVER_LINE, a client too many, or a reader that lets more than SERVER_BACKLOG
// bytes pile up is dropped. Who may connect is the socket file's mode; SO_PEERCRED says who did.
#pragma once
#include "acquire/loop.h"
#include <sys/types.h>

enum { SERVER_LINE = 1 << 16, SERVER_BACKLOG = 1 << 20, SERVER_CLIENTS = 32 };

struct server;
struct server_client;

struct server_calls {
    void (*line)(void *ctx, struct server_client *from, const char *text);
    void (*gone)(void *ctx, struct server_client *client); // last chance to forget it
    void *ctx;
};

// Binds and listens; mode of the file 0660. A dead server's file is replaced, a living one refused.
int server_listen(const char *path, struct err *e); // -1 on failure

struct server *server_new(struct loop *l, int listening, const struct server_calls *calls);
void server_free(struct server *s); // closes the listening descriptor; accepts NULL

void server_send(struct server_client *c, const char *line);            // never blocks
void server_send_fd(struct server_client *c, const char *line, int fd); // with a descriptor
int server_clients(const struct server *s);
uid_t server_uid(const struct server_client *c);
pid_t server_pid(const struct server_client *c);

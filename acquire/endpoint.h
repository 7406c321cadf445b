// endpoint.h - where nacred listens, and how a program gets connected to it.
#pragma once
#include "core/err.h"

// NACRE_SOCKET; else the service's /run/nacre/nacred.sock when it is there (not with
// NACRE_SOCKET=own: the service cannot write to home folders); else a socket in this
// user's runtime folder that belongs to the very nacred beside this program, so that an old one
// that still runs is never talked to by a new client. Allocated; NULL when there is no safe folder.
char *endpoint_path(struct err *e);

// A path as nacred, which has its own working folder, can use it: absolute. The last part may not
// exist yet. Caller frees.
char *endpoint_file(const char *path);

// Connects; starts the nacred beside this program when none listens. A descriptor, or -1.
int endpoint_connect(struct err *e);

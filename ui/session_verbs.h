// session_verbs.h - what nacre session does beyond looking, one file each.
#pragma once
#include "core/session.h"
#include "ui/cli.h"

struct session_args {
    const char *out;
};

void session_describe_frame(const struct session_frame *f, struct doc *d);
void session_describe_state(const struct session_report *r, struct doc *d);

// A BagIt folder (RFC 8493): data/ with the session and its ledger as JSON, manifest-sha256.txt.
bool session_export(struct session *s, const struct session_args *a, struct cli *cli,
                    struct err *e);

// session_verbs.h - what nacre session does beyond looking, one file each.
#pragma once
#include "core/session.h"
#include "ui/cli.h"

struct session_args {
    const char *out;
    bool verify;
};

void session_describe_frame(const struct session_frame *f, struct doc *d);
void session_describe_state(const struct session_report *r, struct doc *d);

// The shots of metering: a list under "metering", when there are any.
bool session_describe_meterings(struct session *s, struct doc *d, struct err *e);
// What happened besides: a list under "history".
bool session_describe_history(struct session *s, struct doc *d, struct err *e);
// What commands have made from the session: a list under "products".
bool session_describe_products(struct session *s, struct doc *d, struct err *e);

// Makes every product once more by the command that made it: in its place, or (a->verify) in a
// scratch folder. ERR_PARTIAL names those that are not the same bytes, or cannot be made again from
// what they were made from.
bool session_replay(struct session *s, const struct session_args *a, struct cli *cli,
                    struct err *e);

// A BagIt folder (RFC 8493): data/ with the session and its ledger as JSON, manifest-sha256.txt.
bool session_export(struct session *s, const struct session_args *a, struct cli *cli,
                    struct err *e);

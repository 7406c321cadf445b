// ledger.h - the SQLite file of a session; use it through session.h.
//
// Journal in WAL mode with synchronous=FULL: a commit is one sync of the log, and readers never
// stop the writer. Statements are prepared once. One thread at a time.
#pragma once
#include "core/session.h"

struct ledger;

// Whole or not at all: under another name until it holds the first facts, key and value by turns.
bool ledger_create(struct ledger **l, const char *path, const char *const *fact, int n_facts,
                   struct err *e);
bool ledger_open(struct ledger **l, const char *path, enum session_mode mode, struct err *e);
void ledger_close(struct ledger *l); // accepts NULL

char *ledger_get(struct ledger *l, const char *key); // allocated; NULL: absent
bool ledger_set(struct ledger *l, const char *key, const char *value, struct err *e);
bool ledger_keys(struct ledger *l, const char *prefix, char ***key, int *n, struct err *e);
bool ledger_add_steps(struct ledger *l, const struct session_step *step, int n, bool final,
                      struct err *e);
bool ledger_add_frame(struct ledger *l, const struct session_frame *f, int64_t size, struct err *e);
bool ledger_revoke(struct ledger *l, int id, const char *verdict, const char *reason,
                   struct err *e);
bool ledger_revoke_group(struct ledger *l, int group, const char *verdict, const char *reason,
                         struct err *e);
bool ledger_note(struct ledger *l, int64_t boot_ns, const char *what, const char *text,
                 struct err *e);
bool ledger_history(struct ledger *l, struct session_event **event, int *n, struct err *e);
bool ledger_steps(struct ledger *l, struct session_step **step, int *n, struct err *e);
// `size` gets the files' sizes, [n], allocated; may be NULL.
enum ledger_which { LEDGER_GOOD, LEDGER_ALL, LEDGER_METERINGS }; // frames; ALL: of steps
bool ledger_frames(struct ledger *l, enum ledger_which which, struct session_frame **frame,
                   int64_t **size, int *n, struct err *e);
bool ledger_copy(struct ledger *l, const char *path, struct err *e);
int ledger_last_id(struct ledger *l);
bool ledger_check(struct ledger *l, struct err *e); // SQLite's own check of the file

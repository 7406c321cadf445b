// ledger.c - the tables of a session, and nothing of SQLite outside of here.
#define _GNU_SOURCE
#include "core/ledger.h"
#include "core/mem.h"
#include "core/outfile.h"
#include <math.h>
#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { LEDGER_FORMAT = 1 };

static const char schema[] =
    "create table fact(key text primary key, value text not null) without rowid;"
    "create table step(id integer primary key, grp integer not null, repeat integer not null,"
    " kind integer not null, light text not null, filter text not null,"
    " exposure_ns integer not null, gain real not null, focus_per_m real);"
    "create table frame(id integer primary key, step integer not null references step(id),"
    " attempt integer not null, seq integer not null, shot integer not null,"
    " device_ns integer, start_ns integer, arrived_ns integer, utc_ns integer,"
    " requested_ns integer, reported_ns integer, measured_ns integer, measured_sigma real,"
    " gain real, focus_per_m real, temperature_k real,"
    " light_on_ns integer, light_off_ns integer, w integer, h integer, black real, white integer,"
    " saturated real, path text not null, size integer not null, sha256 text not null,"
    " verdict text not null, reason text not null);"
    "create unique index proof on frame(step) where verdict = 'good';" // one proof a step
    "create table note(id integer primary key, boot_ns integer, what text, text text);";

static const char frame_columns[] =
    "f.id, f.step, f.attempt, f.seq, f.shot, f.device_ns, f.start_ns, f.arrived_ns, f.utc_ns,"
    " f.reported_ns, f.measured_ns, f.measured_sigma, f.gain, f.focus_per_m, f.temperature_k,"
    " f.light_on_ns, f.light_off_ns, f.w, f.h, f.black, f.white, f.saturated, f.path, f.sha256,"
    " f.verdict, f.reason, f.size, coalesce(s.grp, -1 - f.step), s.repeat, s.kind, s.light,"
    " s.filter, coalesce(s.exposure_ns, f.requested_ns), coalesce(s.gain, f.gain), s.focus_per_m";

struct ledger {
    sqlite3 *db;
    char *path;
    sqlite3_stmt *add_frame;
};

static bool fail(struct ledger *l, struct err *e)
{
    const int code = sqlite3_errcode(l->db);
    const bool bad = code == SQLITE_CORRUPT || code == SQLITE_NOTADB || code == SQLITE_ERROR;
    return err_set(e, bad ? ERR_DATA : ERR_FILE, "%s: %s", l->path, sqlite3_errmsg(l->db));
}

static bool exec(struct ledger *l, const char *sql, struct err *e)
{
    return sqlite3_exec(l->db, sql, NULL, NULL, NULL) == SQLITE_OK || fail(l, e);
}

static bool prepare(struct ledger *l, const char *sql, sqlite3_stmt **q, struct err *e)
{
    return sqlite3_prepare_v2(l->db, sql, -1, q, NULL) == SQLITE_OK || fail(l, e);
}

static bool finish(struct ledger *l, sqlite3_stmt *q, struct err *e) // runs a statement to its end
{
    const bool ok = sqlite3_step(q) == SQLITE_DONE || fail(l, e);
    sqlite3_finalize(q);
    return ok;
}

static void bind_text(sqlite3_stmt *q, int at, const char *text)
{
    sqlite3_bind_text(q, at, text, -1, SQLITE_TRANSIENT);
}

static void bind_real(sqlite3_stmt *q, int at, double x) // SQLite stores NAN as NULL
{
    sqlite3_bind_double(q, at, x);
}

static double real_at(sqlite3_stmt *q, int at)
{
    return sqlite3_column_type(q, at) == SQLITE_NULL ? NAN : sqlite3_column_double(q, at);
}

static void text_at(sqlite3_stmt *q, int at, char *to, size_t size)
{
    const unsigned char *text = sqlite3_column_text(q, at);
    snprintf(to, size, "%s", text ? (const char *)text : "");
}

static bool open_at(struct ledger **out, const char *path, int flags, struct err *e)
{
    struct ledger *l = xcalloc(1, sizeof *l);
    l->path = xstrdup(path);
    bool ok = sqlite3_open_v2(path, &l->db, flags, NULL) == SQLITE_OK || fail(l, e);
    ok = ok && (sqlite3_busy_timeout(l->db, 5000) == SQLITE_OK || fail(l, e));
    if (ok)
        *out = l;
    else
        ledger_close(l);
    return ok;
}

static bool fill_new(struct ledger *l, const char *const *fact, int n_facts, struct err *e)
{
    char version[60];
    snprintf(version, sizeof version, "pragma user_version = %d", LEDGER_FORMAT);
    bool ok =
        exec(l, "pragma synchronous = full; begin", e) && exec(l, schema, e) && exec(l, version, e);
    for (int k = 0; ok && k < n_facts; k++)
        ok = ledger_set(l, fact[2 * k], fact[2 * k + 1], e);
    return ok && exec(l, "commit", e);
}

bool ledger_create(struct ledger **out, const char *path, const char *const *fact, int n_facts,
                   struct err *e)
{
    struct outfile file;
    struct ledger *l = NULL;
    if (!outfile_open(&file, path, e))
        return false;
    unlink(file.tmp);
    bool ok = open_at(&l, file.tmp, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, e) &&
              fill_new(l, fact, n_facts, e);
    ledger_close(l);
    ok = ok && outfile_commit(&file, e);
    outfile_drop(&file);
    return ok && ledger_open(out, path, SESSION_WRITE, e);
}

static bool check_format(struct ledger *l, struct err *e)
{
    sqlite3_stmt *q;
    if (!prepare(l, "pragma user_version", &q, e))
        return false;
    const bool read = sqlite3_step(q) == SQLITE_ROW || fail(l, e);
    const int format = read ? sqlite3_column_int(q, 0) : 0;
    sqlite3_finalize(q);
    if (read && format != LEDGER_FORMAT)
        return err_set(e, ERR_DATA, "%s: ledger of format %d; this program knows %d", l->path,
                       format, LEDGER_FORMAT);
    return read;
}

// A folder that cannot be written has no room for SQLite's log: then the file is read as it is.
static char *read_only_uri(const char *path)
{
    char *log = xasprintf("%s-wal", path), *folder = xstrdup(path), *slash = strrchr(folder, '/');
    if (slash)
        *slash = 0;
    const bool still = access(slash ? folder : ".", W_OK) && access(log, F_OK);
    free(log);
    free(folder);
    if (!still)
        return xstrdup(path);
    char *uri = xcalloc(3 * strlen(path) + 40, 1), *to = uri + sprintf(uri, "file:");
    for (const char *c = path; *c; c++)
        to += strchr("?#%", *c) ? sprintf(to, "%%%02X", (unsigned)*c) : sprintf(to, "%c", *c);
    strcpy(to, "?immutable=1");
    return uri;
}

bool ledger_open(struct ledger **out, const char *path, enum session_mode mode, struct err *e)
{
    struct ledger *l;
    char *name = mode == SESSION_READ ? read_only_uri(path) : xstrdup(path);
    const int flags =
        mode == SESSION_READ ? SQLITE_OPEN_READONLY | SQLITE_OPEN_URI : SQLITE_OPEN_READWRITE;
    bool ok = open_at(&l, name, flags, e);
    free(name);
    if (!ok)
        return false;
    ok = check_format(l, e) && (mode == SESSION_READ ||
                                exec(l, "pragma journal_mode = wal; pragma synchronous = full", e));
    if (ok)
        *out = l;
    else
        ledger_close(l);
    return ok;
}

void ledger_close(struct ledger *l)
{
    if (!l)
        return;
    sqlite3_finalize(l->add_frame);
    sqlite3_close(l->db);
    free(l->path);
    free(l);
}

char *ledger_get(struct ledger *l, const char *key)
{
    sqlite3_stmt *q;
    struct err ignored;
    if (!prepare(l, "select value from fact where key = ?", &q, &ignored))
        return NULL;
    bind_text(q, 1, key);
    char *value = NULL;
    if (sqlite3_step(q) == SQLITE_ROW)
        value = xstrdup((const char *)sqlite3_column_text(q, 0));
    sqlite3_finalize(q);
    return value;
}

bool ledger_set(struct ledger *l, const char *key, const char *value, struct err *e)
{
    sqlite3_stmt *q;
    if (!prepare(l, "insert or replace into fact values(?, ?)", &q, e))
        return false;
    bind_text(q, 1, key);
    bind_text(q, 2, value);
    return finish(l, q, e);
}

bool ledger_keys(struct ledger *l, const char *prefix, char ***out, int *n, struct err *e)
{
    sqlite3_stmt *q;
    if (!prepare(l, "select key from fact where substr(key, 1, ?) = ? order by key", &q, e))
        return false;
    sqlite3_bind_int(q, 1, (int)strlen(prefix));
    bind_text(q, 2, prefix);
    char **key = NULL;
    int count = 0, code;
    while ((code = sqlite3_step(q)) == SQLITE_ROW) {
        key = xrealloc(key, (size_t)count + 1, sizeof *key);
        key[count++] = xstrdup((const char *)sqlite3_column_text(q, 0));
    }
    const bool ok = code == SQLITE_DONE || fail(l, e);
    sqlite3_finalize(q);
    if (ok) {
        *out = key;
        *n = count;
        return true;
    }
    while (count)
        free(key[--count]);
    free(key);
    return false;
}

static bool add_step(struct ledger *l, const struct session_step *s, struct err *e)
{
    sqlite3_stmt *q;
    if (!prepare(l, "insert into step values(?, ?, ?, ?, ?, ?, ?, ?, ?)", &q, e))
        return false;
    sqlite3_bind_int(q, 1, s->index);
    sqlite3_bind_int(q, 2, s->group);
    sqlite3_bind_int(q, 3, s->repeat);
    sqlite3_bind_int(q, 4, s->kind);
    bind_text(q, 5, s->light);
    bind_text(q, 6, s->filter);
    sqlite3_bind_int64(q, 7, s->exposure_ns);
    bind_real(q, 8, s->gain);
    bind_real(q, 9, s->focus_per_m);
    return finish(l, q, e);
}

bool ledger_add_steps(struct ledger *l, const struct session_step *step, int n, bool final,
                      struct err *e)
{
    bool ok = exec(l, "begin", e);
    for (int k = 0; ok && k < n; k++)
        ok = add_step(l, &step[k], e);
    ok = ok && (!final || ledger_set(l, "planned", "all", e)) && exec(l, "commit", e);
    if (!ok)
        sqlite3_exec(l->db, "rollback", NULL, NULL, NULL);
    return ok;
}

bool ledger_add_frame(struct ledger *l, const struct session_frame *f, int64_t size, struct err *e)
{
    if (!l->add_frame &&
        !prepare(l,
                 "insert into frame values(?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?,"
                 " ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                 &l->add_frame, e))
        return false;
    sqlite3_stmt *q = l->add_frame;
    int k = 0;
    sqlite3_bind_int(q, ++k, f->id);
    // A metering shot proves no step: its group stands there, below zero.
    sqlite3_bind_int(q, ++k, f->step.kind == SESSION_METER ? -1 - f->step.group : f->step.index);
    sqlite3_bind_int(q, ++k, f->attempt);
    sqlite3_bind_int64(q, ++k, (int64_t)f->seq);
    sqlite3_bind_int64(q, ++k, (int64_t)f->shot);
    sqlite3_bind_int64(q, ++k, f->device_ns);
    sqlite3_bind_int64(q, ++k, f->start_ns);
    sqlite3_bind_int64(q, ++k, f->arrived_ns);
    sqlite3_bind_int64(q, ++k, f->utc_ns);
    sqlite3_bind_int64(q, ++k, f->step.exposure_ns);
    sqlite3_bind_int64(q, ++k, f->reported_ns);
    sqlite3_bind_int64(q, ++k, f->measured_ns);
    bind_real(q, ++k, f->measured_sigma);
    bind_real(q, ++k, f->gain);
    bind_real(q, ++k, f->focus_per_m);
    bind_real(q, ++k, f->temperature_k);
    sqlite3_bind_int64(q, ++k, f->light_on_ns);
    sqlite3_bind_int64(q, ++k, f->light_off_ns);
    sqlite3_bind_int(q, ++k, f->w);
    sqlite3_bind_int(q, ++k, f->h);
    bind_real(q, ++k, f->black);
    sqlite3_bind_int(q, ++k, f->white);
    bind_real(q, ++k, f->saturated);
    bind_text(q, ++k, f->path);
    sqlite3_bind_int64(q, ++k, size);
    bind_text(q, ++k, f->sha256);
    bind_text(q, ++k, f->verdict);
    bind_text(q, ++k, f->reason);
    const bool ok = sqlite3_step(q) == SQLITE_DONE || fail(l, e);
    sqlite3_reset(q);
    return ok;
}

bool ledger_revoke(struct ledger *l, int id, const char *verdict, const char *reason, struct err *e)
{
    sqlite3_stmt *q;
    if (!prepare(l, "update frame set verdict = ?, reason = ? where id = ?", &q, e))
        return false;
    bind_text(q, 1, verdict);
    bind_text(q, 2, reason);
    sqlite3_bind_int(q, 3, id);
    return finish(l, q, e);
}

bool ledger_revoke_group(struct ledger *l, int group, const char *verdict, const char *reason,
                         struct err *e)
{
    sqlite3_stmt *q;
    if (!prepare(l,
                 "update frame set verdict = ?, reason = ? where verdict = 'good' and step in"
                 " (select id from step where grp = ?)",
                 &q, e))
        return false;
    bind_text(q, 1, verdict);
    bind_text(q, 2, reason);
    sqlite3_bind_int(q, 3, group);
    return finish(l, q, e);
}

bool ledger_note(struct ledger *l, int64_t boot_ns, const char *what, const char *text,
                 struct err *e)
{
    sqlite3_stmt *q;
    if (!prepare(l, "insert into note(boot_ns, what, text) values(?, ?, ?)", &q, e))
        return false;
    sqlite3_bind_int64(q, 1, boot_ns);
    bind_text(q, 2, what);
    bind_text(q, 3, text);
    return finish(l, q, e);
}

bool ledger_history(struct ledger *l, struct session_event **out, int *n, struct err *e)
{
    sqlite3_stmt *q;
    if (!prepare(l, "select boot_ns, what, text from note order by id", &q, e))
        return false;
    struct session_event *event = NULL;
    int count = 0, code;
    while ((code = sqlite3_step(q)) == SQLITE_ROW) {
        if (!(count & (count - 1)))
            event = xrealloc(event, (size_t)count * 2 + 1, sizeof *event);
        struct session_event *ev = &event[count++];
        ev->boot_ns = sqlite3_column_int64(q, 0);
        text_at(q, 1, ev->what, sizeof ev->what);
        text_at(q, 2, ev->text, sizeof ev->text);
    }
    const bool ok = code == SQLITE_DONE || fail(l, e);
    sqlite3_finalize(q);
    if (ok) {
        *out = event;
        *n = count;
    } else {
        free(event);
    }
    return ok;
}

bool ledger_steps(struct ledger *l, struct session_step **out, int *n, struct err *e)
{
    sqlite3_stmt *q;
    if (!prepare(l,
                 "select id, grp, repeat, kind, light, filter, exposure_ns, gain, focus_per_m"
                 " from step order by id",
                 &q, e))
        return false;
    struct session_step *step = NULL;
    int count = 0, code;
    while ((code = sqlite3_step(q)) == SQLITE_ROW) {
        if (!(count & (count - 1))) // doubles at powers of two
            step = xrealloc(step, (size_t)count * 2 + 1, sizeof *step);
        struct session_step *s = &step[count++];
        *s = (struct session_step){
            .index = sqlite3_column_int(q, 0),
            .group = sqlite3_column_int(q, 1),
            .repeat = sqlite3_column_int(q, 2),
            .kind = (enum session_kind)sqlite3_column_int(q, 3),
            .exposure_ns = sqlite3_column_int64(q, 6),
            .gain = real_at(q, 7),
            .focus_per_m = real_at(q, 8),
        };
        text_at(q, 4, s->light, sizeof s->light);
        text_at(q, 5, s->filter, sizeof s->filter);
    }
    const bool ok = code == SQLITE_DONE || fail(l, e);
    sqlite3_finalize(q);
    if (ok) {
        *out = step;
        *n = count;
    } else {
        free(step);
    }
    return ok;
}

static void read_frame(sqlite3_stmt *q, struct session_frame *f)
{
    *f = (struct session_frame){
        .id = sqlite3_column_int(q, 0),
        .attempt = sqlite3_column_int(q, 2),
        .seq = (uint64_t)sqlite3_column_int64(q, 3),
        .shot = (uint64_t)sqlite3_column_int64(q, 4),
        .device_ns = sqlite3_column_int64(q, 5),
        .start_ns = sqlite3_column_int64(q, 6),
        .arrived_ns = sqlite3_column_int64(q, 7),
        .utc_ns = sqlite3_column_int64(q, 8),
        .reported_ns = sqlite3_column_int64(q, 9),
        .measured_ns = sqlite3_column_int64(q, 10),
        .measured_sigma = real_at(q, 11),
        .gain = real_at(q, 12),
        .focus_per_m = real_at(q, 13),
        .temperature_k = real_at(q, 14),
        .light_on_ns = sqlite3_column_int64(q, 15),
        .light_off_ns = sqlite3_column_int64(q, 16),
        .w = sqlite3_column_int(q, 17),
        .h = sqlite3_column_int(q, 18),
        .black = real_at(q, 19),
        .white = sqlite3_column_int(q, 20),
        .saturated = real_at(q, 21),
        .step =
            {
                .index = sqlite3_column_int(q, 1),
                .group = sqlite3_column_int(q, 27),
                .repeat = sqlite3_column_int(q, 28),
                .kind = (enum session_kind)sqlite3_column_int(q, 29),
                .exposure_ns = sqlite3_column_int64(q, 32),
                .gain = real_at(q, 33),
                .focus_per_m = real_at(q, 34),
            },
    };
    text_at(q, 22, f->path, sizeof f->path);
    text_at(q, 23, f->sha256, sizeof f->sha256);
    text_at(q, 24, f->verdict, sizeof f->verdict);
    text_at(q, 25, f->reason, sizeof f->reason);
    text_at(q, 30, f->step.light, sizeof f->step.light);
    text_at(q, 31, f->step.filter, sizeof f->step.filter);
    if (f->step.index < 0) {
        f->step.index = -1;
        f->step.kind = SESSION_METER;
    }
}

bool ledger_frames(struct ledger *l, enum ledger_which which, struct session_frame **out,
                   int64_t **sizes, int *n, struct err *e)
{
    static const char *const conditions[] = {"s.id = f.step and f.verdict = 'good'",
                                             "s.id = f.step", "f.step < 0"};
    sqlite3_stmt *q;
    char *sql = xasprintf("select %s from frame f left join step s on s.id = f.step where %s"
                          " order by f.id",
                          frame_columns, conditions[which]);
    const bool ready = prepare(l, sql, &q, e);
    free(sql);
    if (!ready)
        return false;
    struct session_frame *frame = NULL;
    int64_t *size = NULL;
    int count = 0, code;
    while ((code = sqlite3_step(q)) == SQLITE_ROW) {
        if (!(count & (count - 1))) {
            frame = xrealloc(frame, (size_t)count * 2 + 1, sizeof *frame);
            size = xrealloc(size, (size_t)count * 2 + 1, sizeof *size);
        }
        read_frame(q, &frame[count]);
        size[count++] = sqlite3_column_int64(q, 26);
    }
    const bool ok = code == SQLITE_DONE || fail(l, e);
    sqlite3_finalize(q);
    if (!ok || !sizes)
        free(size);
    else
        *sizes = size;
    if (ok) {
        *out = frame;
        *n = count;
    } else {
        free(frame);
    }
    return ok;
}

int ledger_last_id(struct ledger *l)
{
    sqlite3_stmt *q;
    struct err ignored;
    int last = 0;
    if (!prepare(l, "select max(id) from frame", &q, &ignored))
        return 0;
    if (sqlite3_step(q) == SQLITE_ROW)
        last = sqlite3_column_int(q, 0);
    sqlite3_finalize(q);
    return last;
}

bool ledger_copy(struct ledger *l, const char *path, struct err *e)
{
    sqlite3_stmt *q;
    if (!prepare(l, "vacuum into ?", &q, e))
        return false;
    bind_text(q, 1, path);
    return finish(l, q, e);
}

bool ledger_check(struct ledger *l, struct err *e)
{
    sqlite3_stmt *q;
    if (!prepare(l, "pragma integrity_check(1)", &q, e))
        return false;
    const bool row = sqlite3_step(q) == SQLITE_ROW;
    const char *said = row ? (const char *)sqlite3_column_text(q, 0) : sqlite3_errmsg(l->db);
    const bool ok =
        (row && !strcmp(said, "ok")) || err_set(e, ERR_DATA, "%s: damaged: %s", l->path, said);
    sqlite3_finalize(q);
    return ok;
}

// session.c - the folder around the ledger: frames that are on disk before they are acknowledged.
#define _GNU_SOURCE
#include "core/ledger.h"
#include "core/mem.h"
#include "core/outfile.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

struct session {
    char *folder;
    int lock; // the folder, locked while writing; -1 when reading
    struct ledger *ledger;
};

const char *const session_state_name[] = {"complete", "partial", "damaged"};
static const char *const fixed_files[] = {"rig.yaml", "plan.yaml"}; // their sums are facts

double session_exposure_s(const struct session_frame *f)
{
    return 1e-9 * (double)(f->reported_ns > 0 ? f->reported_ns : f->step.exposure_ns);
}

const char *session_folder(const struct session *s)
{
    return s->folder;
}

char *session_path(const struct session *s, const char *name)
{
    return xasprintf("%s/%s", s->folder, name);
}

static bool lock(struct session *s, struct err *e)
{
    s->lock = open(s->folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (s->lock < 0)
        return err_errno(e, "%s", s->folder);
    return !flock(s->lock, LOCK_EX | LOCK_NB) ||
           err_set(e, ERR_FILE, "%s: another process is writing this session", s->folder);
}

static bool copy_plan(struct session *s, const char *from, struct err *e)
{
    enum { LIMIT = 4 << 20 };
    FILE *f = fopen(from, "rb");
    if (!f)
        return err_errno(e, "%s", from);
    char *text = xcalloc(LIMIT, 1), *to = session_path(s, "plan.yaml");
    const size_t n = fread(text, 1, LIMIT, f);
    fclose(f);
    const bool ok = outfile_write(to, text, n, e);
    free(to);
    free(text);
    return ok;
}

static bool create_ledger(struct session *s, struct err *e)
{
    const time_t now = time(NULL);
    struct tm tm;
    char date[40], rig[SHA256_TEXT], plan[SHA256_TEXT];
    strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%SZ", gmtime_r(&now, &tm));
    char *rig_path = session_path(s, fixed_files[0]), *plan_path = session_path(s, fixed_files[1]);
    char *db = session_path(s, "ledger.db");
    const char *const facts[] = {"created",         date, "nacre.version",    NACRE_VERSION,
                                 "sha256.rig.yaml", rig,  "sha256.plan.yaml", plan};
    const bool ok = sha256_file(rig_path, rig, e) && sha256_file(plan_path, plan, e) &&
                    ledger_create(&s->ledger, db, facts, 4, e);
    free(rig_path);
    free(plan_path);
    free(db);
    return ok;
}

static bool make_folder(const struct session *s, const char *name, struct err *e)
{
    char *path = *name ? session_path(s, name) : xstrdup(s->folder);
    const bool ok = !mkdir(path, 0777) || err_errno(e, "%s", path);
    free(path);
    return ok;
}

// The parts of a session that could not be made whole; nothing of the user's is in it: folders stay
// where there is more.
static void remove_new(const struct session *s)
{
    static const char *const names[] = {"ledger.db", "ledger.db-wal", "ledger.db-shm", "rig.yaml",
                                        "plan.yaml", "frames",        "products",      ""};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        char *path = session_path(s, names[k]);
        if (unlink(path))
            rmdir(path);
        free(path);
    }
}

// A process that was killed before the ledger was whole has left no more than this, and what was
// being written under names that begin with a dot. Those files are removed.
static bool was_never_begun(const struct session *s)
{
    static const char names[] = "/frames/products/rig.yaml/plan.yaml/";
    DIR *dir = opendir(s->folder);
    bool frames = false, other = !dir;
    for (struct dirent *d; dir && (d = readdir(dir));) {
        char *name = xasprintf("/%s/", d->d_name);
        other |= d->d_name[0] != '.' && !strstr(names, name);
        frames |= !strcmp(d->d_name, "frames");
        free(name);
    }
    other |= !frames; // an empty folder may be anybody's
    if (!other)
        rewinddir(dir);
    for (struct dirent *d; !other && (d = readdir(dir));)
        if (!strncmp(d->d_name, ".ledger.", 8) || !strncmp(d->d_name, ".plan.", 6) ||
            !strncmp(d->d_name, ".rig.", 5))
            unlinkat(dirfd(dir), d->d_name, 0);
    if (dir)
        closedir(dir);
    return !other;
}

bool session_create(struct session **out, const char *folder, const struct rig *rig,
                    const char *plan_path, struct err *e)
{
    struct session *s = xcalloc(1, sizeof *s);
    s->folder = xstrdup(folder);
    s->lock = -1;
    struct stat st;
    if (!stat(folder, &st) && was_never_begun(s))
        remove_new(s);
    const bool is_there = !stat(folder, &st);
    if (is_there)
        err_set(e, ERR_FILE, "%s: is there already; continue it with --resume or give a new name",
                folder);
    if (is_there || !make_folder(s, "", e)) {
        session_close(s);
        return false;
    }
    const bool ok = lock(s, e) && make_folder(s, "frames", e) && make_folder(s, "products", e) &&
                    rig_copy(rig, folder, e) && copy_plan(s, plan_path, e) && create_ledger(s, e);
    if (ok) {
        *out = s;
    } else {
        remove_new(s);
        session_close(s);
    }
    return ok;
}

// Files that a killed process left between writing and acknowledging prove nothing.
static bool clean_frames(struct session *s, struct err *e)
{
    int removed = 0;
    const int last = ledger_last_id(s->ledger);
    char *path = session_path(s, "frames");
    DIR *dir = opendir(path);
    free(path);
    if (!dir)
        return err_errno(e, "%s/frames", s->folder);
    for (struct dirent *d; (d = readdir(dir));) {
        int id = 0;
        const bool named = sscanf(d->d_name, "%d.dng", &id) == 1;
        if ((named && id > last) || (d->d_name[0] == '.' && strstr(d->d_name, ".dng")))
            removed += !unlinkat(dirfd(dir), d->d_name, 0);
    }
    closedir(dir);
    char text[60];
    snprintf(text, sizeof text, "%d unacknowledged files removed", removed);
    return !removed || ledger_note(s->ledger, 0, "cleaned", text, e);
}

bool session_open(struct session **out, const char *folder, enum session_mode mode, struct err *e)
{
    struct session *s = xcalloc(1, sizeof *s);
    s->folder = xstrdup(folder);
    s->lock = -1;
    for (size_t n = strlen(s->folder); n > 1 && s->folder[n - 1] == '/'; n--)
        s->folder[n - 1] = 0;
    char *db = session_path(s, "ledger.db");
    struct stat st;
    bool ok = true;
    if (stat(folder, &st))
        ok = err_errno(e, "%s", folder);
    else if (!S_ISDIR(st.st_mode) || stat(db, &st))
        ok = err_set(e, ERR_FILE, "%s: not a session: no ledger.db in it", folder);
    ok = ok && (mode != SESSION_WRITE || lock(s, e)) && ledger_open(&s->ledger, db, mode, e) &&
         (mode != SESSION_WRITE || clean_frames(s, e));
    free(db);
    if (ok)
        *out = s;
    else
        session_close(s);
    return ok;
}

void session_close(struct session *s)
{
    if (!s)
        return;
    ledger_close(s->ledger);
    if (s->lock >= 0)
        close(s->lock);
    free(s->folder);
    free(s);
}

char *session_get(struct session *s, const char *key)
{
    return ledger_get(s->ledger, key);
}
bool session_set(struct session *s, const char *key, const char *value, struct err *e)
{
    return ledger_set(s->ledger, key, value, e);
}
bool session_keys(struct session *s, const char *prefix, char ***key, int *n, struct err *e)
{
    return ledger_keys(s->ledger, prefix, key, n, e);
}

bool session_digest(struct session *s, char hex[SHA256_TEXT], struct err *e)
{
    struct session_frame *frame;
    int n;
    if (!ledger_frames(s->ledger, LEDGER_GOOD, &frame, NULL, &n, e))
        return false;
    struct sha256 *sum = sha256_new();
    char *rig = ledger_get(s->ledger, "sha256.rig.yaml");
    sha256_add(sum, rig ? rig : "", rig ? strlen(rig) : 0);
    for (int k = 0; k < n; k++) {
        sha256_add(sum, "\n", 1);
        sha256_add(sum, frame[k].sha256, strlen(frame[k].sha256));
    }
    sha256_end(sum, hex);
    free(rig);
    free(frame);
    return true;
}

bool session_add_steps(struct session *s, const struct session_step *step, int n, bool final,
                       struct err *e)
{
    return ledger_add_steps(s->ledger, step, n, final, e);
}
int session_next_id(struct session *s)
{
    return ledger_last_id(s->ledger) + 1;
}
bool session_revoke(struct session *s, int id, const char *verdict, const char *reason,
                    struct err *e)
{
    return ledger_revoke(s->ledger, id, verdict, reason, e);
}
bool session_revoke_group(struct session *s, int group, const char *verdict, const char *reason,
                          struct err *e)
{
    return ledger_revoke_group(s->ledger, group, verdict, reason, e);
}
bool session_note(struct session *s, int64_t boot_ns, const char *what, const char *text,
                  struct err *e)
{
    return ledger_note(s->ledger, boot_ns, what, text, e);
}
bool session_history(struct session *s, struct session_event **event, int *n, struct err *e)
{
    return ledger_history(s->ledger, event, n, e);
}
bool session_copy_ledger(struct session *s, const char *path, struct err *e)
{
    return ledger_copy(s->ledger, path, e);
}
bool session_steps(struct session *s, struct session_step **step, int *n, struct err *e)
{
    return ledger_steps(s->ledger, step, n, e);
}
bool session_frames(struct session *s, bool only_good, struct session_frame **frame, int *n,
                    struct err *e)
{
    return ledger_frames(s->ledger, only_good ? LEDGER_GOOD : LEDGER_ALL, frame, NULL, n, e);
}
bool session_meterings(struct session *s, struct session_frame **frame, int *n, struct err *e)
{
    return ledger_frames(s->ledger, LEDGER_METERINGS, frame, NULL, n, e);
}

bool session_add_frame(struct session *s, struct session_frame *f, const struct dng *picture,
                       struct err *e)
{
    void *bytes;
    size_t size;
    if (!dng_encode(picture, &bytes, &size, e))
        return false;
    snprintf(f->path, sizeof f->path, "frames/%06d.dng", f->id);
    sha256_of(bytes, size, f->sha256);
    char *path = session_path(s, f->path);
    const bool ok =
        outfile_write(path, bytes, size, e) && ledger_add_frame(s->ledger, f, (int64_t)size, e);
    free(path);
    free(bytes);
    return ok;
}

__attribute__((format(printf, 2, 3))) static void problem(struct session_report *r, const char *fmt,
                                                          ...)
{
    const int room = (int)(sizeof r->problem / sizeof *r->problem);
    if (r->n_problems < room) {
        va_list ap;
        va_start(ap, fmt);
        vsnprintf(r->problem[r->n_problems], sizeof *r->problem, fmt, ap);
        va_end(ap);
    }
    r->n_problems++;
}

static void check_file(const struct session *s, const char *name, int64_t size, const char *sum,
                       bool read, struct session_report *r)
{
    char *path = session_path(s, name), hex[SHA256_TEXT];
    struct stat st;
    struct err why;
    if (stat(path, &st))
        problem(r, "%s: %s", name, strerror(errno));
    else if (size >= 0 && st.st_size != size)
        problem(r, "%s: %jd bytes, not %jd", name, (intmax_t)st.st_size, (intmax_t)size);
    else if (read && !sha256_file(path, hex, &why))
        problem(r, "%s: cannot be read", name);
    else if (read && strcmp(hex, sum) != 0)
        problem(r, "%s: its content has changed (SHA-256 differs)", name);
    free(path);
}

bool session_recheck(struct session *s, struct err *e)
{
    struct session_frame *frame;
    int64_t *size;
    int n;
    bool ok = ledger_frames(s->ledger, LEDGER_GOOD, &frame, &size, &n, e);
    if (!ok)
        return false;
    for (int k = 0; ok && k < n; k++) {
        struct session_report r = {0};
        check_file(s, frame[k].path, size[k], frame[k].sha256, true, &r);
        if (r.n_problems)
            ok = ledger_revoke(s->ledger, frame[k].id, "damaged", r.problem[0], e);
    }
    free(frame);
    free(size);
    return ok;
}

static bool check_meterings(struct session *s, bool read, struct session_report *r, struct err *e)
{
    struct session_frame *frame;
    int64_t *size;
    int n;
    if (!ledger_frames(s->ledger, LEDGER_METERINGS, &frame, &size, &n, e))
        return false;
    for (int k = 0; k < n; k++)
        check_file(s, frame[k].path, size[k], frame[k].sha256, read, r);
    free(frame);
    free(size);
    return true;
}

static bool judge(struct session *s, bool read, struct session_report *r, struct err *e)
{
    struct session_step *step = NULL;
    struct session_frame *frame = NULL;
    int64_t *size = NULL;
    int n_steps, n_frames;
    struct err why;
    *r = (struct session_report){0};
    if (!ledger_steps(s->ledger, &step, &n_steps, e))
        return false;
    if (read && !ledger_check(s->ledger, &why))
        problem(r, "%s", why.msg);
    if (!check_meterings(s, read, r, e) ||
        !ledger_frames(s->ledger, LEDGER_ALL, &frame, &size, &n_frames, e)) {
        free(step);
        return false;
    }
    for (size_t k = 0; k < sizeof fixed_files / sizeof *fixed_files; k++) {
        char *key = xasprintf("sha256.%s", fixed_files[k]), *sum = ledger_get(s->ledger, key);
        check_file(s, fixed_files[k], -1, sum ? sum : "", read, r);
        free(key);
        free(sum);
    }
    for (int k = 0; k < n_frames; k++) {
        const bool good = !strcmp(frame[k].verdict, "good");
        r->good += good;
        r->other += !good;
        if (strcmp(frame[k].verdict, "damaged") != 0) // that it is not what it was is known
            check_file(s, frame[k].path, size[k], frame[k].sha256, read, r);
    }
    char *planned = ledger_get(s->ledger, "planned");
    r->is_final = planned != NULL;
    r->planned = n_steps;
    r->state = r->n_problems                                   ? SESSION_DAMAGED
               : !r->is_final || r->good < n_steps || !n_steps ? SESSION_PARTIAL
                                                               : SESSION_COMPLETE;
    free(planned);
    free(step);
    free(frame);
    free(size);
    return true;
}

bool session_verify(struct session *s, struct session_report *r, struct err *e)
{
    return judge(s, true, r, e);
}
bool session_status(struct session *s, struct session_report *r, struct err *e)
{
    return judge(s, false, r, e);
}

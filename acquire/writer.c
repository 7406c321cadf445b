// writer.c - a queue, a thread, and what it remembers of the bracket it is in.
#define _GNU_SOURCE
#include "acquire/writer.h"
#include "core/date.h"
#include "core/mem.h"
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

// A good frame, for others to be measured against. Pixels are read back when they are not at hand.
struct known {
    int id, group;
    int64_t step_ns, exposure_ns; // asked; exposed
    double residual;              // of a pair it was in; 0: none
    char light[SESSION_NAME], filter[SESSION_NAME], path[64];
};

struct writer {
    struct session *session;
    struct cam_caps caps;
    int fd;
    pthread_t thread;

    struct known
        *known; // [n_known] the last of each exposure, this group and the one before; owned
    int n_known, next_id;
    struct dng last; // the frame stored last
    int last_id;

    pthread_mutex_t mutex; // guards what follows
    pthread_cond_t wake, room;
    bool quit;
    int n_jobs, n_results;
    struct writer_job job[WRITER_QUEUE];
    struct writer_result result[WRITER_QUEUE];
};

static struct measure_frame pixels_of(const struct dng *d, int64_t exposure_ns)
{
    return (struct measure_frame){d->w, d->h, d->raw, d->black, d->white, exposure_ns};
}

// The known frame whose exposure is nearest; of another filter in the group before, or the same
// group.
static struct known *nearest(struct writer *w, const struct session_frame *f, bool other_filter)
{
    struct known *best = NULL;
    double best_off = other_filter ? log(1.5) : INFINITY;
    const double mine = log(session_exposure_s(f) * 1e9);
    for (int k = 0; k < w->n_known; k++) {
        struct known *c = &w->known[k];
        const bool fits = other_filter ? c->group != f->step.group && *f->step.filter &&
                                             !strcmp(c->light, f->step.light) &&
                                             strcmp(c->filter, f->step.filter) != 0
                                       : c->group == f->step.group;
        const double off = fabs(mine - log((double)c->exposure_ns));
        if (fits && off < best_off) {
            best = c;
            best_off = off;
        }
    }
    return best;
}

// Compares with a known frame; false when it cannot be read or tells nothing.
static bool compare(struct writer *w, const struct measure_frame *mine, const struct known *c,
                    struct measure_ratio *out)
{
    if (c->id == w->last_id) {
        const struct measure_frame theirs = pixels_of(&w->last, c->exposure_ns);
        return measure_ratio(mine, &theirs, out);
    }
    struct dng d = {0};
    struct err ignored;
    char *path = session_path(w->session, c->path);
    const bool read = dng_read(&d, path, &ignored);
    free(path);
    if (!read)
        return false;
    d.black = mine->black;
    const struct measure_frame theirs = pixels_of(&d, c->exposure_ns);
    const bool ok = measure_ratio(mine, &theirs, out);
    dng_finish(&d);
    return ok;
}

static void remember(struct writer *w, const struct session_frame *f, double residual)
{
    const int group = f->step.group;
    int before = -1, kept = 0; // the newest other group
    for (int k = 0; k < w->n_known; k++)
        if (w->known[k].group != group)
            before = w->known[k].group;
    for (int k = 0; k < w->n_known; k++)
        if (w->known[k].group == group ? w->known[k].step_ns != f->step.exposure_ns
                                       : w->known[k].group == before)
            w->known[kept++] = w->known[k];
    w->known = xrealloc(w->known, (size_t)kept + 1, sizeof *w->known);
    struct known *c = &w->known[kept];
    w->n_known = kept + 1;
    *c = (struct known){.id = f->id,
                        .group = group,
                        .residual = residual,
                        .step_ns = f->step.exposure_ns,
                        .exposure_ns = llround(session_exposure_s(f) * 1e9)};
    snprintf(c->light, sizeof c->light, "%s", f->step.light);
    snprintf(c->filter, sizeof c->filter, "%s", f->step.filter);
    snprintf(c->path, sizeof c->path, "%s", f->path);
}

// Takes back a frame, or a group when id is 0: nothing is measured against it any more.
static void take_back(struct writer *w, const struct writer_job *job, struct err *e)
{
    int kept = 0;
    for (int k = 0; k < w->n_known; k++)
        if (job->id ? w->known[k].id != job->id : w->known[k].group != job->n)
            w->known[kept++] = w->known[k];
    w->n_known = kept;
    if (job->id)
        session_revoke(w->session, job->id, job->what, job->text, e);
    else
        session_revoke_group(w->session, job->n, job->what, job->text, e);
}

static struct dng picture(const struct writer *w, const struct session_frame *f, uint16_t *raw)
{
    struct dng d = {.w = f->w,
                    .h = f->h,
                    .pattern = (enum dng_pattern)w->caps.pattern,
                    .black = f->black,
                    .white = f->white,
                    .exposure_s = session_exposure_s(f),
                    .gain = f->gain,
                    .utc_s = date_in_file(f->utc_ns / 1000000000),
                    .raw = raw};
    snprintf(d.camera, sizeof d.camera, "%s", w->caps.model);
    return d;
}

static void keep(struct writer *w, struct writer_job *job, struct writer_result *res)
{
    struct session_frame *f = &res->frame;
    struct dng d = picture(w, f, job->raw);
    const struct measure_frame mine = pixels_of(&d, llround(session_exposure_s(f) * 1e9));
    const struct measure_frame before = pixels_of(&w->last, 0);
    struct measure_level level;
    struct measure_ratio ratio, other;
    struct judge_facts facts = {.damaged = job->damaged, .caps = &w->caps, .level = &level};
    measure_level(&mine, &level);
    facts.stale_first = -1;
    facts.duplicate =
        w->last_id && measure_same_rows(&mine, &before, &facts.stale_first, &facts.stale_last);
    const bool lit = f->step.kind == SESSION_LIGHT;
    struct known *pair = lit ? nearest(w, f, false) : NULL;
    if (pair && compare(w, &mine, pair, &ratio)) {
        facts.ratio = &ratio;
        facts.ratio_ns = pair->exposure_ns;
        res->against = pair->id;
    }
    const struct known *past = lit ? nearest(w, f, true) : NULL;
    if (past && past->residual > 0 && compare(w, &mine, past, &other)) {
        facts.other = &other;
        facts.other_ns = past->exposure_ns;
        facts.own_residual = past->residual;
    }
    judge(f, &facts);
    if (!strcmp(f->verdict, "same-filter"))
        res->against = past->id;
    f->id = w->next_id;
    if (!session_add_frame(w->session, f, &d, &res->err))
        return;
    w->next_id++;
    if (!strcmp(f->verdict, "good")) {
        const double residual = facts.ratio ? ratio.residual : 0;
        if (pair && !(pair->residual > 0))
            pair->residual = residual;
        remember(w, f, residual);
    }
    free(w->last.raw);
    w->last = d;
    w->last_id = f->id;
    job->raw = NULL; // now in w->last
}

static void meter(struct writer *w, const struct writer_job *job, struct writer_result *res)
{
    struct session_frame *f = &res->frame;
    const struct dng d = picture(w, f, job->raw);
    const struct measure_frame m = pixels_of(&d, 0);
    measure_level(&m, &res->level);
    f->saturated = res->level.saturated;
    f->measured_sigma = NAN;
    f->id = w->next_id;
    snprintf(f->verdict, sizeof f->verdict, "metering");
    w->next_id += session_add_frame(w->session, f, &d, &res->err);
}

static void work_on(struct writer *w, struct writer_job *job, struct writer_result *res)
{
    *res = (struct writer_result){.kind = job->kind, .frame = job->frame};
    switch (job->kind) {
    case WRITER_KEEP: keep(w, job, res); break;
    case WRITER_METER: meter(w, job, res); break;
    case WRITER_PLAN: session_add_steps(w->session, job->step, job->n, job->last, &res->err); break;
    case WRITER_REVOKE: take_back(w, job, &res->err); break;
    case WRITER_NOTE:
        session_note(w->session, job->boot_ns, job->what, job->text, &res->err);
        break;
    }
    free(job->raw);
    free(job->step);
}

static void *work(void *arg)
{
    struct writer *w = arg;
    pthread_mutex_lock(&w->mutex);
    for (;;) {
        while (!w->n_jobs && !w->quit)
            pthread_cond_wait(&w->wake, &w->mutex);
        if (!w->n_jobs)
            break;
        struct writer_job job = w->job[0];
        pthread_mutex_unlock(&w->mutex);
        struct writer_result res;
        work_on(w, &job, &res);
        pthread_mutex_lock(&w->mutex);
        memmove(w->job, w->job + 1, (size_t)--w->n_jobs * sizeof *w->job);
        while (w->n_results == WRITER_QUEUE && !w->quit)
            pthread_cond_wait(&w->room, &w->mutex);
        if (w->n_results < WRITER_QUEUE)
            w->result[w->n_results++] = res;
        eventfd_write(w->fd, 1);
    }
    pthread_mutex_unlock(&w->mutex);
    return NULL;
}

// A resumed session: what is proven already is what new frames are measured against.
static bool recall(struct writer *w, struct err *e)
{
    struct session_frame *frame;
    int n;
    if (!session_frames(w->session, true, &frame, &n, e))
        return false;
    for (int k = 0; k < n; k++)
        if (frame[k].step.kind == SESSION_LIGHT)
            remember(w, &frame[k], 0);
    free(frame);
    w->next_id = session_next_id(w->session);
    return true;
}

struct writer *writer_new(struct session *s, const struct cam_caps *caps, struct err *e)
{
    struct writer *w = xcalloc(1, sizeof *w);
    w->session = s;
    w->caps = *caps;
    pthread_mutex_init(&w->mutex, NULL);
    pthread_cond_init(&w->wake, NULL);
    pthread_cond_init(&w->room, NULL);
    w->fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    bool ok = (w->fd >= 0 || err_errno(e, "eventfd")) && recall(w, e);
    const int rc = ok ? pthread_create(&w->thread, NULL, work, w) : 0;
    if (rc)
        ok = err_set(e, ERR_FILE, "no thread: %s", strerror(rc));
    if (ok)
        return w;
    if (w->fd >= 0)
        close(w->fd);
    free(w->known);
    free(w);
    return NULL;
}

void writer_free(struct writer *w)
{
    if (!w)
        return;
    pthread_mutex_lock(&w->mutex);
    w->quit = true;
    pthread_cond_signal(&w->wake);
    pthread_cond_signal(&w->room);
    pthread_mutex_unlock(&w->mutex);
    pthread_join(w->thread, NULL);
    close(w->fd);
    free(w->last.raw);
    free(w->known);
    free(w);
}

int writer_fd(const struct writer *w)
{
    return w->fd;
}

void writer_put(struct writer *w, const struct writer_job *job)
{
    pthread_mutex_lock(&w->mutex);
    if (w->n_jobs == WRITER_QUEUE)
        abort(); // the run never has so many under way
    w->job[w->n_jobs++] = *job;
    pthread_cond_signal(&w->wake);
    pthread_mutex_unlock(&w->mutex);
}

bool writer_get(struct writer *w, struct writer_result *result)
{
    eventfd_t ignored;
    pthread_mutex_lock(&w->mutex);
    const bool any = w->n_results > 0;
    if (any) {
        *result = w->result[0];
        memmove(w->result, w->result + 1, (size_t)--w->n_results * sizeof *w->result);
        pthread_cond_signal(&w->room);
    } else {
        eventfd_read(w->fd, &ignored);
    }
    pthread_mutex_unlock(&w->mutex);
    return any;
}

int writer_waiting(struct writer *w)
{
    pthread_mutex_lock(&w->mutex);
    const int n = w->n_jobs;
    pthread_mutex_unlock(&w->mutex);
    return n;
}

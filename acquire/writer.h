// writer.h - the thread that owns the session: it measures, judges and stores, in order.
//
// A bounded queue in, results out behind an eventfd. The run asks for no shot while the queue is
// full, so nothing is ever dropped; a job too many is a bug and aborts.
#pragma once
#include "acquire/camera.h"
#include "acquire/judge.h"
#include "core/session.h"

enum { WRITER_QUEUE = 32 };

enum writer_kind { WRITER_KEEP, WRITER_METER, WRITER_PLAN, WRITER_REVOKE, WRITER_NOTE };

struct writer_job {
    enum writer_kind kind;
    struct session_frame frame; // KEEP, METER: all that is known before looking at pixels
    bool damaged;
    uint16_t *raw;             // KEEP, METER: [h][w], allocated; the writer frees it
    struct session_step *step; // PLAN: [n], allocated; the writer frees it
    int n, id;
    bool last;
    int64_t boot_ns;
    char what[24], text[256]; // NOTE; REVOKE: verdict and reason
};

struct writer_result {
    enum writer_kind kind;
    struct session_frame frame; // KEEP: as stored
    int against;                // KEEP: id of the frame it was measured against; 0: none
    struct measure_level level; // METER
    struct err err;             // code ERR_NONE: done
};

struct writer;

// The session stays the caller's, but only the writer may touch it until writer_free().
struct writer *writer_new(struct session *s, const struct cam_caps *caps, struct err *e);
void writer_free(struct writer *w); // does what is queued first; accepts NULL

int writer_fd(const struct writer *w); // readable: there are results
void writer_put(struct writer *w, const struct writer_job *job);
bool writer_get(struct writer *w, struct writer_result *result); // false: none now
int writer_waiting(struct writer *w);                            // jobs not done yet

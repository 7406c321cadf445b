// session.h - a session folder: what was planned, what was photographed, and proof of it.
//
//   ledger.db        SQLite: steps, frames, notes. Never the only copy of a picture.
//   frames/*.dng     16-bit counts, written once, never changed
//   rig.yaml plan.yaml (and the spectra that the rig names), products/
//
// A frame is acknowledged when its file is written, synced, renamed, its folder synced, and its row
// committed with synchronous=FULL, in this order: a row never speaks of a file that is not there.
// Complete or partial is what session_verify() finds, never a name. One writer at a time (flock).
// Times are int64_t ns; start, arrival and light times are CLOCK_BOOTTIME of the machine that took
// them.
#pragma once
#include "core/dng.h"
#include "core/rig.h"
#include "core/sha256.h"

enum { SESSION_NAME = 48 };

enum session_kind { SESSION_LIGHT, SESSION_DARK, SESSION_METER };

// What was planned: one exposure. Steps of an automatic bracket are added when they are known.
struct session_step {
    int index;  // 0, 1, ... in the order of the plan
    int group;  // same light, filter and focus; one bracket
    int repeat; // 0, 1, ...
    enum session_kind kind;
    char light[SESSION_NAME], filter[SESSION_NAME]; // names in the rig; "" for none
    int64_t exposure_ns;
    double gain;        // 1 is the base
    double focus_per_m; // dioptres; NAN: as it is
};

// What happened. Only frames whose verdict is "good" count; others are kept and say why.
struct session_frame {
    int id; // 1, 2, ... in the order of acknowledgement
    struct session_step step;
    int attempt;        // 1: the first shot of the step
    uint64_t seq, shot; // of the device; of the run
    int64_t device_ns;  // start of exposure, the device's clock
    int64_t start_ns;   // the same on CLOCK_BOOTTIME; 0: not known
    int64_t arrived_ns;
    int64_t utc_ns;                    // since 1970, at arrival
    int64_t reported_ns;               // exposure as the device says; 0: it does not
    int64_t measured_ns;               // from pixels against a bracket neighbour; 0: no neighbour
    double measured_sigma;             // relative standard deviation of measured_ns; NAN
    double gain;                       // as reported, else as asked
    double focus_per_m, temperature_k; // NAN: not known
    int64_t light_on_ns, light_off_ns; // 0: no light
    int w, h;
    double black;     // nominal, counts
    int white;        // largest count
    double saturated; // share of pixels at white
    char path[64];    // "frames/000001.dng"
    char sha256[SHA256_TEXT];
    char verdict[24]; // "good", "wrong-exposure", "damaged", ...
    char reason[160]; // "" when good
};

// The exposure to calculate with: what the device reported, else what was asked.
double session_exposure_s(const struct session_frame *f);

struct session; // an open session

enum session_mode {
    SESSION_READ,
    SESSION_WRITE,
    SESSION_ADD, // facts only, and beside a process that is writing frames
};

// Makes the folder with copies of the rig and the plan. ERR_FILE when something is there already.
// A session that fails half-way is removed again.
bool session_create(struct session **s, const char *folder, const struct rig *rig,
                    const char *plan_path, struct err *e);
// ERR_FILE: not there, not a session, or (writing) in use by another process.
bool session_open(struct session **s, const char *folder, enum session_mode mode, struct err *e);
void session_close(struct session *s); // accepts NULL

const char *session_folder(const struct session *s);
char *session_path(const struct session *s, const char *name); // folder/name, allocated

// Facts about the whole: "created", "nacre.version", "sha256.rig.yaml"...; NULL when absent.
// get allocates.
char *session_get(struct session *s, const char *key);
bool session_set(struct session *s, const char *key, const char *value, struct err *e);
// The keys that begin with `prefix`, in order of their bytes; free each and the array.
bool session_keys(struct session *s, const char *prefix, char ***key, int *n, struct err *e);
// SHA-256 over what was photographed: the sums of the rig and of every good frame, in order.
bool session_digest(struct session *s, char hex[SHA256_TEXT], struct err *e);

// Adds steps in one transaction; `final` says that the plan is now known to its end.
bool session_add_steps(struct session *s, const struct session_step *step, int n, bool final,
                       struct err *e);
// The next free id (also past files that were never acknowledged).
int session_next_id(struct session *s);
// Writes the picture and acknowledges it; true means durable. Sets f->path and f->sha256.
bool session_add_frame(struct session *s, struct session_frame *f, const struct dng *picture,
                       struct err *e);
// Takes back a good frame: it stays, with this verdict, and its step is open again.
bool session_revoke(struct session *s, int id, const char *verdict, const char *reason,
                    struct err *e);
bool session_revoke_group(struct session *s, int group, const char *verdict, const char *reason,
                          struct err *e); // all good frames of it
// Reads every good frame again; those that are gone or altered are revoked as "damaged", so that a
// resumed capture shoots them again.
bool session_recheck(struct session *s, struct err *e);
// One line of history: "resumed", "clock", "light off"; `what` is one word.
bool session_note(struct session *s, int64_t boot_ns, const char *what, const char *text,
                  struct err *e);

struct session_event {
    int64_t boot_ns;
    char what[24], text[256];
};
// All of history, oldest first; allocated.
bool session_history(struct session *s, struct session_event **event, int *n, struct err *e);

// Arrays are allocated; free() them. Frames in order of id; only_good leaves the others out.
bool session_steps(struct session *s, struct session_step **step, int *n, struct err *e);
bool session_frames(struct session *s, bool only_good, struct session_frame **frame, int *n,
                    struct err *e);
// The shots by which automatic brackets found their exposures: step.index is -1 and step.kind
// SESSION_METER; they belong to no step and never count.
bool session_meterings(struct session *s, struct session_frame **frame, int *n, struct err *e);

// A copy of the ledger as one file, whole even while a capture is writing.
bool session_copy_ledger(struct session *s, const char *path, struct err *e);

enum session_state { SESSION_COMPLETE, SESSION_PARTIAL, SESSION_DAMAGED };
extern const char *const session_state_name[]; // "complete", "partial", "damaged"

struct session_report {
    enum session_state state;
    int planned, good, other; // steps; frames that count; frames kept with another verdict
    bool is_final;            // false: an automatic bracket was not yet planned to its end
    int n_problems;
    char problem[16][240]; // the first ones: "frames/000003.dng: SHA-256 differs"
};

// Reads every file and compares its SHA-256 with the ledger. false only when it cannot be judged.
bool session_verify(struct session *s, struct session_report *r, struct err *e);
// The same without reading the pictures: sizes and presence only.
bool session_status(struct session *s, struct session_report *r, struct err *e);

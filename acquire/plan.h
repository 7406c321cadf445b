// plan.h - a plan file: which exposures, under which lights, through which filters, at which focus.
//
// Order of a capture: focus, then light, then filter; each such group is one bracket, shot
// `repeats` times, shortest exposure first. Dark frames of every exposure come last, without light.
// An automatic bracket has its exposures found by metering when its group is reached.
#pragma once
#include "acquire/camera.h"
#include "acquire/trigger.h"
#include "core/rig.h"
#include "core/session.h"

enum { PLAN_MAX_EXPOSURES = 64 };

struct plan {
    char *path, *name;
    int n_lights, n_filters, n_focus;        // 0: none of the rig's (no light is switched, ...)
    char **light, **filter;                  // names in the rig
    double *focus_per_m;                     // dioptres
    int n_exposures;                         // 0: automatic
    int64_t exposure_ns[PLAN_MAX_EXPOSURES]; // rising
    int64_t meter_ns;                        // automatic: the first guess
    double step_stops, span_stops;           // automatic: between exposures; from first to last
    int repeats, darks, retries;
    double gain; // NAN: the rig's
};

bool plan_open(struct plan *p, const char *path, struct err *e);
void plan_finish(struct plan *p); // accepts a zeroed struct

// One bracket; indices into the rig, -1 for none.
struct plan_group {
    int index, light, filter;
    double focus_per_m;     // NAN: as it is
    enum session_kind kind; // SESSION_LIGHT or SESSION_DARK
};
int plan_groups(const struct plan *p, const struct rig *rig, struct plan_group **group);

// What a camera makes of an exposure: rounded to its step, clipped to its range.
int64_t plan_round(const struct cam_caps *caps, int64_t exposure_ns);

// The exposures of an automatic bracket whose shortest is first_ns; clipped to camera and light.
int plan_bracket(const struct plan *p, const struct cam_caps *caps, const struct rig_light *light,
                 int64_t first_ns, int64_t out[PLAN_MAX_EXPOSURES]);

// The steps of a group with these exposures; `first` is the index of the first. Allocated.
int plan_steps(const struct plan *p, const struct rig *rig, const struct plan_group *g,
               const int64_t *exposure_ns, int n, const struct cam_caps *caps, int first,
               struct session_step **step);

// Longest time that a light is on for one exposure.
int64_t plan_on_ns(const struct cam_caps *caps, const struct rig_light *light, int64_t exposure_ns);

struct plan_report {
    int frames, groups; // of an automatic bracket: at most
    double duration_s;  // estimate, at most
    double bytes, free_bytes;
    int n_rounded;
    int64_t rounded[PLAN_MAX_EXPOSURES][2]; // asked, what the camera will do
};

// Judges the plan against rig, devices and disk before any light goes on. `lights` and `filters`
// may be NULL when the rig has none. ERR_DATA with the reason: unknown names, exposures out of the
// camera's or a light's limits, a light on for too long, a camera that is only for looking.
// ERR_FILE: not enough space.
bool plan_check(const struct plan *p, const struct rig *rig, const struct cam_caps *caps,
                const struct trig_caps *lights, const struct trig_caps *filters, double free_bytes,
                struct plan_report *r, struct err *e);

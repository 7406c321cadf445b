// camera.h - a camera: a file descriptor, one shot at a time, frames that say what the sensor did.
//
// When fd is readable the loop calls cam_pump(); the driver hands finished frames to cam_deliver(),
// which calls on_frame before it returns. Any thread a driver needs stays inside the driver, and
// speaks through fd. One thread owns a camera. Times are int64_t ns.
//
// URIs    "sim:w=8,h=4": a driver's name and its options (devopt.h). In a rig "@run" in a URI
//         becomes a text of this capture's own (for a simulated camera and light that must find
//         each other across processes), "@rig" the path of the rig file.
// Shots   shoot() asks for one exposure with these settings and returns at once; one frame follows,
//         or none when it was lost. A camera that streams anyway may deliver frames of before.
//         Settings that the device cannot hold are rounded or refused by it; frames carry what was
//         applied, not what was asked.
#pragma once
#include "acquire/devopt.h"
#include "acquire/found.h"
#include <stdint.h>

enum cam_pattern { CAM_MONO, CAM_RGGB, CAM_GRBG, CAM_GBRG, CAM_BGGR }; // first row, first two

enum cam_clock {
    CAM_CLOCK_BOOT,   // device_ns is CLOCK_BOOTTIME
    CAM_CLOCK_MONO,   // CLOCK_MONOTONIC
    CAM_CLOCK_DEVICE, // the device's own: any zero, drifts
};

struct cam_frame {
    uint64_t seq;         // +1 per exposure; a gap means frames were lost
    uint64_t shot;        // cam_shot.id of the shot that the device made it for; 0: it cannot tell
    int64_t device_ns;    // start of exposure of the first row, on the clock that caps.clock
                          // names; 0: not known
    int64_t exposure_ns;  // as applied by the sensor; 0: it does not say
    double gain;          // as applied, 1 is the base; NAN: it does not say
    double focus_per_m;   // as applied, dioptres; NAN: it does not say
    double temperature_k; // of the sensor; NAN: it does not say
    int64_t utc_ns;       // since 1970, of a recording; 0: now
    bool damaged;         // the device says that the samples are not all good
    int w, h;             // pixels
    const uint16_t *raw;  // [h][w] counts, linear, black level not removed; valid in on_frame only
};

struct cam_shot {
    uint64_t id;         // > 0, new for every shot
    int64_t exposure_ns; // > 0
    double gain;         // 1 is the base
    double focus_per_m;  // dioptres; NAN: leave it
};

struct cam_caps { // filled by open
    char model[64], serial[64];
    int w, h;
    int bits;     // counts go up to 2^bits - 1
    double black; // nominal black level, counts
    enum cam_pattern pattern;
    bool for_looking; // compressed or processed: pictures to aim by, not to measure with
    enum cam_clock clock;
    int64_t exposure_min_ns, exposure_max_ns, exposure_step_ns; // step 0: any
    double gain_min, gain_max;                                  // equal: fixed
    double focus_min_per_m, focus_max_per_m;                    // both 0: no focus drive
    int64_t row_ns;  // rolling shutter: start of a row after the one above; 0: all rows at once
    int64_t dead_ns; // from the end of an exposure to its frame, at most
    int settle; // frames after which new settings are in force, at most; 0: with the next frame
};

struct cam;

struct cam_driver {
    const char *name;             // as in "v4l2:/dev/video0"
    const char *summary;          // one line for doctor --devices
    size_t size;                  // sizeof the driver's struct, whose first member is struct cam
    const struct devopt *options; // parsed into the driver's struct before open; may be NULL
    bool (*open)(struct cam *cam, struct err *e); // sets cam->fd and cam->caps; on failure close()
                                                  // is called all the same
    bool (*shoot)(struct cam *cam, const struct cam_shot *shot, struct err *e);
    bool (*pump)(struct cam *cam, struct err *e); // never blocks; false: the camera is gone
    void (*close)(struct cam *cam); // once; also after a failed open or pump; not fd, not options
    void (*find)(found_fn *found, void *ctx); // what there is to open; NULL: nothing to look for
};

typedef void cam_on_frame(void *ctx, const struct cam_frame *frame);

struct cam {
    const struct cam_driver *drv;
    const struct cam_driver *const *drivers; // for drivers that wrap another one
    int fd;                                  // poll for input; closed by cam_close(); -1: none
    struct cam_caps caps;
    cam_on_frame *on_frame;
    void *ctx;
};

// `drivers` ends with NULL and outlives the camera. NULL on failure: ERR_DATA for an unknown driver
// or option, ERR_DEVICE for a camera that is not there or busy.
struct cam *cam_open(const struct cam_driver *const drivers[], const char *uri,
                     cam_on_frame *on_frame, void *ctx, struct err *e);
bool cam_shoot(struct cam *cam, const struct cam_shot *shot, struct err *e);
bool cam_pump(struct cam *cam, struct err *e);
void cam_close(struct cam *cam); // accepts NULL

void cam_deliver(struct cam *cam, const struct cam_frame *frame); // drivers call this from pump

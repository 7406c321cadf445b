// libcamera_bridge.h - libcamera as C: one camera, one stream, requests with settings, frames with
// metadata. What is asked when is decided in libcamera_cam.c.
#pragma once
#ifdef __cplusplus
extern "C" {
#endif
#include "acquire/camera.h"
#include "acquire/unpack.h"

struct lc_bridge;

struct lc_stream {
    char model[64], id[64];
    const struct pixel_format *pixels;
    int w, h;
    size_t stride;
    int requests; // that can be under way; most cameras need several to stream at all
    // What can be set; both 0: it cannot.
    int64_t exposure_min_us, exposure_max_us;
    float gain_min, gain_max, focus_min_per_m, focus_max_per_m;
};

struct lc_ask {
    uint64_t shot; // comes back with the frame
    int64_t exposure_us;
    int64_t interval_us;      // from frame to frame; 0: as it is
    double gain, focus_per_m; // focus NAN: leave it
};

struct lc_frame {
    uint64_t shot;
    uint64_t seq;
    int64_t start_ns;                        // exposure of the first row, CLOCK_MONOTONIC
    int64_t exposure_us;                     // 0: it does not say
    double gain, focus_per_m, temperature_k; // NAN: it does not say
    bool damaged;
    const void *data; // valid until the next request
    size_t bytes;
};

// name: a number or libcamera's id. format: a name or "auto". 0 for w and h: the camera's. The raw
// stream, else one to aim by. *fd (owned by the caller) becomes readable when a request has
// completed. lc_close() accepts NULL, and what a failed lc_open() leaves in *b.
bool lc_open(struct lc_bridge **b, const char *name, const char *format, int w, int h, int *fd,
             struct lc_stream *s, struct err *e);
void lc_close(struct lc_bridge *b);

bool lc_request(struct lc_bridge *b, const struct lc_ask *ask, struct err *e);
// The next completed request; *any is false when there is none. False: the camera is gone.
bool lc_next(struct lc_bridge *b, struct lc_frame *f, bool *any, struct err *e);

void lc_find(found_fn *found, void *ctx);

#ifdef __cplusplus
}
#endif

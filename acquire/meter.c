// meter.c - too bright: an eighth; too dark: eight times; else the shortest exposure is known.
#include "acquire/meter.h"
#include <math.h>

static const double TARGET = 0.6; // of full scale, the brightest pixels of the shortest exposure
enum { MAX_SHOTS = 12 };

enum meter_result meter_look(struct meter *m, const struct plan *p, const struct cam_caps *caps,
                             const struct rig_light *light, double saturated, double bright,
                             int64_t out[PLAN_MAX_EXPOSURES], int *n)
{
    const int64_t ns = m->exposure_ns;
    const bool too_bright = saturated > 1e-4 || bright > 0.95;
    const bool too_dark = !too_bright && bright < 0.05;
    const int64_t better = plan_round(caps, too_bright ? ns / 8 : too_dark ? ns * 8 : ns);
    const bool too_long = light && plan_on_ns(caps, light, better) > llround(light->max_on_s * 1e9);
    if (better != ns && (too_bright || too_dark) && !too_long && ++m->shots < MAX_SHOTS) {
        m->exposure_ns = better;
        return METER_AGAIN;
    }
    const double first_ns = (double)ns * (too_bright ? 0.5 : TARGET / fmax(bright, 0.01));
    const double steps = log2(first_ns / (double)p->meter_ns) / p->step_stops;
    const double on_grid_ns = (double)p->meter_ns * exp2(floor(steps + 1e-6) * p->step_stops);
    *n = plan_bracket(p, caps, light, llround(fmax(on_grid_ns, 1000)), out);
    m->exposure_ns = 0;
    return METER_DONE;
}

// scene.h - a simulated world: a sample, a view of it, a sensor. From YAML (docs/simulator.md).
//
// Lights and filters are those of the rig file; the scene holds what a rig does not know, and may
// say that the sensor is not what the rig believes. counts = black + responsivity * exposure * L,
// L = f E.
#pragma once
#include "core/rig.h"
#include "sim/board.h"
#include "sim/bokeh.h"
#include "sim/view.h"

struct sim_sensor {
    int bits;
    double black;        // counts
    double responsivity; // counts per (W m^-2 sr^-1 s), at gain 1
    double electrons_per_count;
    bool bayer; // RGGB; else mono
    bool shot_noise;
    double full_well;                     // electrons
    double blooming;                      // share of what exceeds it that spills, 0 to 1
    double read_noise;                    // electrons
    double dark_current;                  // electrons / s
    double hot_pixels, hot_current;       // share of the pixels; their mean extra, electrons / s
    double prnu;                          // rms of the pixels' sensitivities, relative
    double fixed_pattern, column_pattern; // rms of the pixels' and columns' offsets, counts
    double black_drift;                   // counts
    double row_s;                         // rolling shutter: start of a row after the one above
    double exposure_step_s, exposure_min_s, exposure_max_s;
};

// What lies before the camera: the sample, or what a rig is calibrated with.
enum sim_target { SIM_SAMPLE, SIM_BOARD, SIM_BALL, SIM_EVEN };

struct sim_scene {
    char *path; // owned
    enum sim_target target;
    struct sample sample;
    struct sim_view view;
    const struct sim_view
        *table_of; // orders as strong as at the h.n of its photograph, which is what
                   // a table from it knows; NULL: at every pixel's own; not owned
    struct sim_bokeh bokeh;
    struct sim_board board; // calibration targets
    struct sim_ball ball;
    struct sim_sensor sensor;
};

// With a rig, the sensor's bits, black and responsivity are the rig's where the scene is silent.
bool sim_scene_open(struct sim_scene *s, const char *path, const struct rig *rig, struct err *e);
bool sim_scene_open_text(struct sim_scene *s, const char *name, const char *text,
                         const struct rig *rig, struct err *e);
void sim_scene_finish(struct sim_scene *s); // accepts a zeroed struct
extern const char sim_scene_default[];      // an LCD-like crossed grating: what "sim:" alone means

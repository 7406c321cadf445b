// calib.h - the verbs of nacre calib: what they take, one function each (calib_<verb>.c).
#pragma once
#include "ui/cli.h"

// All options; each verb says in cmd_calib.c which ones are its own.
struct calib_args {
    const char *out;
    const char *times, *method, *dark; // sensor
    const char *light, *filter;        // a session's or rig's; a light record
    double black, white;               // counts
    const char *channel;
    double lines_per_m, blaze_rad; // bokeh, spectral: a known grating
    const char *turn, *response;
    const char *board, *dictionary, *plane; // a printed target
    double square_m, marker_m;
    const char *lens, *ball, *poses; // light
    double radius_m;
    const char *grating, *geometry, *center; // spectral
    double lambda_m, width_m, accuracy_m, h_per_px;
    const char *size, *fresnel; // geometry
    const char *tangents;
    double beam, r0, hub_m;
};

// cli->operand holds what stands behind the verb.
bool calib_dark(const struct calib_args *a, struct cli *cli, struct err *e);
bool calib_noise(const struct calib_args *a, struct cli *cli, struct err *e);
bool calib_response(const struct calib_args *a, struct cli *cli, struct err *e);
bool calib_flat(const struct calib_args *a, struct cli *cli, struct err *e);
bool calib_bokeh(const struct calib_args *a, struct cli *cli, struct err *e);
bool calib_lens(const struct calib_args *a, struct cli *cli, struct err *e);
bool calib_board(const struct calib_args *a, struct cli *cli, struct err *e);
bool calib_geometry(const struct calib_args *a, struct cli *cli, struct err *e);
bool calib_light(const struct calib_args *a, struct cli *cli, struct err *e);
bool calib_spectral(const struct calib_args *a, struct cli *cli, struct err *e);

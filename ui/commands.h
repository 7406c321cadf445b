// commands.h - the commands of nacre, one file each (cmd_<name>.c).
#pragma once
#include "ui/cli.h"

extern const struct command cmd_demo;
extern const struct command cmd_calib;
extern const struct command cmd_capture;
extern const struct command cmd_session;
extern const struct command cmd_hdr;
extern const struct command cmd_lut;
extern const struct command cmd_bokeh;
extern const struct command cmd_deconvolve;
extern const struct command cmd_height;
extern const struct command cmd_tables;
extern const struct command cmd_eval;
extern const struct command cmd_export;
extern const struct command cmd_factor;
extern const struct command cmd_methods;
extern const struct command cmd_prefilter;
extern const struct command cmd_render;
extern const struct command cmd_report;
extern const struct command cmd_simulate;
extern const struct command cmd_convert;
extern const struct command cmd_look;
extern const struct command cmd_compare;
extern const struct command cmd_doctor;
extern const struct command cmd_bench; // tests/bench: the benchmarks are not a layer of the program
extern const struct command cmd_slits;
extern const struct command cmd_gallery;

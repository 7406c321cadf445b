// sim.h - the simulated devices, as drivers for a program's lists, and where their truth is.
#pragma once
#include "acquire/camera.h"
#include "acquire/trigger.h"
#include "sim/lab.h"

extern const struct cam_driver sim_cam;
extern const struct trig_driver sim_trig;
// Wrap another device of the same lists and spoil it by schedule: "fault:drop=2,in=sim:w=8".
extern const struct cam_driver fault_cam;
extern const struct trig_driver fault_trig;
extern const struct cam_driver replay_cam; // "replay:SESSION"

// The bench behind a file: a rig whose camera is simulated, or a scene; "sim" is the built-in one.
bool sim_lab_open(struct lab *lab, const char *rig_or_scene, struct err *e);

// datapath.h - where the shipped rigs, plans, samples and scenes lie.
#pragma once
#include "core/err.h"

// A file of the project's data ("rigs/sim.yaml"): below NACRE_DATA when it is set, else beside the
// program in its build tree, else in ../share/nacre of where it is installed. ERR_FILE names the
// places looked at. Caller frees.
char *data_path(const char *name, struct err *e);

// A file as given, else the one of that name that ships ("rigs/sim.yaml" works from any folder).
// Caller frees.
char *data_file(const char *given);

char *self_path(void); // of this program, caller frees

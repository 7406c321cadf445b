// lights_record.h - which light lines are in use, on record in a service's runtime folder.
//
// A line stays high when the processes that hold and watch it are killed together. The records tell
// whoever comes next which rigs' lines those are. Without a runtime folder (RUNTIME_DIRECTORY)
// there are none.
#pragma once
#include "core/err.h"

// Allocated; NULL: nothing is on record.
char *lights_record_begin(const char *rig, const char *run);
void lights_record_end(char *record); // removes it; accepts NULL

// Calls for every record that is left; it is removed when the call returns true. False when one
// call failed, with its error.
bool lights_record_each(bool (*call)(const char *rig, const char *run, struct err *e),
                        struct err *e);

// read_lut.h - the diffraction table of a command line: a file, and what the file may not say.
#pragma once
#include "core/table.h"

// In linear sRGB; the channels of a .pfm, which cannot say, are taken as that. `range` is NAN when
// it was not given. Refuses samples that are not finite.
bool read_lut(struct table *t, const char *path, double range, int power, struct err *e);

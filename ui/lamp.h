// lamp.h - a lamp of several LEDs as a mirror shows it, for tables under a complex light.
#pragma once
#include "core/err.h"

// A ring of eight LEDs, four warm and four cool, and one in the middle: 65 x 65 px, the middle at
// h = 0.
bool lamp_write(const char *path, struct err *e);

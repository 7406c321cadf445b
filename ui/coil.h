// coil.h - a coiled tube as an OBJ file: a body to put scales on.
#pragma once
#include "core/err.h"

// Texture s runs along the body, v around it.
bool coil_write(const char *path, struct err *e);

// contact_sheet.h - a bracket at a glance: every good frame of a session, small, side by side.
#pragma once
#include "core/image.h"

// Thumbnails of the first group's frames (one light, filter and focus) in order of exposure, each as the
// sensor saw it: black level to white, sRGB; saturated pixels red. Caller finishes `out`.
bool contact_sheet(const char *session_folder, int thumb_w, int columns, struct image *out, struct err *e);

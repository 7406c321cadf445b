// hcodec.h - the height formats, one pair of functions and one file each; hfield_file.c lists them.
//
// As in codec.h: messages without the path; a failed read may leave a half filled field behind.
#pragma once
#include "core/hfield_file.h"
#include "core/image.h"

bool gsf_read(struct hfield *hf, const char *path, const struct hfield_hints *hints, struct err *e);
bool gsf_write(const struct hfield *hf, const char *path, const struct hfield_hints *hints,
               struct err *e);

bool x3p_read(struct hfield *hf, const char *path, const struct hfield_hints *hints, struct err *e);
bool x3p_write(const struct hfield *hf, const char *path, const struct hfield_hints *hints,
               struct err *e);

bool nanoscope_read(struct hfield *hf, const char *path, const struct hfield_hints *hints,
                    struct err *e);

// Pictures whose samples are heights.
bool height_picture_read(struct hfield *hf, const char *path, const struct hfield_hints *hints,
                         struct err *e);
bool height_picture_write(const struct hfield *hf, const char *path,
                          const struct hfield_hints *hints, struct err *e);

// "nm", "um", "~m" (Nanoscope's um), "m": metres, or ERR_DATA that names `what`.
bool length_unit(const char *what, const char *unit, double *metres, struct err *e);

// Hints over the file's own spacing (NAN where the file does not say it).
bool hfield_spacing(const struct hfield_hints *hints, double dx_file_m, double dy_file_m,
                    double *dx_m, double *dy_m, struct err *e);

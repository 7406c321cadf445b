// hfield_file.h - height fields in files, by extension.
//
// Read and write: .gsf .x3p, .exr .pfm (metres), .tif .png (16 bit; .tif also float; samples of
// 0..1 times a height). Read: Bruker Nanoscope (.di .spm .000 ...). The file's first row is row 0;
// Nanoscope stores the last one first. Missing nodes are NAN. Units are never guessed: a file that
// does not state them is refused unless the hints do.
#pragma once
#include "core/hfield.h"

struct hfield_hints {  // what the file does not say; 0: not given
    double dx_m, dy_m; // node spacing; dy_m 0: as dx_m. Stronger than the file's own
    double z_scale_m;  // height of a sample of 1 (.tif .png: white); .exr and .pfm have 1 m
};

// `hints` may be NULL. ERR_FILE, ERR_DATA as image_read; nothing is left behind by a failed write.
bool hfield_read(struct hfield *hf, const char *path, const struct hfield_hints *hints,
                 struct err *e);
bool hfield_write(const struct hfield *hf, const char *path, const struct hfield_hints *hints,
                  struct err *e);

bool path_is_height(const char *path); // by an extension that only height files have

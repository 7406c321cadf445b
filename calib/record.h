// record.h - what every calibration record says of itself, and whether it fits what it is used on.
//
// A record is a YAML file, or an EXR whose attributes hold the same keys behind "nacre.calib.". Its
// date is that of the pictures it was made from (their capDate), else the day it was made.
#pragma once
#include "core/image.h"
#include "core/yaml.h"
#include <stdio.h>

struct record {
    char kind[16];             // "response", "dark", ...
    char date[32];             // ISO 8601
    char device[96], lens[96]; // "" where not known
    char valid[160];           // what it holds for, in words
    double valid_days;         // and for how long from its date; NAN: for ever
    char residual_unit[48];    // what the residual is and its unit
    double residual;           // NAN where there is none
    double iso, aperture;      // NAN where not known, as all below
    double focus_per_m, distance_m;
    int w, h; // pixels; 0 where it does not matter
};

// Empty but for kind, valid and residual; then what the picture's metadata knows.
void record_init(struct record *r, const char *kind, const char *valid, double residual,
                 const char *residual_unit);
void record_from_image(struct record *r, const struct image *im);
void record_settings(struct record *r, const struct record *from); // date, device, lens ... size

// Writing YAML: begin, print more keys to f, end.
struct record_file {
    FILE *f;
    char *text;
    size_t size;
};
void record_begin(struct record_file *rf, const struct record *r, const char *command);
void record_list(FILE *f, const char *key, const double *value, int n);
bool record_end(struct record_file *rf, const char *path, struct err *e); // writes the file, frees

// Reading YAML: "x.yaml: is a dark record, not a response record" when the kind is another.
bool record_read(struct record *r, struct ynode *root, const char *path, const char *kind,
                 struct err *e);
bool record_read_list(struct ynode *map, const char *key, double lo, double hi, double *out, int n,
                      struct err *e);

void record_to_meta(const struct record *r, struct meta *m);
bool record_from_meta(struct record *r, const struct meta *m, const char *path, const char *kind,
                      struct err *e);

// Refuses a record made with another camera, lens, ISO, aperture, focus, distance or resolution
// than `now`, or more than its valid_days before, naming the first difference. What either side
// does not know is not compared. (record_fits.c, as those below)
bool record_fits(const struct record *r, const char *path, const struct record *now, struct err *e);
bool record_fits_image(const struct record *r, const char *path, const struct image *photo,
                       struct err *e);
// The same for a record that is a picture; one without a record's keys is believed.
bool record_image_fits(const struct image *made, const char *path, const char *kind,
                       const struct image *photo, struct err *e);

// frames.h - the frames of a bracket read from files or a session: codes where they are 8 bit,
// samples elsewhere.
#pragma once
#include "calib/dark.h"
#include "process/hdr.h"

struct frames {
    int n, w, h, nc;
    char **path;        // [n], owned
    double *time_s;     // [n] NAN where the file says nothing; owned
    uint8_t **code;     // [n] frames [h][w][nc] of 8-bit pictures, owned; or NULL
    float **px;         // [n] frames [h][w][nc] of linear ones, owned; or NULL
    bool printed_times; // from a photograph's EXIF: nominal
    bool repeats;       // several frames of one exposure are meant
    double white;       // sample at which px saturates; INFINITY: none known
    struct meta meta;   // of the first frame
    struct record now;  // the camera and its settings, to compare records with

    // After frames_remove_black():
    double saturation; // of px above black
    double read_extra; // variance that subtracting a dark added to every sample

    // What a session knows besides:
    double brdf_scale;               // counts/s above black into L / E in 1/sr; 0: not known
    double lambda_m, lambda_sigma_m; // effective wavelength and its band; 0: not known
    char group[200];                 // "light led, filter green", "" for plain files
};

// Reads them all. ERR_DATA: fewer than two, sizes or kinds that differ, NaN; each names the file.
// Where the samples of a file end: a sensor's white level, full scale of 16 bits, else unknown.
double file_white(const struct image *im);
bool frames_read(struct frames *f, int n, char *const *path, struct err *e);
void frames_finish(struct frames *f); // accepts a zeroed struct

// Refuses a dark of another camera, ISO or size.
bool frames_dark_fits(const struct frames *f, const struct dark *d, const char *name,
                      struct err *e);

// Takes black off linear frames: the dark's when given (it must fit the camera), else the level
// that the files state.
bool frames_remove_black(struct frames *f, const struct dark *dark, const char *dark_name,
                         struct err *e);

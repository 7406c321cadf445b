// lens.h - a camera's lens and the poses of the boards it was found with: the lens record.
//
// Camera coordinates: x right, y down, z forward, in metres; the pixel (i, j) of a point is
// center + focal distort(x / z, y / z), Brown's model with k1 k2 p1 p2 k3, as OpenCV has it.
#pragma once
#include "calib/cv_board.h"
#include "calib/record.h"
#include "core/geom.h"

struct lens_view {
    char *image;         // the picture's path, owned
    struct corners seen; // owned; none where the record does not tell them
    struct view_fit fit;
};

// Where the sample lies, in camera coordinates: origin, and t right, b up, n towards the camera.
struct plane {
    struct vec3 origin_m;
    struct frame f;
};

struct lens {
    struct record head; // residual: rms of the corners, px
    struct board board;
    struct camera_fit camera;
    int n;                  // views
    struct lens_view *view; // [n], owned
    int plane;              // the view whose board lay where the sample will lie
};
void lens_finish(struct lens *l); // accepts a zeroed struct
struct lens lens_copy(const struct lens *l);

// From the corners of n pictures of w x h, without outliers. Refused (ERR_DATA):
// fewer than three views; views that are all tilted alike; a focal length that stays unknown by
// more than 1 %.
bool lens_fit(struct lens *l, const struct board *b, const struct corners *seen,
              char *const image[], int n, int w, int h, struct err *e);

bool lens_write(const struct lens *l, const char *command, const char *path, struct err *e);
bool lens_read(struct lens *l, const char *path, struct err *e); // both in lens_file.c

// The view of this picture, by its path or its name alone; -1: none.
int lens_view_of(const struct lens *l, const char *image);
// The plane of a view's board, its origin in the board's middle. t runs along the board's rows; of
// a chessboard, which has no beginning, to the right.
struct plane lens_plane(const struct lens *l, int view);

// Where the lens puts corner k that a view saw, and how far from where it was seen, px.
struct vec3 lens_corner(const struct lens *l, int view, int k); // in camera coordinates
double lens_miss(const struct lens *l, int view, int k);

struct vec3 lens_ray(const struct lens *l, double i, double j);                // unit
void lens_project(const struct lens *l, struct vec3 at, double *i, double *j); // at.z > 0

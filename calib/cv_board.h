// cv_board.h - OpenCV's chessboard and ChArUco targets and its camera calibration, as C.
#pragma once
#ifdef __cplusplus
extern "C" {
#endif
#include "core/err.h"
#include <stdint.h>

// A flat target with cols x rows inner corners: a chessboard, or a ChArUco board when marker_m > 0.
struct board {
    int cols, rows;
    double square_m, marker_m;
    char dictionary[24]; // "4x4_50", ...; of a ChArUco board
};

// Corner k is at ((k % cols) square_m, (k / cols) square_m) on the board.
struct corners {
    int n;
    int *id;         // [n] owned, from malloc
    double (*px)[2]; // [n] owned: pixel, x then y
};

// Corners in a grey picture [h][w], with fractions of a pixel; n is 0 where no board is seen, and
// that is no failure. ERR_DATA for a dictionary or a size that there is not.
bool cv_board_find(const struct board *b, const uint8_t *grey, int w, int h, struct corners *out,
                   struct err *e);

// The camera that saw the views, by least squares over all of them.
struct camera_fit {
    double focal_px[2], center_px[2], distortion[5]; // k1 k2 p1 p2 k3
    double focal_sigma_px[2], center_sigma_px[2], distortion_sigma[5];
    double rms_px;
};
struct view_fit {
    double rotation[9], origin_m[3]; // camera = rotation board + origin; x right, y down, z forward
    double rms_px;
};
// with_k3 false: k3 stays 0. ERR_DATA when there is no solution.
bool cv_board_calibrate(const struct board *b, const struct corners *seen, int n, int w, int h,
                        bool with_k3, struct camera_fit *camera, struct view_fit *view,
                        struct err *e);

// The board as a picture, `square_px` to a square and a margin of one square: grey
// [(rows + 3) square_px][(cols + 3) square_px].
bool cv_board_draw(const struct board *b, int square_px, uint8_t *grey, struct err *e);

#ifdef __cplusplus
}
#endif

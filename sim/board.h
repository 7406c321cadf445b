// board.h - photographs of calibration targets: a board that lies where the sample lies, and a
// mirror ball.
//
// The board's middle is at the sample's origin, its columns run along t, its rows against b. Behind
// board and ball is an even grey. Nothing here is shared with calib/.
#pragma once
#include "core/image.h"
#include "sim/view.h"

struct sim_board {
    int squares[2]; // of a chessboard, along t and b; 0: none
    double square_m;
    struct image picture; // or any picture, 0..1; px NULL: none
    double size_m[2];     // of the picture
};

struct sim_ball {
    struct vec3 at_m;
    double radius_m;        // 0: none
    double spot_px;         // sigma of the light's mirror image
    double inside, outside; // brightness of ball and background
};

// The keys `board` and `ball` of a scene in `path`.
bool board_read(struct sim_board *b, struct ynode *root, const char *path, struct err *e);
bool ball_read(struct sim_ball *b, struct ynode *root, struct err *e);

// One channel, 0..1. ERR_DATA without such a key, or for a Fourier view.
bool board_photo(const struct sim_board *b, const struct sim_view *v, struct image *out,
                 struct err *e);
bool ball_photo(const struct sim_ball *b, const struct sim_view *v, struct image *out,
                struct err *e);

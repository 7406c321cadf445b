// view_params.h - everything that a person can set in the window, as one table of numbers.
//
// The table makes the sliders, the undo steps, the script's `set` and what has to be done again
// when a number changes. Angles are radians, lengths metres; the table says how they are shown.
#pragma once
#include <stdbool.h>

enum param {
    PARAM_EXPOSURE, // stops
    PARAM_OFFSET,   // added after exposure
    PARAM_LOOK,     // enum look
    PARAM_DECADES,  // of the false colour's scale
    PARAM_COMPARE,  // enum compare
    PARAM_SPLIT,    // place of the line, 0..1
    PARAM_ZEBRA,
    PARAM_ORDERS, // drawn over the picture
    PARAM_PITCH,  // of the grating whose orders are drawn
    PARAM_LAMBDA,
    PARAM_H_PER_PX, // of a camera's picture: half vector per pixel
    PARAM_KIND,     // enum diffraction
    PARAM_AGAINST,  // enum diffraction, of the other picture
    PARAM_TABLES,   // in use, 0: all
    PARAM_GAIN,
    PARAM_ROUGHNESS,
    PARAM_LIGHT_EV, // stops on top of the scene's
    PARAM_LIGHT_YAW,
    PARAM_LIGHT_PITCH,
    PARAM_YAW, // the camera about its target, from where the scene has it
    PARAM_RISE,
    PARAM_DISTANCE, // factor
    PARAM_PAN_X,    // of the target, parts of the picture's height
    PARAM_PAN_Y,
    PARAM_ROOM_TURN, // the environment about +y
    PARAM_ROOM_EV,
    PARAM_SPECTRUM, // of the lights, of param_info's choices; 0: as the scene has it
    PARAMS
};

enum look { LOOK_COLOR, LOOK_FALSE };
enum compare { COMPARE_NONE, COMPARE_SPLIT, COMPARE_DIFFERENCE };

struct params {
    double v[PARAMS];
};

enum param_cost { // what a change asks for
    COST_SHOW,    // the picture is shown another way
    COST_ROOM,    // what objects show of the environment is computed, then drawn
    COST_DRAW,    // the picture is drawn at once
};

struct param_info {
    const char *name;  // of the script and of undo
    const char *label; // of the slider; NULL: set in other ways
    double lo, hi, start;
    double unit;         // what is shown is the value over this
    const char *format;  // of what is shown; NULL: a choice
    const char *choices; // zero-separated
    bool log;
    enum param_cost cost;
};
extern const struct param_info param_info[PARAMS];

struct params params_start(void);
const char *param_choice(const struct params *p, enum param k); // in words
int param_find(const char *name);                               // -1: none
// Keeps within lo..hi; angles that go round come round. False when nothing changed.
bool param_set(struct params *p, enum param k, double value);
// The dearest cost of what differs; -1: nothing does.
int params_differ(const struct params *a, const struct params *b, enum param *first);

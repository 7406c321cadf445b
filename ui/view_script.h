// view_script.h - a person's part, written down: one step a line, for tests and for figures.
#pragma once
#include "core/err.h"
#include "ui/view_event.h"

enum script_verb {
    SCRIPT_SIZE,       // size 1280 800            points
    SCRIPT_MOVE,       // move [PANE] X Y          points of the window, or parts of a pane
    SCRIPT_PRESS,      // press left|right|middle
    SCRIPT_RELEASE,    // release left|right|middle
    SCRIPT_WHEEL,      // wheel STEPS
    SCRIPT_KEY,        // key ctrl+Z
    SCRIPT_TYPE,       // type TEXT
    SCRIPT_SET,        // set -2 exposure          as shown: stops, degrees, nm, um
    SCRIPT_SELECT,     // select 2                 of the list
    SCRIPT_OPEN,       // open FILE
    SCRIPT_WAIT,       // wait 0.5s
    SCRIPT_SETTLE,     // settle                   until nothing is being computed
    SCRIPT_SCREENSHOT, // screenshot FILE.png
    SCRIPT_SAVE,       // save FILE.exr
    SCRIPT_TURNTABLE,  // turntable COUNT FOLDER
    SCRIPT_MEASURE,    // measure                  what skipping saves
    SCRIPT_LOSE,       // lose                     OpenGL's context, as a reset of the card does
    SCRIPT_PRINT,      // print                    what the window says, on stdout
    SCRIPT_QUIT,       // quit
};
// drag [PANE] X0 Y0 X1 Y1 [left|right|middle] becomes move, press, moves, release.

struct script_step {
    enum script_verb verb;
    int line;
    char pane[16]; // "": coordinates are points of the window
    double num[2];
    int key, mods, button;
    char text[400];
};

struct script {
    struct script_step *step; // [n], owned
    int n;
};

// ERR_DATA names file and line.
bool script_read(struct script *s, const char *path, struct err *e);
void script_finish(struct script *s); // accepts a zeroed struct

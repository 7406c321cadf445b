// view_keys.h - which key does what: the one list behind the keyboard and the help.
#pragma once
#include "ui/view_event.h"

enum action {
    ACTION_NONE,
    ACTION_BRIGHTER,
    ACTION_DARKER,
    ACTION_OFFSET_UP,
    ACTION_OFFSET_DOWN,
    ACTION_FIT,
    ACTION_NORMALIZE,
    ACTION_RESET,
    ACTION_SELECT, // which: the digit
    ACTION_NEXT,
    ACTION_PREVIOUS,
    ACTION_LIST_NEXT,
    ACTION_LIST_PREVIOUS,
    ACTION_FALSE_COLOR,
    ACTION_COMPARE,
    ACTION_KIND,
    ACTION_AGAINST,
    ACTION_FEWER_TABLES,
    ACTION_MORE_TABLES,
    ACTION_TABLE_PANE,
    ACTION_ORDERS,
    ACTION_PITCH_HERE,
    ACTION_ZEBRA,
    ACTION_PLAY,
    ACTION_CAPTURE,
    ACTION_ABORT,
    ACTION_UNDO,
    ACTION_REDO,
    ACTION_SCREENSHOT,
    ACTION_SAVE_PICTURE,
    ACTION_TURNTABLE,
    ACTION_PANELS,
    ACTION_HELP,
    ACTION_ESCAPE,
    ACTION_QUIT,
};

struct key {
    int key, mods;
    enum action action;
    const char *shown, *help; // for people; NULL: told with the line above
};
extern const struct key keys[]; // ends with ACTION_NONE

// *which is the digit of ACTION_SELECT.
enum action key_action(int key, int mods, int *which);

// "shift+E", "ctrl+Z", "left", "?": false when there is no such key.
bool key_parse(const char *text, int *key, int *mods);

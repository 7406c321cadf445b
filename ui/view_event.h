// view_event.h - what a person, or a script in their place, does to the window.
#pragma once
#include <stdbool.h>

enum event_kind { EVENT_MOUSE, EVENT_BUTTON, EVENT_WHEEL, EVENT_KEY, EVENT_TEXT, EVENT_DROP };

// A key is the capital letter, digit or sign on it, in the layout of the person; '?' however it is
// typed; or one of these.
enum {
    KEY_ESCAPE = 256,
    KEY_ENTER,
    KEY_TAB,
    KEY_BACKSPACE,
    KEY_DELETE,
    KEY_LEFT,
    KEY_RIGHT,
    KEY_UP,
    KEY_DOWN,
    KEY_HOME,
    KEY_END,
    KEY_F1,
    KEY_F12,
    KEYS
};
enum { MOD_SHIFT = 1, MOD_CTRL = 2, MOD_ALT = 4 };
enum { BUTTON_LEFT, BUTTON_RIGHT, BUTTON_MIDDLE, BUTTONS };

struct event {
    enum event_kind kind;
    double x, y;        // pixels of the window, y down; steps of the wheel in y
    int button, key;    // of EVENT_BUTTON and EVENT_KEY
    int mods;           // MOD_*, for both
    bool down;          // pressed or repeated, else let go
    unsigned codepoint; // EVENT_TEXT
    char *path;         // EVENT_DROP, owned
};

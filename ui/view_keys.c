// view_keys.c - the list of keys; E, O, F, N, R, 1-9 and the arrows are those of tev.
#define _GNU_SOURCE
#include "ui/view_keys.h"
#include <ctype.h>
#include <string.h>

const struct key keys[] = {
    {'E', 0, ACTION_BRIGHTER, "E / Shift+E", "exposure up / down by half a stop"},
    {'E', MOD_SHIFT, ACTION_DARKER, NULL, NULL},
    {'O', 0, ACTION_OFFSET_UP, "O / Shift+O", "offset up / down by 0.1"},
    {'O', MOD_SHIFT, ACTION_OFFSET_DOWN, NULL, NULL},
    {'N', 0, ACTION_NORMALIZE, "N", "exposure chosen from the picture"},
    {'F', 0, ACTION_FIT, "F", "fit: the whole picture, the scene's own camera"},
    {'R', 0, ACTION_RESET, "R", "everything as it was at first"},
    {'1', 0, ACTION_SELECT, "1-9", "select from the list"},
    {KEY_RIGHT, 0, ACTION_NEXT, "Left / Right",
     "previous / next frame of a session, else of the list"},
    {KEY_LEFT, 0, ACTION_PREVIOUS, NULL, NULL},
    {KEY_DOWN, 0, ACTION_LIST_NEXT, "Up / Down", "previous / next of the list"},
    {KEY_UP, 0, ACTION_LIST_PREVIOUS, NULL, NULL},
    {'C', 0, ACTION_FALSE_COLOR, "C", "false colour"},
    {'K', 0, ACTION_KIND, "K", "next kind of diffraction that the sample has"},
    {'D', 0, ACTION_COMPARE, "D", "compare: split screen, difference, off"},
    {'K', MOD_SHIFT, ACTION_AGAINST, "Shift+K", "next kind to compare with"},
    {']', 0, ACTION_MORE_TABLES, "[ / ]", "fewer / more of a set of tables"},
    {'[', 0, ACTION_FEWER_TABLES, NULL, NULL},
    {'T', 0, ACTION_TABLE_PANE, "T", "the sample's table beside the picture"},
    {'G', 0, ACTION_ORDERS, "G", "predicted orders over the picture"},
    {'P', 0, ACTION_PITCH_HERE, "P", "take the pitch implied under the mouse"},
    {'Z', 0, ACTION_ZEBRA, "Z", "stripes where the sensor clips"},
    {' ', 0, ACTION_PLAY, "Space", "replay a session; hold a capture, or go on"},
    {'R', MOD_CTRL, ACTION_CAPTURE, "Ctrl+R / Ctrl+X", "begin a capture / stop it, light off"},
    {'X', MOD_CTRL, ACTION_ABORT, NULL, NULL},
    {'Z', MOD_CTRL, ACTION_UNDO, "Ctrl+Z / Ctrl+Y", "undo / redo"},
    {'Y', MOD_CTRL, ACTION_REDO, NULL, NULL},
    {'Z', MOD_CTRL | MOD_SHIFT, ACTION_REDO, NULL, NULL},
    {'S', 0, ACTION_SCREENSHOT, "S / F12", "screenshot of the window"},
    {KEY_F12, 0, ACTION_SCREENSHOT, NULL, NULL},
    {'S', MOD_SHIFT, ACTION_SAVE_PICTURE, "Shift+S", "the picture alone, linear, as .exr"},
    {'V', 0, ACTION_TURNTABLE, "V", "frames of one turn, for a video"},
    {'B', 0, ACTION_PANELS, "B", "panels on / off"},
    {'?', 0, ACTION_HELP, "? / H", "this list"},
    {'H', 0, ACTION_HELP, NULL, NULL},
    {KEY_F1, 0, ACTION_HELP, NULL, NULL},
    {KEY_ESCAPE, 0, ACTION_ESCAPE, "Esc", "close this list; stop a turn or a replay"},
    {'Q', MOD_CTRL, ACTION_QUIT, "Ctrl+Q", "quit"},
    {0},
};

enum action key_action(int key, int mods, int *which)
{
    if (key == '?')
        mods = 0; // Shift may be how it is typed
    if (key >= '1' && key <= '9' && !mods) {
        *which = key - '0';
        return ACTION_SELECT;
    }
    for (const struct key *k = keys; k->action; k++)
        if (k->key == key && k->mods == mods)
            return k->action;
    return ACTION_NONE;
}

bool key_parse(const char *text, int *key, int *mods)
{
    static const struct {
        const char *name;
        int key;
    } names[] = {{"escape", KEY_ESCAPE}, {"enter", KEY_ENTER}, {"tab", KEY_TAB},
                 {"left", KEY_LEFT},     {"right", KEY_RIGHT}, {"up", KEY_UP},
                 {"down", KEY_DOWN},     {"home", KEY_HOME},   {"end", KEY_END},
                 {"space", ' '},         {"F1", KEY_F1},       {"F12", KEY_F12}};
    static const struct {
        const char *name;
        int mod;
    } modifiers[] = {{"shift+", MOD_SHIFT}, {"ctrl+", MOD_CTRL}, {"alt+", MOD_ALT}};
    *mods = 0;
    for (int k = 0; k < 3; k++) {
        const size_t n = strlen(modifiers[k].name);
        if (!strncasecmp(text, modifiers[k].name, n)) {
            *mods |= modifiers[k].mod;
            text += n;
            k = -1;
        }
    }
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        if (!strcasecmp(text, names[k].name)) {
            *key = names[k].key;
            return true;
        }
    if (!text[0] || text[1])
        return false;
    *key = toupper((unsigned char)text[0]);
    return true;
}

// view_item.h - the list on the left: what can be looked at, and how each is looked at.
#pragma once
#include "render/scene.h"
#include "ui/view_undo.h"

enum item_kind { ITEM_SCENE, ITEM_TABLE, ITEM_PICTURE, ITEM_SESSION, ITEM_LIVE };
extern const char *const item_kind_name[];

struct item {
    enum item_kind kind;
    char *path; // owned; "" for the daemon's camera
    char *name; // owned, for people
    struct params params;
    struct undo undo;
    double first_ev; // exposure of a scene when it was first seen
    bool visited;    // params are a person's, no longer to be taken from the file
};

struct items {
    struct item **item; // [n], owned
    int n;
};

// What lies there, by what it is: a scene, a table, a picture, a session, or a folder of them,
// which adds each. ERR_FILE: nothing there; ERR_DATA: nothing that can be looked at.
bool items_add(struct items *l, const char *path, struct err *e);
void items_add_live(struct items *l);
void items_finish(struct items *l); // accepts a zeroed struct

// Reads what an item is, beside the window's thread.
struct load {
    enum item_kind kind;
    char *path;                   // owned
    struct scene_options options; // what it points to outlives the job
    char *stand;                  // of tables and sessions: the scene that shows them, owned

    bool ok;
    struct err e;
    struct scene scene; // of scenes, tables and sessions
    struct image picture;
    double seconds;
};
struct load *load_new(const struct item *it, const struct scene_options *o, struct err *e);
void load_run(void *load);
void load_free(struct load *l); // accepts NULL

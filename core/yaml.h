// yaml.h - rig, plan and scene files: values with units, errors with file and line.
//
// On libyaml's document tree, so that every value still knows its line when it is judged:
//   "rigs/sim.yaml:12: pitch: -2um must be positive". Read each key once; yaml_close() refuses
// the keys that nobody asked for, naming the nearest known one.
#pragma once
#include "core/err.h"
#include "core/units.h"

struct yaml;  // an open file
struct ynode; // a map, list or scalar in it; lives as long as the file

bool yaml_open(struct yaml **y, const char *path, struct err *e);
bool yaml_open_text(struct yaml **y, const char *name, const char *text, struct err *e);
struct ynode *yaml_root(struct yaml *y);

// Refuses keys that were never asked for (when `strict`), then frees. Accepts NULL (returns true).
bool yaml_close(struct yaml *y, bool strict, struct err *e);

// A failed judgement of the caller's: "file:line: key: <message>", ERR_DATA; returns false.
bool yaml_bad(const struct ynode *n, struct err *e, const char *fmt, ...)
    __attribute__((format(printf, 3, 4)));

struct ynode *ymap_find(struct ynode *map, const char *key); // NULL: absent; marks the key as known
bool ynode_is_map(const struct ynode *n);
bool ynode_is_list(const struct ynode *n);
int ylist_count(const struct ynode *list);
struct ynode *ylist_at(struct ynode *list, int k);
const char *ynode_text(const struct ynode *n); // "" for maps and lists
int ynode_line(const struct ynode *n);
const char *ynode_key(const struct ynode *n); // its key in the map above, or ""

// The value of a key. An absent key leaves *out as it is, unless `need` is set: then ERR_DATA.
// The range is inclusive; numbers outside it fail with the range in the message.
enum yneed { Y_OPTIONAL, Y_NEEDED };
bool ymap_num(struct ynode *map, const char *key, enum yneed need, enum unit unit, double lo,
              double hi, double *out, struct err *e);
bool ymap_int(struct ynode *map, const char *key, enum yneed need, int lo, int hi, int *out,
              struct err *e);
bool ymap_bool(struct ynode *map, const char *key, enum yneed need, bool *out, struct err *e);
bool ymap_text(struct ynode *map, const char *key, enum yneed need, const char **out,
               struct err *e); // lives with the file
bool ymap_choice(struct ynode *map, const char *key, enum yneed need,
                 const char *choices /* "a|b|c" */, int *out, struct err *e);
bool ymap_map(struct ynode *map, const char *key, enum yneed need, struct ynode **out,
              struct err *e);
bool ymap_list(struct ynode *map, const char *key, enum yneed need, struct ynode **out,
               struct err *e);
bool ynode_num(struct ynode *n, enum unit unit, double lo, double hi, double *out, struct err *e);

// scene_fields.h - the parts of a scene file that its readers share. Private to scene_*.c.
#pragma once
#include "core/yaml.h"
#include "render/scene.h"

bool field_nums(struct ynode *map, const char *key, enum yneed need, enum unit unit, int n,
                double lo, double hi, double *out, struct err *e);
bool field_vec(struct ynode *map, const char *key, enum yneed need, enum unit unit,
               struct vec3 *out, struct err *e);
// One number for all channels, or [r, g, b]; from 0 to hi.
bool field_color(struct ynode *map, const char *key, double hi, double out[3], struct err *e);

// The file that a scene names: as it is when absolute, else beside the scene, else below
// `o->tables`. Free it.
char *scene_file(const struct scene *s, const struct scene_options *o, const char *name);

// One object's map: its material. Options replace what the map of the sample says.
bool scene_read_material(struct ynode *map, const struct scene *s, const struct scene_options *o,
                         bool is_sample, struct material *m, struct err *e);
bool scene_read_shape(struct ynode *map, const struct scene *s, const struct scene_options *o,
                      struct shape *shape, struct err *e);

// scene.h - what is rendered: a camera, lights, objects, and how the picture is exposed.
//
// World coordinates in metres, right-handed, +y up (docs/optics.md). Pictures have row 0 on top.
#pragma once
#include "core/image.h"
#include "render/lobes.h"
#include "render/shape.h"
#include "render/surround.h"

#define SCENE_FAR_M 1e6 // no length of a scene is longer

struct camera {
    struct vec3 eye_m, target_m, up;
    double fov_rad;    // of the picture's height
    double aperture_m; // diameter of a thin lens; 0: a pinhole
    double focus_m;    // along the view, what the lens shows sharp; 0: the target
    double shift[2];   // of every ray over the picture, right and down, in halves of its size
};

struct light {
    bool is_far;
    struct vec3 at;  // m; for a far light the direction to it, unit
    double power;    // radiant intensity: irradiance at 1 m; for a far light the irradiance
    double tint[3];  // colour per channel, on top of the illuminant's
    double radius_m; // of a round source facing the sample's centre; for a far light radians
};

struct object {
    char *name; // owned
    struct shape shape;
    struct material material;
    struct image seen; // what its table shows of the environment (surround.h), or empty
    struct lobes lobes[DIFFRACTION_KINDS]; // its patterns' cells, where it needs them for that
    struct env_keep *keep;                 // owned; NULL: its kernel is not kept
};

// Whether a map has all that an object diffracts of the environment.
static inline bool object_shows_map(const struct object *o)
{
    return o->seen.px && o->material.diffraction == DIFFRACTION_TABLE;
}

// Whether an object diffracts the environment's rest by lobes: its own, or such as integrate finer.
static inline bool object_has_lobes(const struct object *o)
{
    const enum diffraction kind = o->material.diffraction;
    return !object_shows_map(o) && (kind == DIFFRACTION_TABLE || kind == DIFFRACTION_SLITS);
}

// Whether the environment's lights add anything to an object, next to its irradiance and `seen`.
static inline bool object_uses_far_lights(const struct object *o)
{
    return material_has_specular(&o->material) ||
           (o->material.diffraction != DIFFRACTION_NONE && !object_shows_map(o));
}

// Stam's shader has no lobes: it sees all of the environment as lights, others its spots.
static inline bool object_by_lights_alone(const struct object *o)
{
    return o->material.diffraction == DIFFRACTION_STAM;
}

struct scene {
    char *path; // of its file, owned
    struct camera camera;
    int w, h;              // the size asked for
    double exposure_ev;    // stops; NAN: chosen from the picture (display.h)
    double background[3];  // radiance
    double light_color[3]; // linear sRGB of the illuminant with Y = 1
    struct light *light;   // [n_lights], owned
    int n_lights;
    struct object *object; // [n_objects], owned
    int n_objects;
    struct surround *surround; // owned; NULL: there is none
    int seen_size;             // nodes a side of the objects' `seen`
    int pass, passes; // of pictures whose mean is meant, which one (sampling.h); 0, 0: alone
    bool still;       // no other picture follows: `seen` holds what the camera sees
};

// The environment's lights that an object sees, *n of them.
static inline const struct surround_light *scene_far_lights(const struct scene *s,
                                                            const struct object *o, int *n)
{
    const bool alone = object_by_lights_alone(o);
    *n = !s->surround ? 0 : alone ? s->surround->n_lights : s->surround->n_spots;
    return !s->surround ? NULL : alone ? s->surround->light : s->surround->spot;
}

enum { SCENE_MAX_LIGHTS = 256, SCENE_MAX_OBJECTS = 32 };

// Replacements for what the file says.
struct scene_options {
    const char *factors;     // of the sample, in the place of a table; NULL: the file's
    const char *table;       // of the sample; NULL: the file's
    const char *tables;      // folder for files that are not beside the scene; NULL: none
    const char *illuminant;  // of the lights, for samples with a photo; NULL: the file's
    const char *environment; // map of a scene that has one; NULL: the file's
    double exposure_ev;      // NAN: the file's
    bool exposure_auto;
    int w, h;   // 0: the file's
    int nodes;  // of prefiltered maps; 0: the file's
    bool still; // one picture: nothing is computed that its camera does not see, or kept
};

// Errors name file and line; tables are found relative to the scene file.
bool scene_read(struct scene *s, const char *path, const struct scene_options *o, struct err *e);
// Computes what flat objects show of the environment and other objects' lobes, where they are
// missing: scene_read does, and whoever changes the environment, a frame or a table after freeing
// `seen` and, for a table, `lobes`.
bool scene_prefilter(struct scene *s, struct err *e);
void scene_finish(struct scene *s); // accepts a zeroed struct

double camera_focus(const struct camera *c); // focus_m, or the distance of the target

// The ray through the point (x, y) of a w x h picture, pixel centres at integers; dir is not unit:
// its component along the view is 1.
void camera_ray(const struct camera *c, double x, double y, int w, int h, struct vec3 *dir);

// The view's right, up and forward directions; right and up are scaled by the tangent of half the
// field of view, right also by w / h.
void camera_axes(const struct camera *c, int w, int h, struct vec3 axes[3]);

// The pixels that a shape can cover, columns box[0]..box[2]-1 and rows box[1]..box[3]-1: the
// rectangle around the corners of its box; all of them when it reaches behind the eye.
void shape_pixels(const struct camera *c, const struct shape *s, int w, int h, int box[4]);

// Irradiance normal to the beam at a point, and the unit direction to the light.
double light_at(const struct light *l, struct vec3 at_m, struct vec3 *wi);

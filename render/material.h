// material.h - what a surface does with light: diffuse + specular + diffraction (T17 eq. 7), and a
// clear coat over them.
//
// All in linear sRGB, per unit irradiance of the light. The table already holds the light's
// spectrum; the other layers are multiplied by the light's colour.
#pragma once
#include "core/table.h"
#include "process/rainbow.h"
#include "render/photo.h"
#include "render/slits.h"

enum diffraction {
    DIFFRACTION_NONE,
    DIFFRACTION_TABLE,
    DIFFRACTION_SLITS, // evaluated at every point, wavelength by wavelength
    DIFFRACTION_STAM,  // G04, process/rainbow.h
    DIFFRACTION_KINDS
};

// Where the sample diffracts at all: stripes, or a picture's first channel (nearest pixel).
struct mask {
    int stripes; // across s; 0: none
    double duty; // the part of each stripe that diffracts
    struct image picture;
};

struct material {
    double diffuse[3];  // albedo
    double specular[3]; // power reflectance at normal incidence; all 0: no such layer
    double roughness;   // rms slope of the Beckmann lobe, for `specular`
    double coat_ior;    // of a clear smooth layer that covers the rest; 1: none

    enum diffraction diffraction;
    double r0;   // power reflectance F0^2 of the diffracting surface
    double gain; // of all diffraction, 1 unless the scene says otherwise
    struct mask mask;

    struct table table;  // linear sRGB; n is 0: there is none
    struct photo *photo; // that the table is summed from, owned; NULL: not known
    int tables_used;     // of table.count; 0: all
    double table_scale;  // 4 pi^2 for a plain table, see material_take_table
    bool over_w2;        // tables from heights leave G / w^2 to the renderer
    struct slits slits;
    struct rainbow rainbow; // G04; spacing 0: there is none
};

void material_init(struct material *m);   // black
void material_finish(struct material *m); // accepts a zeroed struct

// Moves the table in, as linear sRGB. r0 NAN: from the table's "f0", or 0.04. What the value means
// (docs/optics.md): a plain table is S_d, f = 4 pi^2 F^2 G S_d (T17 eq. 10); one with a basis over
// w is from a height field, f = F^2 G / (F0^2 w^2) XYZ, or without F0^2 where its meta
// "nacre.scale" is "absolute".
void material_take_table(struct material *m, struct table *t, double r0);

// Diffraction by its name ("none", "table", "slits", "g04"); ERR_DATA when the material has not got
// what that needs.
bool material_choose(struct material *m, const char *name, struct err *e);

int material_tables(const struct material *m); // in use

// Uses the least tables whose relative L2 error, as their maker measured it ("nacre.error_l2"), is
// at most `tolerance`; all of them when none is or nothing is known.
void material_set_tolerance(struct material *m, double tolerance);

double mask_at(const struct mask *m, double s, double v); // 0..1

// Radiance towards wo per unit irradiance (normal to the beam) from wi: f cos_i. Both directions
// are unit and in the surface frame; `light` is the light's colour, `diffracts` the mask there.
void material_eval(const struct material *m, struct vec3 wi, struct vec3 wo, const double light[3],
                   double diffracts, double out[3]);

// Single layers, without coat: f cos_i.
void material_diffraction(const struct material *m, struct vec3 wi, struct vec3 wo, double out[3]);
void material_specular(const struct material *m, struct vec3 wi, struct vec3 wo, double out[3]);
bool material_has_specular(const struct material *m);

// The part of light that passes the coat on its way in and out; `in` may be diffuse.
double coat_through(double ior, double cos_i);
double coat_through_diffuse(double ior);

double fresnel_schlick(double r0, double cos_half);  // power reflectance
double fresnel_dielectric(double ior, double cos_i); // exact, unpolarised, from air

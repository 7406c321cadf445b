// shaders.h - the GLSL of render/shaders, embedded at build time.
#pragma once

extern const char shader_screen[]; // vertex: a triangle over the whole target
extern const char shader_tile[];   // vertex: rectangles of the target
extern const char shader_mesh[];   // vertex: triangles of a mesh
extern const char shader_shapes[]; // where a ray meets plane, disc, cylinder, sphere
extern const char shader_lights[];
extern const char shader_layers[];   // diffuse, specular, diffraction, coat
extern const char shader_surround[];   // the environment as a map
extern const char shader_lobes[];      // its rest on lobes
extern const char shader_surrounded[]; // its light on a surface
extern const char shader_surface[];  // fragment: main() of a shape
extern const char shader_backdrop[]; // fragment: main() of what is behind
extern const char shader_mean[];     // fragment: a picture as it is
extern const char shader_lens[];     // fragment: circles of confusion
extern const char shader_env_map[];  // lat-long maps: direction of a pixel, pixel of a direction
extern const char shader_env_pass[]; // fragment: one filter along one axis (R17)
extern const char shader_env_turn[]; // fragment: a map turned

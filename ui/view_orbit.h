// view_orbit.h - where camera and lights stand after the mouse has dragged them.
#pragma once
#include "render/scene.h"
#include "ui/view_params.h"

// The scene's camera, turned about its target by yaw (about `up`) and rise, with its distance
// multiplied and its target moved. Over the pole the picture stays as it is turned.
struct camera orbit_camera(const struct camera *base, const struct params *p);

// A light turned about the camera's target: yaw about its up, rise about its right.
struct light orbit_light(const struct light *base, const struct camera *base_camera,
                         const struct params *p);

// A drag by (dx, dy) parts of the picture's height.
void orbit_drag(struct params *p, double dx, double dy);
void orbit_drag_light(struct params *p, double dx, double dy);
void orbit_pan(struct params *p, double dx, double dy);
void orbit_zoom(struct params *p, double steps);

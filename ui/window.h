// window.h - one window with an OpenGL 3.3 core context, and the events that come to it.
//
// The only user of GLFW. Everything but window_wake() is for the thread that opened the window.
#pragma once
#include "core/err.h"
#include "ui/view_event.h"

struct window;

// Size in points; `scale` is pixels per point, 0: as the screen says. ERR_DEVICE: no display, no
// OpenGL 3.3. Its context is current.
bool window_open(struct window **w, const char *title, int width, int height, double scale,
                 struct err *e);
void window_close(struct window *w); // accepts NULL

// Another window with a context of its own in the place of this one, whose context was lost.
bool window_renew(struct window *w, struct err *e);

double window_scale(const struct window *w);
void window_size(const struct window *w, int *width, int *height); // pixels
void window_resize(struct window *w, int width, int height);       // points
void window_title(struct window *w, const char *title);

// Waits for an event, at most so long (INFINITY: for ever), then takes in all that are there.
void window_wait(struct window *w, double seconds);
void window_wake(void); // ends a wait; from any thread

bool window_next(struct window *w, struct event *e);       // false: none is left
void window_feed(struct window *w, const struct event *e); // as if it had happened; takes e->path
bool window_is_dirty(struct window *w); // it must be drawn again; asking clears it
bool window_wants_close(const struct window *w);
void window_show(struct window *w); // what was drawn

// env_keep.h - the kernel of a sample, kept between frames.
//
// Turning the sample, moving the camera and another environment of the same size leave it as it is.
// It is known by what it was made of (a hash), so that nobody has to say when a table changes.
#pragma once
#include "process/env_exact.h"

struct env_keep; // holds up to 500 MB; more is made anew each time

struct env_keep *env_keep_new(void);
void env_keep_free(struct env_keep *keep);      // accepts NULL
int env_keep_made(const struct env_keep *keep); // kernels so far

// As env_exact, for the window of o around (t, b) that how->span gives. Threads wait for each other
// here; without a keep (NULL) the kernel is made and dropped.
bool env_keep_map(struct env_keep *keep, const struct table *rgb, const struct fresnel *f,
                  const struct env_how *how, const struct environment *env,
                  const struct frame *frame, const double middle[2], int n, struct image *out,
                  struct err *e);

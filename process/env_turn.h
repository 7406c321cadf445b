// env_turn.h - a lat-long map as it is seen from a turned frame.
#pragma once
#include "process/environment.h"

// Each pixel of out is the environment in the direction turned (or turned back).
void env_turn(const struct environment *env, const struct frame *turn, bool back,
              struct image *out);

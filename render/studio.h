// studio.h - a made-up room to render in: soft boxes, a window, bulbs and a floor, as a lat-long
// map.
#pragma once
#include "process/environment.h"

bool studio_map(struct image *map, int h, struct err *e); // 2h x h, linear radiance

// "studio", 512 high, or a map's path.
bool studio_or_file(struct environment *env, const char *name, struct err *e);

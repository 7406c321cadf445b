// studio.h - a made-up room to render in: soft boxes, a window, bulbs and a floor, as a lat-long
// map.
#pragma once
#include "core/image.h"

bool studio_map(struct image *map, int h, struct err *e); // 2h x h, linear radiance

// colormap.h - false colour: a dark-to-bright scale that reads in grey too.
#pragma once

void colormap(double x, unsigned char rgb[3]); // x in 0..1, clipped; NAN gives mid grey

// lens.h - what a lens does to a picture: blur and scattered light.
#pragma once
#include "core/image.h"

// Gaussian blur by direct sums along rows and columns. At the border the kernel is cut and scaled
// to keep its sum 1.
bool lens_blur(struct image *im, int channel, double sigma_px, struct err *e);

// Veiling glare: the share `part` of each pixel's light is spread as radius / (2 pi (r^2 +
// radius^2)^(3/2)), whose integral over the plane is 1; what falls outside the picture is lost.
// Summed over blocks smaller than the radius: the veil is that smooth.
bool lens_glare(struct image *im, double part, double radius_px, struct err *e);

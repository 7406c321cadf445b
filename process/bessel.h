// bessel.h - Bessel functions J_0 .. J_n-1 of one argument, all at once.
#pragma once

// j[n], z >= 0. Miller's backward recurrence: relative to the largest, exact to double rounding.
void bessel_j(double z, int n, double *j);

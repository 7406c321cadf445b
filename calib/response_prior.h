// response_prior.h - what is known of a tone curve before any bracket: it is smooth.
//
// The difference delta of ln X from the sRGB curve is smooth along s = logit(code), where toe and
// shoulder are as wide as the middle. A bracket in even steps is blind to ripples with the period
// of the step (if ln X fits, so does ln X plus any function of that period): only this removes
// them.
#pragma once
#include "calib/normal.h"
#include "calib/response.h"

// Adds the prior for nc curves to equations whose unknown c * 256 + code is delta of channel c:
// delta'' is small, more alike between channels, and delta(128) is 0.
void response_prior(struct normal *s, int nc);

// The curve that the prior and these weights (1 / sigma^2 of ln X at each code) lead to.
bool response_smooth(double log_x[RESPONSE_CODES], const double weight[RESPONSE_CODES],
                     struct err *e);

// bokeh_heights.h - a height field straight from a bokeh photograph or a session of them.
#pragma once
#include "core/hfield.h"

// `source` is a picture, or a session's folder whose bracket `nacre hdr` merges first (beside
// `scratch`, removed again). The record is that of `nacre calib bokeh`.
bool bokeh_heights(struct hfield *hf, const char *source, const char *record, const char *scratch,
                   struct err *e);

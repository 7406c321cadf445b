// fill.h - heights for the nodes that were not measured.
#pragma once
#include "core/hfield.h"

// Every hole becomes the membrane spanned by its rim (the mean of its neighbours everywhere), so a
// tilted plane is continued exactly. Returns the number of nodes filled in *filled. ERR_DATA when
// nothing was measured.
bool hfield_fill(struct hfield *hf, long *filled, struct err *e);

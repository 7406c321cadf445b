// date.h - the dates that files carry.
#pragma once
#include <stdint.h>

// Seconds since 1970, as given; or what SOURCE_DATE_EPOCH fixes every date to, so that the same
// work gives the same bytes on another day (reproducible-builds.org). 0 means: no date.
int64_t date_in_file(int64_t utc_s);

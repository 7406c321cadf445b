// units.h - quantities as people type them: "530nm", "0.25um", "13deg", "1/60s", "600/mm".
//
// A bare number is SI ("5.3e-7" is 530nm). Inside the program everything is SI.
#pragma once
#include "core/err.h"
#include <stddef.h>

enum unit {
    UNIT_NONE,  // a pure number; "1/60" is allowed everywhere
    UNIT_M,     // m mm um µm nm pm
    UNIT_RAD,   // rad mrad deg
    UNIT_S,     // s ms us µs ns min h
    UNIT_PER_M, // /m /mm /um (lines per length)
    UNIT_PX,    // px
    UNIT_HZ,    // Hz kHz MHz
    UNIT_K,     // K
    UNIT_BYTES, // B kB MB GB (powers of 1000), KiB MiB GiB
};

// Parses the whole of `text`; ERR_USAGE with what would be right ("a length such as 530nm").
// Only finite values pass.
bool quantity_parse(const char *text, enum unit unit, double *si, struct err *e);

// "a length such as 530nm": for messages and --help.
const char *unit_example(enum unit unit);

// The value with three to four digits and the unit a person would choose ("532 nm", "16.7 ms").
// Returns buf.
char *quantity_text(double si, enum unit unit, char *buf, size_t size);

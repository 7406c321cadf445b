// cie_data.h - embedded CIE tables; use them through spectrum.h.
#pragma once

enum { CIE_ROWS = 81 }; // 380, 385, ... 780 nm

struct cie_illuminant {
    const char *name; // NULL ends the list
    double power[CIE_ROWS];
};

extern const double cie_observer[CIE_ROWS][3]; // xbar, ybar, zbar
extern const struct cie_illuminant cie_illuminants[];

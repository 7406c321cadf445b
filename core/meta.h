// meta.h - what is known about a product: a short ordered list of named numbers and texts.
//
// Keys are those of the files: "expTime", "isoSpeed", "aperture", "capDate", "chromaticities" and
// "whiteLuminance" are OpenEXR's standard attributes; ours start with "nacre." (docs/formats.md). The
// text "none" for "compression" asks the .exr writer not to compress.
#pragma once
#include <stdbool.h>

struct meta_item {
    char *key;   // owned
    char *text;  // owned; NULL when the item is numbers
    double *num; // [n], owned
    int n;
};

struct meta {
    struct meta_item *item; // [n], owned
    int n;
};

void meta_set_text(struct meta *m, const char *key, const char *text); // replaces; copies
void meta_set_num(struct meta *m, const char *key, double value);
void meta_set_nums(struct meta *m, const char *key, const double *value, int n);
void meta_drop(struct meta *m, const char *key);

const struct meta_item *meta_find(const struct meta *m, const char *key); // NULL: absent
const char *meta_text(const struct meta *m, const char *key);             // NULL: absent or numbers
bool meta_num(const struct meta *m, const char *key, double *value);      // false: absent or text

void meta_copy(struct meta *to, const struct meta *from); // adds all items of `from` to `to`
void meta_finish(struct meta *m);                         // accepts a zeroed struct

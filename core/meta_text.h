// meta_text.h - numbers and metadata as text, for formats that hold "key = value" lines.
#pragma once
#include "core/meta.h"

enum { NUMBER_TEXT = 32 };

// The shortest decimal that reads back as the same double. Returns buf.
char *number_text(double v, char buf[NUMBER_TEXT]);

// The item's value on one line: numbers joined by ", "; line breaks of a text become spaces.
char *meta_value_text(const struct meta_item *it); // free() it

// Its inverse: numbers when all of `value` is numbers, else a text.
void meta_set_value(struct meta *m, const char *key, const char *value);

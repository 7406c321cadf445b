// doc.h - the result of a command while it is being built, and how it is printed.
#pragma once
#include "ui/cli.h"

struct doc *doc_new(void);
void doc_free(struct doc *d);                             // accepts NULL
void doc_print(const struct doc *d, bool json, FILE *to); // aligned "key  value" lines, or JSON

// Reading back: what a command printed under --json. doc_parse gives NULL when text is not a JSON object.
struct doc *doc_parse(const char *text);
double doc_get_num(const struct doc *d, const char *key);       // dots nest; NAN when absent
const char *doc_get_text(const struct doc *d, const char *key); // NULL when absent; lives with d

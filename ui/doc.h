// doc.h - the result of a command while it is being built, and how it is printed.
#pragma once
#include "ui/cli.h"

struct doc *doc_new(void);
void doc_free(struct doc *d);                             // accepts NULL
void doc_print(const struct doc *d, bool json, FILE *to); // aligned "key  value" lines, or JSON

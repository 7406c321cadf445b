// html.h - a report page: headings, figures, tables and commands, in one readable style.
#pragma once
#include "core/err.h"
#include <stdio.h>

struct html {
    FILE *f;    // write more through it; escape() what may hold < or &
    char *text; // owned
    size_t size;
};

void html_open(struct html *h, const char *title, const char *lead);
void html_escape(struct html *h, const char *text);
void html_section(struct html *h, const char *title, const char *text);
void html_picture(struct html *h, const char *file, const char *caption);
void html_command(struct html *h, const char *words); // as typed: "nacre ..."
// Writes the page and frees; path NULL only frees.
bool html_close(struct html *h, const char *path, struct err *e);

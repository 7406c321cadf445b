// words.h - command lines as a person would type them: shown in reports, kept in products, run
// again.
#pragma once

// A word as a shell needs it: in quotes where it holds anything but plain characters. Caller frees.
char *words_quote(const char *word);

// "nacre hdr ..." from a program's arguments, each quoted; the program is always called nacre.
// Caller frees.
char *words_join(int argc, char *const *argv);

// Copies `line` with every "@" and "%" replaced by a word of the caller's, quoted. Caller frees.
char *words_expand(const char *line, const char *at, const char *percent);

// words.c - quoting, so that what is shown can be typed.
#define _GNU_SOURCE
#include "ui/words.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void put_word(FILE *to, const char *word)
{
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                                "_-+=.,:/@%^";
    if (*word && !word[strspn(word, plain)]) {
        fputs(word, to);
        return;
    }
    fputc('\'', to);
    for (; *word; word++)
        if (*word == '\'')
            fputs("'\\''", to);
        else
            fputc(*word, to);
    fputc('\'', to);
}

char *words_quote(const char *word)
{
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    put_word(to, word);
    fclose(to);
    return text;
}

char *words_join(int argc, char *const *argv)
{
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    fputs("nacre", to);
    for (int k = 1; k < argc; k++) {
        fputc(' ', to);
        put_word(to, argv[k]);
    }
    fclose(to);
    return text;
}

char *words_expand(const char *line, const char *at, const char *percent)
{
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    for (; *line; line++)
        if (*line == '@' || *line == '%')
            put_word(to, *line == '@' ? at : percent);
        else
            fputc(*line, to);
    fclose(to);
    return text;
}

// view_script.c - reads the steps of a script.
#define _GNU_SOURCE
#include "ui/view_script.h"
#include "core/mem.h"
#include "core/units.h"
#include "ui/view_keys.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WORDS = 8, DRAG_MOVES = 4 };

static const struct verb {
    const char *name, *usage;
    enum script_verb verb;
    int numbers; // that follow the name
    bool pane, text;
} verbs[] = {
    {"size", "size WIDTH HEIGHT", SCRIPT_SIZE, 2},
    {"move", "move [PANE] X Y", SCRIPT_MOVE, 2, .pane = true},
    {"press", "press left|right|middle", SCRIPT_PRESS, 0, .text = true},
    {"release", "release left|right|middle", SCRIPT_RELEASE, 0, .text = true},
    {"wheel", "wheel STEPS", SCRIPT_WHEEL, 1},
    {"key", "key NAME, such as E, shift+E, ctrl+Z, left", SCRIPT_KEY, 0, .text = true},
    {"type", "type TEXT", SCRIPT_TYPE, 0, .text = true},
    {"set", "set VALUE PARAMETER", SCRIPT_SET, 1, .text = true},
    {"select", "select NUMBER", SCRIPT_SELECT, 1},
    {"open", "open FILE", SCRIPT_OPEN, 0, .text = true},
    {"wait", "wait SECONDS", SCRIPT_WAIT, 1},
    {"settle", "settle", SCRIPT_SETTLE, 0},
    {"screenshot", "screenshot FILE.png", SCRIPT_SCREENSHOT, 0, .text = true},
    {"save", "save FILE", SCRIPT_SAVE, 0, .text = true},
    {"turntable", "turntable COUNT FOLDER", SCRIPT_TURNTABLE, 1, .text = true},
    {"measure", "measure", SCRIPT_MEASURE, 0},
    {"lose", "lose", SCRIPT_LOSE, 0},
    {"print", "print", SCRIPT_PRINT, 0},
    {"quit", "quit", SCRIPT_QUIT, 0},
};

static struct script_step *add(struct script *s, const struct script_step *step)
{
    s->step = xrealloc(s->step, (size_t)s->n + 1, sizeof *s->step);
    s->step[s->n] = *step;
    return &s->step[s->n++];
}

static bool is_pane(const char *word)
{
    return !strcmp(word, "picture") || !strcmp(word, "table") || !strcmp(word, "material");
}

static bool button_of(const char *word, int *button)
{
    static const char *const names[] = {"left", "right", "middle"};
    for (int k = 0; k < BUTTONS; k++)
        if (!strcmp(word, names[k])) {
            *button = k;
            return true;
        }
    return false;
}

static bool numbers(char *const *word, int n, double *out, struct err *e)
{
    for (int k = 0; k < n; k++)
        if (!quantity_parse(word[k], UNIT_S, &out[k], e) &&
            !quantity_parse(word[k], UNIT_NONE, &out[k], e))
            return false;
    return true;
}

static bool add_drag(struct script *s, char *const *word, int n, int line, struct err *e)
{
    struct script_step step = {.line = line, .button = BUTTON_LEFT};
    double at[4];
    if (n > 0 && is_pane(word[0])) {
        snprintf(step.pane, sizeof step.pane, "%s", word[0]);
        word++;
        n--;
    }
    if (n < 4 || n > 5 || !numbers(word, 4, at, e) || (n == 5 && !button_of(word[4], &step.button)))
        return err_set(e, ERR_DATA, "must be: drag [PANE] X0 Y0 X1 Y1 [left|right|middle]");
    for (int k = 0; k <= DRAG_MOVES; k++) {
        step.verb = SCRIPT_MOVE;
        for (int c = 0; c < 2; c++)
            step.num[c] = at[c] + k * (at[c + 2] - at[c]) / DRAG_MOVES;
        add(s, &step);
        step.verb = k ? SCRIPT_RELEASE : SCRIPT_PRESS;
        if (k == 0 || k == DRAG_MOVES)
            add(s, &step);
    }
    return true;
}

static bool check_text(struct script_step *step, struct err *e)
{
    switch (step->verb) {
    case SCRIPT_PRESS:
    case SCRIPT_RELEASE:
        return button_of(step->text, &step->button) ||
               err_set(e, ERR_DATA, "'%.40s' is not left, right or middle", step->text);
    case SCRIPT_KEY:
        return key_parse(step->text, &step->key, &step->mods) ||
               err_set(e, ERR_DATA, "'%.40s' is not a key", step->text);
    default: return true;
    }
}

// The words behind `skip` of them, as they stand in the line.
static const char *rest(const char *line, int skip)
{
    line += strspn(line, " \t");
    while (skip-- > 0) {
        line += strcspn(line, " \t");
        line += strspn(line, " \t");
    }
    return line;
}

static bool add_line(struct script *s, const char *line, int number, struct err *e)
{
    char copy[500], *word[WORDS + 1], *save = NULL;
    int n = 0;
    snprintf(copy, sizeof copy, "%s", line);
    for (char *t = strtok_r(copy, " \t", &save); t && n < WORDS; t = strtok_r(NULL, " \t", &save))
        word[n++] = t;
    if (!n || word[0][0] == '#')
        return true;
    if (!strcmp(word[0], "drag"))
        return add_drag(s, word + 1, n - 1, number, e);
    for (size_t k = 0; k < sizeof verbs / sizeof *verbs; k++) {
        const struct verb *v = &verbs[k];
        if (strcmp(v->name, word[0]))
            continue;
        struct script_step step = {.verb = v->verb, .line = number};
        int at = 1;
        if (v->pane && n > 1 && is_pane(word[1]))
            snprintf(step.pane, sizeof step.pane, "%s", word[at++]);
        const bool enough = v->text ? n > at + v->numbers : n == at + v->numbers;
        if (!enough || !numbers(word + at, v->numbers, step.num, e))
            return err_set(e, ERR_DATA, "must be: %s", v->usage);
        if (v->text)
            snprintf(step.text, sizeof step.text, "%s", rest(line, at + v->numbers));
        if (!check_text(&step, e))
            return false;
        add(s, &step);
        return true;
    }
    return err_set(e, ERR_DATA, "'%.40s' is not a step of a script", word[0]);
}

bool script_read(struct script *s, const char *path, struct err *e)
{
    FILE *f = fopen(path, "r");
    if (!f)
        return err_errno(e, "%s", path);
    struct script all = {0};
    char *line = NULL;
    size_t room = 0;
    bool ok = true;
    for (int number = 1; ok && getline(&line, &room, f) >= 0; number++) {
        line[strcspn(line, "\n")] = 0;
        ok = add_line(&all, line, number, e) || err_in(e, "%s:%d", path, number);
    }
    free(line);
    fclose(f);
    if (ok)
        *s = all;
    else
        script_finish(&all);
    return ok;
}

void script_finish(struct script *s)
{
    free(s->step);
    *s = (struct script){0};
}

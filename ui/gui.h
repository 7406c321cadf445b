// gui.h - Dear ImGui as C sees it: what happened goes in, panels come out, the GPU draws them.
//
// One thread, one context. Lengths are pixels of the window; what is said in points is multiplied
// by the scale that gui_open() was given. Colours are 0xAABBGGRR.
#pragma once
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

struct gui_rect {
    double x, y, w, h; // pixels, y down
};

// Needs a current GL context. `font` is a .ttf; NULL or absent: the built-in one, ASCII only.
bool gui_open(double scale, const char *font);
void gui_close(void);

// --- what happened ---
void gui_mouse(double x, double y);
void gui_button(int button, bool down);   // 0 left, 1 right, 2 middle
void gui_wheel(double steps);             // > 0 away from the person
void gui_key(int key, int mods, bool on); // view_event.h
void gui_text_in(unsigned codepoint);
bool gui_wants_mouse(void);  // a panel is under it, or holds it
bool gui_wants_keys(void);   // a text is being typed
bool gui_is_held(void);      // a slider is being dragged
bool gui_wants_frames(void); // a frame more will look different: something just opened

// --- a frame ---
void gui_begin(int w, int h, double seconds);
void gui_end(void); // draws into the current framebuffer

bool gui_panel(const char *title, struct gui_rect at, bool plain); // plain: no background
void gui_panel_end(void);
void gui_popup(const char *title, double w, double h); // a panel in the middle, on top
bool gui_section(const char *title, bool open);
double gui_line_height(void);

void gui_text(const char *text);
void gui_note(const char *text); // dim, wrapped
void gui_warn(const char *text); // wrapped
void gui_fact(const char *name, const char *value);
void gui_space(void);
void gui_beside(void); // the next one on the same line
bool gui_press(const char *label);
bool gui_check(const char *label, bool *on);
bool gui_pick(const char *label, bool chosen); // a line of a list
bool gui_choice(const char *label, const char *zero_separated, int *k);
bool gui_number(const char *label, double *v, double lo, double hi, const char *format, bool log);
bool gui_whole(const char *label, int *v, int lo, int hi);
void gui_curve(const float *y, int n, float top, double high);
void gui_hint(const char *text); // over the last one, when the mouse rests there

// --- over the pictures, below the panels; clipped to what gui_clip() said ---
void gui_clip(struct gui_rect r);
void gui_unclip(void);
void gui_line(double x0, double y0, double x1, double y1, unsigned color, double width);
void gui_circle(double x, double y, double radius, unsigned color, double width);
void gui_fill(struct gui_rect r, unsigned color);
void gui_say(double x, double y, unsigned color, const char *text);
double gui_say_width(const char *text);

#ifdef __cplusplus
}
#endif

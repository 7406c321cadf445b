// window.c - GLFW: its callbacks become a queue of events.
#define _GNU_SOURCE
#define GLFW_INCLUDE_NONE
#include "ui/window.h"
#include "core/mem.h"
#include <GLFW/glfw3.h>
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { QUEUE = 1024 };

struct window {
    GLFWwindow *glfw;
    double scale;
    struct event queue[QUEUE];
    unsigned first, last; // counts; places are modulo QUEUE
    bool dirty;
};

static void push(struct window *w, struct event e)
{
    if (w->last - w->first < QUEUE)
        w->queue[w->last++ % QUEUE] = e;
    else
        free(e.path);
}

void window_feed(struct window *w, const struct event *e)
{
    push(w, *e);
}

bool window_next(struct window *w, struct event *e)
{
    if (w->first == w->last)
        return false;
    *e = w->queue[w->first++ % QUEUE];
    return true;
}

static int mods_of(int glfw)
{
    return (glfw & GLFW_MOD_SHIFT ? MOD_SHIFT : 0) | (glfw & GLFW_MOD_CONTROL ? MOD_CTRL : 0) |
           (glfw & GLFW_MOD_ALT ? MOD_ALT : 0);
}

static int key_of(int key, int scancode)
{
    static const struct {
        int glfw, key;
    } others[] = {{GLFW_KEY_ESCAPE, KEY_ESCAPE},
                  {GLFW_KEY_ENTER, KEY_ENTER},
                  {GLFW_KEY_KP_ENTER, KEY_ENTER},
                  {GLFW_KEY_TAB, KEY_TAB},
                  {GLFW_KEY_BACKSPACE, KEY_BACKSPACE},
                  {GLFW_KEY_DELETE, KEY_DELETE},
                  {GLFW_KEY_LEFT, KEY_LEFT},
                  {GLFW_KEY_RIGHT, KEY_RIGHT},
                  {GLFW_KEY_UP, KEY_UP},
                  {GLFW_KEY_DOWN, KEY_DOWN},
                  {GLFW_KEY_HOME, KEY_HOME},
                  {GLFW_KEY_END, KEY_END},
                  {GLFW_KEY_F1, KEY_F1},
                  {GLFW_KEY_F12, KEY_F12},
                  {GLFW_KEY_SPACE, ' '}};
    for (size_t k = 0; k < sizeof others / sizeof *others; k++)
        if (others[k].glfw == key)
            return others[k].key;
    if (key >= GLFW_KEY_0 && key <= GLFW_KEY_9)
        return key;
    const char *name = glfwGetKeyName(key, scancode);
    return name && name[0] > 0 && !name[1] ? toupper((unsigned char)name[0]) : 0;
}

static void on_key(GLFWwindow *g, int key, int scancode, int action, int mods)
{
    const struct event e = {.kind = EVENT_KEY,
                            .key = key_of(key, scancode),
                            .mods = mods_of(mods),
                            .down = action != GLFW_RELEASE};
    if (e.key)
        push(glfwGetWindowUserPointer(g), e);
}

static void on_char(GLFWwindow *g, unsigned codepoint)
{
    struct window *w = glfwGetWindowUserPointer(g);
    push(w, (struct event){.kind = EVENT_TEXT, .codepoint = codepoint});
    if (codepoint == '?')
        push(w, (struct event){.kind = EVENT_KEY, .key = '?', .down = true});
}

static void on_mouse(GLFWwindow *g, double x, double y)
{
    int w, h, pw, ph; // the mouse may count in other units than pixels
    glfwGetWindowSize(g, &w, &h);
    glfwGetFramebufferSize(g, &pw, &ph);
    push(glfwGetWindowUserPointer(g),
         (struct event){.kind = EVENT_MOUSE, .x = x * pw / (w ? w : 1), .y = y * ph / (h ? h : 1)});
}

static void on_button(GLFWwindow *g, int button, int action, int mods)
{
    static const int ours[] = {BUTTON_LEFT, BUTTON_RIGHT, BUTTON_MIDDLE};
    if (button < BUTTONS)
        push(glfwGetWindowUserPointer(g), (struct event){.kind = EVENT_BUTTON,
                                                         .button = ours[button],
                                                         .mods = mods_of(mods),
                                                         .down = action == GLFW_PRESS});
}

static void on_wheel(GLFWwindow *g, double x, double y)
{
    (void)x;
    push(glfwGetWindowUserPointer(g), (struct event){.kind = EVENT_WHEEL, .y = y});
}

static void on_drop(GLFWwindow *g, int n, const char **path)
{
    for (int k = 0; k < n; k++)
        push(glfwGetWindowUserPointer(g),
             (struct event){.kind = EVENT_DROP, .path = xstrdup(path[k])});
}

static void on_refresh(GLFWwindow *g)
{
    ((struct window *)glfwGetWindowUserPointer(g))->dirty = true;
}

static void on_resize(GLFWwindow *g, int width, int height)
{
    (void)width;
    (void)height;
    on_refresh(g);
}

static void listen(GLFWwindow *g)
{
    glfwSetKeyCallback(g, on_key);
    glfwSetCharCallback(g, on_char);
    glfwSetCursorPosCallback(g, on_mouse);
    glfwSetMouseButtonCallback(g, on_button);
    glfwSetScrollCallback(g, on_wheel);
    glfwSetDropCallback(g, on_drop);
    glfwSetWindowRefreshCallback(g, on_refresh);
    glfwSetFramebufferSizeCallback(g, on_resize);
}

static bool fail(struct err *e, const char *what)
{
    const char *why = NULL;
    glfwGetError(&why);
    err_set(e, ERR_DEVICE, "%s (%s)", what, why ? why : "GLFW does not say why");
    glfwTerminate();
    return false;
}

static double scale_of_screen(void)
{
    GLFWmonitor *screen = glfwGetPrimaryMonitor();
    float x = 1, y = 1;
    if (screen)
        glfwGetMonitorContentScale(screen, &x, &y);
    return fmax(1, fmin(4, (double)x));
}

// Its context is current. It is lost when the card is reset (render/gl.h), if the driver tells
// that.
static GLFWwindow *make(const char *title, int w, int h)
{
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    GLFWwindow *g = NULL;
    for (int told = 1; told >= 0 && !g; told--) {
        glfwWindowHint(GLFW_CONTEXT_ROBUSTNESS,
                       told ? GLFW_LOSE_CONTEXT_ON_RESET : GLFW_NO_ROBUSTNESS);
        g = glfwCreateWindow(w, h, title, NULL, NULL);
    }
    if (!g)
        return NULL;
    glfwMakeContextCurrent(g);
    glfwSwapInterval(1);
    return g;
}

bool window_open(struct window **out, const char *title, int width, int height, double scale,
                 struct err *e)
{
    if (!glfwInit())
        return fail(e, "no display to open a window on");
    const double s = scale > 0 ? scale : scale_of_screen();
    GLFWwindow *g = make(title, (int)lround(width * s), (int)lround(height * s));
    if (!g)
        return fail(e, "no window with OpenGL 3.3");
    struct window *w = xcalloc(1, sizeof *w);
    *w = (struct window){.glfw = g, .scale = s, .dirty = true};
    glfwSetWindowUserPointer(g, w);
    listen(g);
    *out = w;
    return true;
}

bool window_renew(struct window *w, struct err *e)
{
    int width, height;
    glfwGetWindowSize(w->glfw, &width, &height);
    GLFWwindow *g = make("nacre", width, height);
    if (!g)
        return err_set(e, ERR_DEVICE, "no other window with OpenGL 3.3");
    glfwDestroyWindow(w->glfw);
    w->glfw = g;
    w->dirty = true;
    glfwSetWindowUserPointer(g, w);
    listen(g);
    return true;
}

void window_close(struct window *w)
{
    if (!w)
        return;
    struct event e;
    while (window_next(w, &e))
        free(e.path);
    glfwDestroyWindow(w->glfw);
    glfwTerminate();
    free(w);
}

double window_scale(const struct window *w)
{
    return w->scale;
}

void window_size(const struct window *w, int *width, int *height)
{
    glfwGetFramebufferSize(w->glfw, width, height);
}

void window_resize(struct window *w, int width, int height)
{
    glfwSetWindowSize(w->glfw, (int)lround(width * w->scale), (int)lround(height * w->scale));
    w->dirty = true;
}

void window_title(struct window *w, const char *title)
{
    glfwSetWindowTitle(w->glfw, title);
}

void window_wait(struct window *w, double seconds)
{
    if (w->first != w->last || seconds <= 0)
        glfwPollEvents();
    else if (isinf(seconds))
        glfwWaitEvents();
    else
        glfwWaitEventsTimeout(seconds);
}

void window_wake(void)
{
    glfwPostEmptyEvent();
}

bool window_is_dirty(struct window *w)
{
    const bool dirty = w->dirty;
    w->dirty = false;
    return dirty;
}

bool window_wants_close(const struct window *w)
{
    return glfwWindowShouldClose(w->glfw);
}

void window_show(struct window *w)
{
    glfwSwapBuffers(w->glfw);
}

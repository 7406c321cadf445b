// gl_context.c - a GL context where there is no display: EGL on no surface.
#define _GNU_SOURCE
#include "core/mem.h"
#include "render/gl.h"
#include <epoxy/egl.h>
#include <stdlib.h>

struct gl_context {
    EGLDisplay display;
    EGLContext context;
};

static const char remedy[] = "install libegl1 and libgl1-mesa-dri, or use --backend cpu";

// Mesa's surfaceless platform needs neither a display nor a device file; others may have a default.
static EGLDisplay any_display(void)
{
    static const EGLenum platforms[] = {EGL_PLATFORM_SURFACELESS_MESA, EGL_PLATFORM_DEVICE_EXT};
    for (size_t k = 0; k < sizeof platforms / sizeof *platforms; k++) {
        if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, k ? "EGL_EXT_platform_device"
                                                       : "EGL_MESA_platform_surfaceless"))
            continue;
        EGLDisplay d = eglGetPlatformDisplayEXT(platforms[k], EGL_DEFAULT_DISPLAY, NULL);
        if (d != EGL_NO_DISPLAY && eglInitialize(d, NULL, NULL))
            return d;
    }
    EGLDisplay d = eglGetDisplay(EGL_DEFAULT_DISPLAY);
    return d != EGL_NO_DISPLAY && eglInitialize(d, NULL, NULL) ? d : EGL_NO_DISPLAY;
}

// Asks to be told when the driver is reset (gl_alive), if the driver does that.
static EGLContext make_context(EGLDisplay display)
{
    EGLContext context = EGL_NO_CONTEXT;
    for (int told = 1; told >= 0 && context == EGL_NO_CONTEXT; told--) {
        const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                     3, //
                                     EGL_CONTEXT_MINOR_VERSION,
                                     3, //
                                     EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                     EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                     told ? EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY
                                          : EGL_NONE,
                                     EGL_LOSE_CONTEXT_ON_RESET,
                                     EGL_NONE};
        context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    }
    return context;
}

bool gl_context_open(struct gl_context **out, struct err *e)
{
    if (!epoxy_has_egl())
        return err_set(e, ERR_DEVICE, "no OpenGL: libEGL is missing; %s", remedy);
    EGLDisplay display = any_display();
    if (display == EGL_NO_DISPLAY)
        return err_set(e, ERR_DEVICE, "no OpenGL: EGL has no usable display; %s", remedy);
    EGLContext context = EGL_NO_CONTEXT;
    if (eglBindAPI(EGL_OPENGL_API))
        context = make_context(display);
    if (context == EGL_NO_CONTEXT ||
        !eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
        return err_set(e, ERR_DEVICE, "no OpenGL 3.3 core context (EGL error %#x); %s",
                       (unsigned)eglGetError(), remedy);
    }
    struct gl_context *c = xcalloc(1, sizeof *c);
    *c = (struct gl_context){display, context};
    if (!gl_check(e)) {
        gl_context_close(c);
        return false;
    }
    *out = c;
    return true;
}

void gl_context_close(struct gl_context *c)
{
    if (!c)
        return;
    eglMakeCurrent(c->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(c->display, c->context);
    free(c); // the display is the process's own, and the next context finds it open
}

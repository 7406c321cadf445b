// show_gl.c - one triangle over the pane, one shader.
#define _GNU_SOURCE
#include "ui/show_gl.h"
#include "core/colormap.h"
#include "core/mem.h"
#include "render/view.h"
#include <math.h>
#include <stdlib.h>

struct show_gl {
    GLuint program, nothing, colors;
};

static const char vertex[] = "void main()\n"
                             "{\n"
                             "    vec2 at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;\n"
                             "    gl_Position = vec4(at, 0.0, 1.0);\n"
                             "}\n";

// The curve of render/display.h, for a GPU.
static const char display[] =
    "float luminance(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }\n"
    "vec3 tone(vec3 c)\n"
    "{\n"
    "    float y = max(0.0, luminance(c)), least = min(c.r, min(c.g, c.b));\n"
    "    c = mix(vec3(y), c, least < 0.0 ? y / (y - least) : 1.0);\n"
    "    float most = max(c.r, max(c.g, c.b)), over = (most - 0.8) / 0.2;\n"
    "    if (most > 0.8) {\n"
    "        float fade = 1.0 - exp(-over / 40.0);\n"
    "        c = (1.0 - 0.2 * exp(-over)) * mix(c / most, vec3(1.0), fade);\n"
    "    }\n"
    "    return max(c, 0.0);\n"
    "}\n"
    "vec3 encode(vec3 c)\n"
    "{\n"
    "    c = clamp(c, 0.0, 1.0);\n"
    "    vec3 low = 12.92 * c, high = 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055;\n"
    "    return mix(high, low, vec3(lessThanEqual(c, vec3(0.0031308))));\n"
    "}\n";

static const char fragment[] =
    "uniform sampler2D picture, other, colors;\n"
    "uniform vec2 size, middle, pane_at, pane_size;\n"
    "uniform float zoom, power, upwards, exposure, offset, decades, peak, split, white;\n"
    "uniform int look, compare, zebra;\n"
    "out vec4 color;\n"
    "vec3 fetch(sampler2D from, vec2 q)\n"
    "{\n"
    "    if (power > 1.0) {\n"
    "        vec2 s = 2.0 * q / size - 1.0;\n"
    "        s = sign(s) * pow(abs(s), vec2(1.0 / power));\n"
    "        q = (s + 1.0) / 2.0 * (size - 1.0) + 0.5;\n"
    "    }\n"
    "    if (upwards > 0.5)\n"
    "        q.y = size.y - q.y;\n"
    "    if (zoom >= 1.0 && power == 1.0)\n"
    "        return texelFetch(from, ivec2(clamp(q, vec2(0.0), size - 1.0)), 0).rgb;\n"
    "    return textureLod(from, q / size, max(0.0, -log2(zoom))).rgb;\n"
    "}\n"
    // As display_dither() does for files.
    "vec3 dither(vec3 c, vec2 p)\n"
    "{\n"
    "    p = floor(p);\n"
    "    float y = fract(52.9829189 * fract(0.06711056 * p.x + 0.00583715 * p.y));\n"
    "    return mix(c, c + (y - 0.5) / 255.0, vec3(greaterThan(c, vec3(0.0))));\n"
    "}\n"
    "vec3 heat(float value)\n"
    "{\n"
    "    float x = value > 0.0 && peak > 0.0 ? 1.0 + log(value / peak) / log(10.0) / decades : "
    "0.0;\n"
    "    return texture(colors, vec2((clamp(x, 0.0, 1.0) * 255.0 + 0.5) / 256.0, 0.5)).rgb;\n"
    "}\n"
    "void main()\n"
    "{\n"
    "    vec2 p = gl_FragCoord.xy - pane_at;\n"
    "    p.y = pane_size.y - p.y;\n"
    "    vec2 q = middle + (p - pane_size / 2.0) / zoom;\n"
    "    color = vec4(0.07, 0.073, 0.08, 1.0);\n"
    "    if (any(lessThan(q, vec2(0.0))) || any(greaterThanEqual(q, size)))\n"
    "        return;\n"
    "    vec3 a = fetch(picture, q);\n"
    "    bool right = compare == 1 && p.x > split * pane_size.x;\n"
    "    if (right)\n"
    "        a = fetch(other, q);\n"
    "    if (any(isnan(a)))\n"
    "        color.rgb = vec3(0.35);\n"
    "    else if (compare == 2) {\n"
    "        vec3 d = abs(a - fetch(other, q));\n"
    "        color.rgb = heat(max(d.r, max(d.g, d.b)));\n"
    "    } else if (look == 1)\n"
    "        color.rgb = heat(luminance(a));\n"
    "    else\n"
    "        color.rgb = dither(encode(tone(a * exposure + offset)), p);\n"
    "    if (zebra == 1 && white > 0.0 && max(a.r, max(a.g, a.b)) >= white)\n"
    "        color.rgb = mod(p.x + p.y, 10.0) < 5.0 ? vec3(0.95, 0.1, 0.1) : vec3(0.1);\n"
    "}\n";

bool show_gl_open(struct show_gl **out, struct err *e)
{
    struct show_gl *g = xcalloc(1, sizeof *g);
    g->program = gl_program("show", "", (const char *const[]){vertex, NULL},
                            (const char *const[]){display, fragment, NULL}, e);
    if (!g->program) {
        free(g);
        return false;
    }
    unsigned char map[256][3];
    for (int k = 0; k < 256; k++)
        colormap(k / 255.0, map[k]);
    g->colors = gl_texture(GL_TEXTURE_2D, GL_LINEAR);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, 256, 1, 0, GL_RGB, GL_UNSIGNED_BYTE, map);
    glGenVertexArrays(1, &g->nothing);
    *out = g;
    return true;
}

void show_gl_close(struct show_gl *g)
{
    if (!g)
        return;
    glDeleteProgram(g->program);
    glDeleteTextures(1, &g->colors);
    glDeleteVertexArrays(1, &g->nothing);
    free(g);
}

// Three channels of float, of whatever the picture has.
static float *to_rgb(const struct image *im)
{
    const size_t n = (size_t)im->w * (size_t)im->h, nc = (size_t)im->nc;
    float *rgb = malloc(n * 3 * sizeof *rgb);
    for (size_t k = 0; k < n && rgb; k++)
        for (size_t c = 0; c < 3; c++)
            rgb[3 * k + c] = im->px[k * nc + (nc < 3 ? 0 : c)];
    return rgb;
}

void shown_upload(struct shown *s, const struct image *im)
{
    float *rgb = to_rgb(im);
    if (!rgb)
        return;
    if (!s->texture) {
        s->texture = gl_texture(GL_TEXTURE_2D, GL_LINEAR);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    }
    glBindTexture(GL_TEXTURE_2D, s->texture);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB32F, im->w, im->h, 0, GL_RGB, GL_FLOAT, rgb);
    glGenerateMipmap(GL_TEXTURE_2D);
    const struct image view = {.w = im->w, .h = im->h, .nc = 3, .px = rgb};
    s->peak = view_peak(&view);
    s->w = im->w;
    s->h = im->h;
    s->power = s->power ? s->power : 1;
    free(rgb);
}

void shown_finish(struct shown *s)
{
    glDeleteTextures(1, &s->texture);
    *s = (struct shown){0};
}

void show_gl_draw(const struct show_gl *g, const struct shown *s, const struct placing *at,
                  struct gui_rect pane, int high, const struct params *p)
{
    const GLuint o = g->program;
    const double y = high - pane.y - pane.h; // from below, as OpenGL counts
    const int compare = s->other ? (int)p->v[PARAM_COMPARE] : COMPARE_NONE;
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, (int)(pane.x + pane.w) + 1, high);
    glEnable(GL_SCISSOR_TEST);
    glScissor((int)pane.x, (int)y, (int)pane.w, (int)pane.h);
    glUseProgram(o);
    gl_bind(o, "picture", 0, GL_TEXTURE_2D, s->texture);
    gl_bind(o, "other", 1, GL_TEXTURE_2D, s->other ? s->other : s->texture);
    gl_bind(o, "colors", 2, GL_TEXTURE_2D, g->colors);
    gl_set2f(o, "size", s->w, s->h);
    gl_set2f(o, "middle", at->x, at->y);
    gl_set2f(o, "pane_at", pane.x, y);
    gl_set2f(o, "pane_size", pane.w, pane.h);
    gl_set1f(o, "zoom", at->zoom);
    gl_set1f(o, "power", s->power);
    gl_set1f(o, "upwards", s->upwards);
    gl_set1f(o, "exposure", exp2(p->v[PARAM_EXPOSURE] + s->ev));
    gl_set1f(o, "offset", p->v[PARAM_OFFSET]);
    gl_set1f(o, "decades", p->v[PARAM_DECADES]);
    gl_set1f(o, "peak", s->peak);
    gl_set1f(o, "split", p->v[PARAM_SPLIT]);
    gl_set1f(o, "white", s->white);
    gl_set1i(o, "look", (int)p->v[PARAM_LOOK]);
    gl_set1i(o, "compare", compare);
    gl_set1i(o, "zebra", (int)p->v[PARAM_ZEBRA]);
    glBindVertexArray(g->nothing);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glDisable(GL_SCISSOR_TEST);
    glActiveTexture(GL_TEXTURE0);
}

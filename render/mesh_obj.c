// mesh_obj.c - Wavefront OBJ: v, vt, vn, f; polygons become fans, other lines are passed over.
#define _GNU_SOURCE
#include "core/mem.h"
#include "render/mesh.h"
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct obj {
    const char *path;
    int line;
    struct vec3 *v, *vt, *vn; // owned
    int n_v, n_vt, n_vn;
    int (*corner)[3]; // [n_corners] v, vt, vn of each corner of a triangle; -1: none; owned
    int n_corners;
};

static void *grow(void *p, int n, size_t size)
{
    return n & (n - 1) ? p : xrealloc(p, n ? 2 * (size_t)n : 1, size); // at powers of two
}

static bool bad(const struct obj *o, struct err *e, const char *what)
{
    return err_set(e, ERR_DATA, "%s:%d: %s", o->path, o->line, what);
}

static bool add_vec(const struct obj *o, struct vec3 **list, int *n, const char *text, int need,
                    struct err *e)
{
    double x[3] = {0};
    char *end;
    for (int k = 0; k < 3; k++) {
        x[k] = strtod(text, &end);
        if (end == text && k < need)
            return bad(o, e, "expected numbers");
        if (!isfinite(x[k]))
            return bad(o, e, "holds NaN or infinity");
        text = end;
    }
    if (*n >= MESH_MOST)
        return bad(o, e, "more than 20 million entries");
    *list = grow(*list, *n, sizeof **list);
    (*list)[(*n)++] = v3(x[0], x[1], x[2]);
    return true;
}

// "7", "7/2", "7//3" or "7/2/3"; negative ones count from the end.
static bool read_corner(const struct obj *o, char **text, int corner[3], struct err *e)
{
    const int count[3] = {o->n_v, o->n_vt, o->n_vn};
    for (int k = 0; k < 3; k++) {
        corner[k] = -1;
        if (k && **text != '/')
            continue;
        *text += k > 0;
        if (k && (**text == '/' || !strchr("-0123456789", **text)))
            continue;
        char *end;
        const long at = strtol(*text, &end, 10);
        if (end == *text || at == 0 || at > count[k] || at < -count[k])
            return bad(o, e, "a corner that does not exist");
        corner[k] = (int)(at > 0 ? at - 1 : at + count[k]);
        *text = end;
    }
    return true;
}

static bool add_face(struct obj *o, char *text, struct err *e)
{
    int first[3], before[3], now[3];
    int n = 0;
    for (;; n++) {
        text += strspn(text, " \t\r\n");
        if (!*text)
            break;
        if (!read_corner(o, &text, now, e))
            return false;
        if (n >= 2) {
            if (o->n_corners > 3 * (MESH_MOST - 1))
                return bad(o, e, "more than 20 million triangles");
            for (int c = 0; c < 3; c++) {
                o->corner = grow(o->corner, o->n_corners, sizeof *o->corner);
                memcpy(o->corner[o->n_corners++],
                       c == 0   ? first
                       : c == 1 ? before
                                : now,
                       sizeof now);
            }
        }
        memcpy(n ? before : first, now, sizeof now);
        if (!n)
            memcpy(before, now, sizeof now);
    }
    return n >= 3 || bad(o, e, "a face needs 3 corners");
}

static bool read_line(struct obj *o, char *line, struct err *e)
{
    line += strspn(line, " \t");
    if (!strncmp(line, "v ", 2))
        return add_vec(o, &o->v, &o->n_v, line + 2, 3, e);
    if (!strncmp(line, "vt ", 3))
        return add_vec(o, &o->vt, &o->n_vt, line + 3, 1, e);
    if (!strncmp(line, "vn ", 3))
        return add_vec(o, &o->vn, &o->n_vn, line + 3, 3, e);
    return strncmp(line, "f ", 2) || add_face(o, line + 2, e);
}

static int order(const void *a, const void *b, void *corners)
{
    const int(*c)[3] = corners;
    return memcmp(c[*(const int *)a], c[*(const int *)b], sizeof *c);
}

// Corners that agree in all three indices become one vertex.
static void join(const struct obj *o, double scale, struct mesh *m)
{
    const int n = o->n_corners;
    int *rank = xcalloc((size_t)n + 1, sizeof *rank);
    for (int k = 0; k < n; k++)
        rank[k] = k;
    qsort_r(rank, (size_t)n, sizeof *rank, order, o->corner);
    m->n_triangles = n / 3;
    m->triangle = xcalloc((size_t)m->n_triangles + 1, sizeof *m->triangle);
    m->vertex = xcalloc((size_t)n + 1, sizeof *m->vertex);
    for (int k = 0; k < n; k++) {
        const int *c = o->corner[rank[k]];
        if (!k || memcmp(c, o->corner[rank[k - 1]], sizeof *o->corner)) {
            struct mesh_vertex *v = &m->vertex[m->n_vertices++];
            *v = (struct mesh_vertex){.at_m = v3_scale(scale, o->v[c[0]])};
            if (c[1] >= 0) {
                v->s = o->vt[c[1]].x;
                v->v = o->vt[c[1]].y;
            }
            if (c[2] >= 0)
                v->n = o->vn[c[2]];
        }
        m->triangle[rank[k] / 3][rank[k] % 3] = m->n_vertices - 1;
    }
    free(rank);
}

bool mesh_read_obj(struct mesh *out, const char *path, double scale, const struct vec3 *tangent,
                   struct err *e)
{
    FILE *f = fopen(path, "r");
    if (!f)
        return err_errno(e, "%s", path);
    struct obj o = {.path = path};
    char *line = NULL;
    size_t room = 0;
    bool ok = true;
    while (ok && getline(&line, &room, f) >= 0) {
        o.line++;
        ok = read_line(&o, line, e);
    }
    if (ok && ferror(f))
        ok = err_errno(e, "%s", path);
    fclose(f);
    free(line);
    struct mesh m = {0};
    if (ok) {
        bool has_st = o.n_corners > 0;
        for (int k = 0; k < o.n_corners && has_st; k++)
            has_st = o.corner[k][1] >= 0;
        join(&o, scale, &m);
        ok = mesh_complete(&m, path, has_st, tangent, e);
    }
    free(o.v);
    free(o.vt);
    free(o.vn);
    free(o.corner);
    if (!ok) {
        mesh_finish(&m);
        return false;
    }
    *out = m;
    return true;
}

// light.c - the point nearest to lines, and the light record.
#define _GNU_SOURCE
#include "calib/light.h"
#include "calib/normal.h"
#include <string.h>

// Distance of a point from a line, as three equations: (I - d d^T)(x - from) = 0.
static void add_line(struct normal *n, const struct line *line)
{
    const double d[3] = {line->along.x, line->along.y, line->along.z};
    const double from[3] = {line->from_m.x, line->from_m.y, line->from_m.z};
    for (int r = 0; r < 3; r++) {
        double x[3], y = 0;
        for (int c = 0; c < 3; c++) {
            x[c] = (r == c) - d[r] * d[c];
            y += x[c] * from[c];
        }
        normal_add(n, 3, (int[]){0, 1, 2}, x, y, 1);
    }
}

static double distance(const struct line *line, struct vec3 x)
{
    return v3_norm(v3_cross(line->along, v3_sub(x, line->from_m)));
}

bool light_from_lines(struct light *out, const struct line *line, int n, struct err *e)
{
    double widest = 0;
    if (n < 2)
        return err_set(e, ERR_DATA,
                       "one picture tells only the direction of the light: needs 2 or more, with "
                       "the mirror in other places");
    for (int a = 0; a < n; a++)
        for (int b = 0; b < a; b++)
            widest = fmax(widest, v3_norm(v3_cross(line[a].along, line[b].along)));
    if (widest < sin(M_PI / 180))
        return err_set(e, ERR_DATA,
                       "the lines to the light are parallel within %.2f deg: its distance cannot "
                       "be told; put the mirror in places farther apart",
                       asin(widest) * 180 / M_PI);
    struct light s = {.pictures = n};
    struct normal sums;
    double inverse[3], square = 0;
    normal_init(&sums, 3);
    for (int k = 0; k < n; k++)
        add_line(&sums, &line[k]);
    const bool ok = normal_solve(&sums, s.position_m, inverse, e);
    normal_finish(&sums);
    if (!ok)
        return false;
    const struct vec3 at = v3(s.position_m[0], s.position_m[1], s.position_m[2]);
    for (int k = 0; k < n; k++)
        square += distance(&line[k], at) * distance(&line[k], at);
    for (int k = 0; k < 3; k++)
        s.sigma_m[k] = sqrt(square / (2 * n - 3) * inverse[k]);
    record_init(&s.head, "light", "this light, camera and lens where they stand", sqrt(square / n),
                "rms distance of the lines from the light, m");
    *out = s;
    return true;
}

bool light_write(const struct light *s, const char *command, const char *path, struct err *e)
{
    struct record_file rf;
    record_begin(&rf, &s->head, command);
    fprintf(rf.f, "method: %s\npictures: %d\n", s->method, s->pictures);
    fprintf(rf.f, "# camera coordinates: x right, y down, z forward\n");
    record_list(rf.f, "position_m", s->position_m, 3);
    record_list(rf.f, "sigma_m", s->sigma_m, 3);
    return record_end(&rf, path, e);
}

bool light_read(struct light *out, const char *path, struct err *e)
{
    struct yaml *y;
    struct light s = {0};
    const char *method = "";
    if (!yaml_open(&y, path, e))
        return false;
    struct ynode *root = yaml_root(y);
    bool ok = record_read(&s.head, root, path, "light", e) &&
              ymap_text(root, "method", Y_OPTIONAL, &method, e) &&
              ymap_int(root, "pictures", Y_OPTIONAL, 0, 1000000, &s.pictures, e) &&
              record_read_list(root, "position_m", -1e4, 1e4, s.position_m, 3, e) &&
              record_read_list(root, "sigma_m", 0, 1e4, s.sigma_m, 3, e);
    if (ok)
        snprintf(s.method, sizeof s.method, "%s", method);
    ok = yaml_close(y, ok, e) && ok;
    if (ok)
        *out = s;
    return ok;
}

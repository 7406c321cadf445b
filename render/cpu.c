// cpu.c - rays, the nearest hit, and the reflectance under each light.
#define _GNU_SOURCE
#include "render/cpu.h"
#include "core/log.h"
#include "core/mem.h"
#include <stdlib.h>

enum {
    RAYS = 8,
    LIGHT_POINTS = 32,
    SLOPES = 32,
    FAR = 512,
    PARTS = 16 /* of a far light, a cell */
};

// What an object sees of the environment. In parts: of each light and cell a ray takes one.
struct view {
    const struct surround_light *far;
    const struct lobes *lobes; // NULL: none
    int n_far, parts;
    struct lobes own; // when integrating
};

struct tracing {
    const struct scene *scene;
    bool integrate;
    struct view *view;                  // [n_objects]
    struct surround_light *all, *spots; // when integrating, in parts
    int n_all, n_spots;
};

// The k-th of n points of a spiral that share the area of a disc of that radius.
static struct vec3 disc_point(double radius, int k, int n, double turn)
{
    const double r = radius * sqrt((k + .5) / n);
    const double angle = 2.399963229728653 * k + turn; // the golden angle
    return v3(r * cos(angle), r * sin(angle), 0);
}

// The k-th of LIGHT_POINTS points of a light's disc, which faces the sample's centre; `turn`
// rotates them from ray to ray.
static struct light light_point(const struct scene *s, const struct light *l, int k, double turn)
{
    struct light p = *l;
    struct frame f;
    const struct vec3 to = l->is_far ? l->at : v3_sub(l->at, s->object[0].shape.at_m);
    if (!frame_from(fabs(to.x) < fabs(to.y) ? v3(1, 0, 0) : v3(0, 1, 0), to, &f))
        return p;
    p.at = v3_add(l->at, frame_world(&f, disc_point(l->radius_m, k, LIGHT_POINTS, turn)));
    if (l->is_far)
        p.at = v3_unit(p.at);
    return p;
}

static void add_light(const struct scene *s, const struct material *m, const struct hit *hit,
                      struct vec3 wo, double diffracts, const struct light *l, double share,
                      double sum[3])
{
    struct vec3 wi;
    const double irradiance = share * light_at(l, hit->at_m, &wi);
    double out[3];
    material_eval(m, frame_local(&hit->frame, wi), wo, s->light_color, diffracts, out);
    for (int c = 0; c < 3; c++)
        sum[c] += irradiance * l->tint[c] * out[c];
}

// One light of the environment: what the object's map and the harmonics leave to it.
static void add_far(const struct object *o, const struct hit *hit, struct vec3 wo, double diffracts,
                    const struct surround_light *l, double sum[3])
{
    const struct material *m = &o->material;
    const struct vec3 wi = frame_local(&hit->frame, l->to);
    if (wi.z <= 0)
        return;
    double pattern[3] = {0}, specular[3] = {0};
    if (!object_shows_map(o) && diffracts > 0)
        material_diffraction(m, wi, wo, pattern);
    if (material_has_specular(m))
        material_specular(m, wi, wo, specular);
    const double through = coat_through(m->coat_ior, wi.z);
    for (int c = 0; c < 3; c++)
        sum[c] += through * l->irradiance[c] * (diffracts * pattern[c] + specular[c]);
}

static void cell_light(const struct material *m, const float *cell, double w, double out[3])
{
    const bool table = m->diffraction == DIFFRACTION_TABLE;
    const int n = table ? material_tables(m) : 1;
    const double scale = !table       ? 4 * M_PI * M_PI
                         : m->over_w2 ? m->table_scale / (w * w)
                                      : m->table_scale;
    out[0] = out[1] = out[2] = 0;
    for (int k = 0; k < n; k++)
        for (int c = 0; c < 3; c++)
            out[c] +=
                (table ? table_weight(&m->table, k, w) : 1) * scale * (double)cell[3 + 3 * k + c];
}

// The environment's rest, around where a cell of the pattern mirrors wo to. The cell's solid angle
// is its area over wi.z, at the horizon no more than the mean over the cell.
static void add_cell(const struct tracing *t, const struct object *o, const struct hit *hit,
                     struct vec3 wo, double diffracts, const float *cell, double sum[3])
{
    const struct material *m = &o->material;
    const double extent = (double)cell[2];
    struct vec3 wi = v3((double)cell[0] - wo.x, (double)cell[1] - wo.y, 0);
    const double square = 1 - wi.x * wi.x - wi.y * wi.y;
    if (square <= 0)
        return;
    wi.z = sqrt(square);
    const double x = 1 + v3_dot(wi, wo), steep = fmax(wi.z, sqrt(extent));
    const double weight = diffracts * m->gain * coat_through(m->coat_ior, wi.z) *
                          fresnel_schlick(m->r0, sqrt(x / 2)) * x * x / (wo.z * steep);
    double light[3], pattern[3];
    cell_light(m, cell, wi.z + wo.z, pattern);
    surround_rest(t->scene->surround, frame_world(&hit->frame, wi), extent / sqrt(steep), light);
    for (int c = 0; c < 3; c++)
        sum[c] += weight * pattern[c] * light[c];
}

// The environment's rest on the glossy layer, by slopes drawn as Beckmann's lobe has them: a share
// q of all is below roughness sqrt(-ln(1 - q)).
static void add_slopes(const struct tracing *t, const struct object *o, const struct hit *hit,
                       struct vec3 wo, int which, int parts, double sum[3])
{
    const struct material *m = &o->material;
    const int n = SLOPES * parts;
    for (int k = which; k < n; k += parts) {
        const double above = 1 - (k + .5) / n, angle = 2.3999632 * k;
        const double slope = m->roughness * sqrt(-log(above));
        const struct vec3 facet = v3_unit(v3(slope * cos(angle), slope * sin(angle), 1));
        const double cos_half = v3_dot(facet, wo);
        const struct vec3 wi = v3_sub(v3_scale(2 * cos_half, facet), wo);
        if (cos_half <= 0 || wi.z <= 0)
            continue;
        const double g = fmin(1, 2 * facet.z * fmin(wi.z, wo.z) / cos_half);
        const double weight =
            coat_through(m->coat_ior, wi.z) * g * cos_half / (facet.z * wo.z * SLOPES);
        double light[3];
        surround_rest(t->scene->surround, frame_world(&hit->frame, wi),
                      2 * m->roughness * sqrt(M_PI / (12 * n * above)), light);
        for (int c = 0; c < 3; c++)
            sum[c] += weight * fresnel_schlick(m->specular[c], cos_half) * light[c];
    }
}

// Which part of the k-th light or cell a ray takes.
static int part_of(const struct view *v, int k, int ray)
{
    return v->parts * k + (ray + 29 * k) % v->parts;
}

static void add_surround(const struct tracing *t, const struct object *o, const struct hit *hit,
                         struct vec3 wo, double diffracts, int ray, double out[3])
{
    const struct surround *s = t->scene->surround;
    const struct material *m = &o->material;
    const struct view *v = &t->view[o - t->scene->object];
    double sum[3] = {0}, diffuse[3], seen[3] = {0}, mirror[3];
    for (int k = 0; k < v->n_far / v->parts; k++)
        add_far(o, hit, wo, diffracts, &v->far[part_of(v, k, ray)], sum);
    for (int k = 0; v->lobes && diffracts > 0 && k < v->lobes->n / v->parts; k++)
        add_cell(t, o, hit, wo, diffracts, lobes_cell(v->lobes, part_of(v, k, ray)), sum);
    for (int c = 0; c < 3; c++)
        sum[c] *= v->parts;
    if (material_has_specular(m) && !object_by_lights_alone(o))
        add_slopes(t, o, hit, wo, t->integrate ? ray : t->scene->pass,
                   t->integrate           ? RAYS * RAYS
                   : t->scene->passes > 1 ? t->scene->passes
                                          : 1,
                   sum);
    surround_irradiance(s, hit->frame.n, diffuse);
    surround_radiance(s, frame_world(&hit->frame, v3(-wo.x, -wo.y, wo.z)), mirror);
    if (object_shows_map(o) && diffracts > 0)
        surround_map_at(&o->seen, wo, seen);
    const double through = coat_through(m->coat_ior, wo.z);
    for (int c = 0; c < 3; c++)
        out[c] +=
            through * (sum[c] + through * diffracts * seen[c] +
                       coat_through_diffuse(m->coat_ior) * m->diffuse[c] / M_PI * diffuse[c]) +
            (1 - through) * mirror[c];
}

static const struct object *nearest(const struct scene *s, struct vec3 eye, struct vec3 dir,
                                    struct hit *hit)
{
    const struct object *found = NULL;
    struct hit h;
    hit->distance = INFINITY;
    for (int k = 0; k < s->n_objects; k++)
        if (shape_hit(&s->object[k].shape, eye, dir, &h) && h.distance < hit->distance) {
            *hit = h;
            found = &s->object[k];
        }
    return found;
}

static void shade(const struct tracing *t, const struct object *o, const struct hit *hit,
                  struct vec3 wo, int ray, double out[3])
{
    const struct scene *s = t->scene;
    const double diffracts = mask_at(&o->material.mask, hit->s, hit->v);
    for (int k = 0; k < s->n_lights; k++) {
        const struct light *l = &s->light[k];
        const int points = t->integrate && l->radius_m > 0 ? LIGHT_POINTS : 1;
        for (int p = 0; p < points; p++) {
            const struct light point = points > 1 ? light_point(s, l, p, ray) : *l;
            add_light(s, &o->material, hit, wo, diffracts, &point, 1.0 / points, out);
        }
    }
    if (s->surround)
        add_surround(t, o, hit, wo, diffracts, ray, out);
}

static void trace(const struct tracing *t, struct vec3 eye, struct vec3 dir, int ray, double out[3])
{
    const struct scene *s = t->scene;
    struct hit hit = {0};
    const struct object *o = nearest(s, eye, dir, &hit);
    for (int c = 0; c < 3; c++)
        out[c] = o ? 0 : s->background[c];
    if (o) {
        const struct vec3 wo = frame_local(&hit.frame, v3_scale(-1, v3_unit(dir)));
        if (wo.z > 0)
            shade(t, o, &hit, wo, ray, out);
    } else if (s->surround && s->surround->shown) {
        surround_radiance(s->surround, v3_unit(dir), out);
    }
}

// The ray leaves the k-th of n points of the lens, for where the middle one meets the plane in
// focus; `dir` keeps its length along the view.
static void through_lens(const struct camera *c, int k, int n, struct vec3 *eye, struct vec3 *dir)
{
    const struct vec3 forward = v3_unit(v3_sub(c->target_m, c->eye_m));
    const struct vec3 right = v3_unit(v3_cross(forward, c->up)), up = v3_cross(right, forward);
    const struct vec3 at = disc_point(c->aperture_m / 2, (k * 29 + 7) % n, n, 0);
    const struct vec3 sharp = v3_add(c->eye_m, v3_scale(camera_focus(c), *dir));
    *eye = v3_add(c->eye_m, v3_add(v3_scale(at.x, right), v3_scale(at.y, up)));
    *dir = v3_scale(1 / camera_focus(c), v3_sub(sharp, *eye));
}

static void render_row(const struct tracing *t, int j, int rays, float *row)
{
    const struct scene *s = t->scene;
    for (int i = 0; i < s->w; i++) {
        double sum[3] = {0};
        for (int k = 0; k < rays * rays; k++) {
            const double x = i + (k % rays + .5) / rays - .5, y = j + (k / rays + .5) / rays - .5;
            struct vec3 eye = s->camera.eye_m, dir;
            double one[3];
            camera_ray(&s->camera, x, y, s->w, s->h, &dir);
            if (t->integrate && s->camera.aperture_m > 0)
                through_lens(&s->camera, k, rays * rays, &eye, &dir);
            trace(t, eye, dir, k, one);
            for (int c = 0; c < 3; c++)
                sum[c] += one[c];
        }
        for (int c = 0; c < 3; c++)
            row[3 * i + c] = (float)(sum[c] / (rays * rays));
    }
}

static bool view_init(const struct tracing *t, const struct object *o, struct view *v,
                      struct err *e)
{
    const struct material *m = &o->material;
    if (!t->scene->surround || !object_uses_far_lights(o))
        return true;
    v->parts = t->integrate ? PARTS : 1;
    v->far = scene_far_lights(t->scene, o, &v->n_far);
    v->lobes = object_has_lobes(o) ? &o->lobes[m->diffraction] : NULL;
    if (!t->integrate)
        return true;
    const bool alone = object_by_lights_alone(o);
    v->far = alone ? t->all : t->spots;
    v->n_far = alone ? t->n_all : t->n_spots;
    if (!v->lobes)
        return true;
    v->lobes = &v->own;
    return lobes_init(&v->own, m, m->diffraction, FAR, PARTS, e);
}

static bool tracing_init(struct tracing *t, const struct scene *s, bool integrate, struct err *e)
{
    *t = (struct tracing){.scene = s, .integrate = integrate};
    t->view = xcalloc((size_t)s->n_objects, sizeof *t->view);
    if (s->surround && integrate &&
        (!(t->all = surround_cut(&s->surround->env.map, FAR, PARTS, &t->n_all, e)) ||
         !(t->spots = surround_cut(&s->surround->spots, FAR, PARTS, &t->n_spots, e))))
        return false;
    for (int k = 0; k < s->n_objects; k++) {
        t->view[k].parts = 1;
        if (!view_init(t, &s->object[k], &t->view[k], e))
            return false;
    }
    return true;
}

static void tracing_finish(struct tracing *t)
{
    for (int k = 0; k < t->scene->n_objects; k++)
        lobes_finish(&t->view[k].own);
    free(t->view);
    free(t->all);
    free(t->spots);
}

bool cpu_render(const struct scene *s, bool integrate, struct image *out, struct err *e)
{
    struct tracing t;
    if (!tracing_init(&t, s, integrate, e) || !image_init(out, s->w, s->h, 3, e)) {
        tracing_finish(&t);
        return false;
    }
    const int rays = integrate ? RAYS : 1;
    struct progress bar;
    progress_start(&bar, "rendering", s->h);
#pragma omp parallel for schedule(dynamic, 4)
    for (int j = 0; j < s->h; j++) {
        render_row(&t, j, rays, out->px + (size_t)j * (size_t)s->w * 3);
        progress_step(&bar, 1);
    }
    progress_end(&bar);
    tracing_finish(&t);
    return true;
}

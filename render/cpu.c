// cpu.c - rays, the nearest hit, and the reflectance under each light.
#define _GNU_SOURCE
#include "render/cpu.h"
#include "core/log.h"
#include <stdlib.h>

enum { RAYS = 8, LIGHT_POINTS = 32, FAR_LIGHTS = 8192, THIN = 16 };

// What is traced, and how: the lights of the environment are few, or many.
struct tracing {
    const struct scene *scene;
    bool integrate;
    const struct surround_light *far;
    int n_far, thin; // of the lights a ray takes every thin-th, which stands for that many
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
    if (!o->seen.px && diffracts > 0)
        material_diffraction(m, wi, wo, pattern);
    if (material_has_specular(m))
        material_specular(m, wi, wo, specular);
    const double through = coat_through(m->coat_ior, wi.z);
    for (int c = 0; c < 3; c++)
        sum[c] += through * l->irradiance[c] * (diffracts * pattern[c] + specular[c]);
}

static void add_surround(const struct tracing *t, const struct object *o, const struct hit *hit,
                         struct vec3 wo, double diffracts, int ray, double out[3])
{
    const struct surround *s = t->scene->surround;
    const struct material *m = &o->material;
    double sum[3] = {0}, diffuse[3], seen[3] = {0}, mirror[3];
    if (object_uses_far_lights(o))
        for (int k = ray % t->thin; k < t->n_far; k += t->thin)
            add_far(o, hit, wo, diffracts, &t->far[k], sum);
    for (int c = 0; c < 3; c++)
        sum[c] *= t->thin;
    surround_irradiance(s, hit->frame.n, diffuse);
    surround_radiance(s, frame_world(&hit->frame, v3(-wo.x, -wo.y, wo.z)), mirror);
    if (o->seen.px && diffracts > 0)
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

bool cpu_render(const struct scene *s, bool integrate, struct image *out, struct err *e)
{
    struct tracing t = {.scene = s, .integrate = integrate};
    struct surround_light *all = NULL;
    if (s->surround) {
        t.far = s->surround->light;
        t.n_far = s->surround->n_lights;
    }
    if (s->surround && integrate)
        t.far = all = surround_cut(s->surround, FAR_LIGHTS, &t.n_far);
    t.thin = s->surround && integrate ? THIN : 1;
    if (!image_init(out, s->w, s->h, 3, e)) {
        free(all);
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
    free(all);
    return true;
}

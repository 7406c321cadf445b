// shapes.glsl - where a ray from `o` along `d` first enters a shape, in the shape's coordinates.
// SHAPE is 0 plane, 1 disc, 2 cylinder, 3 sphere, 4 mesh.
uniform vec2 half_size; // plane; cylinder: y
uniform float radius, inner, half_span;
uniform bool fixed_tangent;

struct Hit {
    float distance;
    vec3 at, t, n;
    vec2 st; // 0..1 across the shape
};

#if SHAPE < 2
bool shape_hit(vec3 o, vec3 d, out Hit hit)
{
    hit.distance = -o.z / d.z;
    hit.at = vec3(o.xy + hit.distance * d.xy, 0.0);
    hit.n = vec3(0.0, 0.0, 1.0);
    hit.t = vec3(1.0, 0.0, 0.0);
#if SHAPE == 0
    bool inside = all(lessThanEqual(abs(hit.at.xy), half_size));
    hit.st = 0.5 * hit.at.xy / half_size + 0.5;
#else
    float r = length(hit.at.xy);
    bool inside = r <= radius && r >= inner;
    if (!fixed_tangent && r > 0.0)
        hit.t = vec3(hit.at.xy / r, 0.0);
    hit.st = 0.5 * hit.at.xy / radius + 0.5;
#endif
    return inside && d.z < 0.0 && hit.distance > 0.0;
}
#elif SHAPE < 4
bool shape_hit(vec3 o, vec3 d, out Hit hit)
{
    float y = SHAPE == 3 ? 1.0 : 0.0;
    vec3 m = vec3(1.0, y, 1.0);
    // The foot of the perpendicular first: the plain quadratic loses its digits far from the shape.
    float a = dot(m * d, d);
    float middle = -dot(m * o, d) / a;
    vec3 foot = o + middle * d;
    float square = (radius * radius - dot(m * foot, foot)) / a;
    if (square <= 0.0)
        return false;
    hit.distance = middle - sqrt(square);
    hit.at = foot - sqrt(square) * d;
    hit.n = m * hit.at / radius;
    hit.t = normalize(vec3(hit.at.z, 0.0, -hit.at.x));
    float around = atan(hit.at.x, hit.at.z);
#if SHAPE == 3
    bool inside = true;
    hit.st = vec2(around / 6.28318530718, asin(clamp(hit.n.y, -1.0, 1.0)) / 3.14159265359) + 0.5;
#else
    bool inside = abs(hit.at.y) <= half_size.y && abs(around) <= half_span;
    hit.st = 0.5 * vec2(around / half_span, hit.at.y / half_size.y) + 0.5;
#endif
    return inside && hit.distance > 0.0;
}
#else
in vec3 mesh_at, mesh_n, mesh_t;
in vec2 mesh_st;
uniform vec3 forward;

bool shape_hit(vec3 o, vec3 d, out Hit hit)
{
    hit.at = mesh_at;
    hit.n = normalize(mesh_n);
    hit.t = normalize(mesh_t - dot(mesh_t, hit.n) * hit.n);
    hit.st = mesh_st;
    hit.distance = dot(mesh_at - o, forward);
    return true;
}
#endif

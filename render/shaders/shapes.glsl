// shapes.glsl - where a ray from `o` along `d` first enters a shape, in the shape's coordinates.
// SHAPE is defined as 0 plane, 1 disc, 2 cylinder, 3 sphere.
uniform vec2 half_size; // plane; cylinder: y
uniform float radius, inner, half_span;
uniform bool fixed_tangent;

struct Hit {
    float distance;
    vec3 at, t, n;
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
#else
    float r = length(hit.at.xy);
    bool inside = r <= radius && r >= inner;
    if (!fixed_tangent)
        hit.t = vec3(hit.at.xy / r, 0.0);
#endif
    return inside && d.z < 0.0 && hit.distance > 0.0;
}
#else
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
    bool inside = SHAPE == 3 || (abs(hit.at.y) <= half_size.y &&
                                 abs(atan(hit.at.x, hit.at.z)) <= half_span);
    return inside && hit.distance > 0.0;
}
#endif

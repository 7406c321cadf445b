// surround.glsl - the environment as a map.
uniform sampler2D surround;
const float TAU = 6.28318530718;

// docs/optics.md: row 0 is up, the centre looks down -z.
vec2 surround_place(vec3 dir)
{
    return vec2(atan(dir.x, -dir.z) / TAU + 0.5, atan(length(dir.xz), dir.y) / (0.5 * TAU));
}

vec3 surround_radiance(vec3 dir)
{
    return texture(surround, surround_place(dir)).rgb;
}

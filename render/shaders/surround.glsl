// surround.glsl - an environment's part of the light: a surface's, and the backdrop.
uniform sampler2D surround;
const float TAU = 6.28318530718;

// docs/optics.md: row 0 is up, the centre looks down -z.
vec3 surround_radiance(vec3 dir)
{
    vec2 at = vec2(atan(dir.x, -dir.z) / TAU + 0.5, atan(length(dir.xz), dir.y) / (0.5 * TAU));
    return texture(surround, at).rgb;
}

#ifdef SHAPE
uniform vec3 harmonic[9];       // irradiance per spherical harmonic of the normal
uniform mat3 world;             // from the shape's coordinates
uniform usamplerBuffer far_lights; // lists of the environment's lights
uniform sampler2D seen;         // o_n times the diffracted radiance over (o_t, o_b)
uniform float through_diffuse;

vec3 irradiance(vec3 d)
{
    vec3 sum = 0.282095 * harmonic[0] +
               0.488603 * (d.y * harmonic[1] + d.z * harmonic[2] + d.x * harmonic[3]) +
               1.092548 * (d.x * d.y * harmonic[4] + d.y * d.z * harmonic[5] +
                           d.x * d.z * harmonic[7]) +
               0.315392 * (3.0 * d.z * d.z - 1.0) * harmonic[6] +
               0.546274 * (d.x * d.x - d.y * d.y) * harmonic[8];
    return max(sum, vec3(0.0));
}

// `local` takes the shape's coordinates to the surface frame (t, b, n). FAR: the environment's lights
// matter, which ones says the tile.
vec3 surrounded(mat3 local, vec3 wo, float diffracts)
{
    if (wo.z <= 0.0)
        return vec3(0.0);
    vec3 sum = vec3(0.0);
#if FAR
    for (int k = far_list.x; k < far_list.x + far_list.y; k++) {
        int which = n_lights + int(texelFetch(far_lights, k).r);
        vec3 wi = local * light_at[which].xyz;
        vec3 one = glossy(wi, wo);
#if !SEEN && DIFFRACTION > 0
        one += diffracts * diffraction(wi, wo);
#endif
        if (wi.z > 0.0)
            sum += through(wi.z) * light_power[which].rgb * one;
    }
#endif
    mat3 out_of = world * transpose(local);
    sum += through_diffuse * diffuse / PI * irradiance(out_of[2]);
    float pass = through(wo.z);
#if SEEN
    vec2 n = vec2(textureSize(seen, 0));
    vec2 at = ((wo.xy * 0.5 + 0.5) * (n - 1.0) + 0.5) / n;
    sum += pass * diffracts * texture(seen, at).rgb / wo.z;
#endif
    sum *= pass;
#if COAT
    sum += (1.0 - pass) * surround_radiance(out_of * vec3(-wo.xy, wo.z));
#endif
    return sum;
}
#endif

// surrounded.glsl - an environment's light on a surface: diffuse, mirrored, diffracted.
uniform vec3 harmonic[9];       // irradiance per spherical harmonic of the normal
uniform mat3 world;             // from the shape's coordinates
uniform usamplerBuffer far_lights; // lists of the environment's lights
uniform sampler2D seen;         // o_n times the diffracted radiance over (o_t, o_b)
uniform float through_diffuse;
uniform bool by_lights_alone;   // the lights are all of the environment, not only its spots

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
    mat3 out_of = world * transpose(local);
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
#if LOBES && DIFFRACTION > 0
    sum += diffracts * from_cells(out_of, wo);
#endif
#if GLOSSY
    if (!by_lights_alone)
        sum += from_slopes(out_of, wo);
#endif
#endif
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

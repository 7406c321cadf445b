// surface.glsl - fragment shader: the ray of the pixel, its hit, the light it sends back.
uniform vec2 size;      // of the picture in pixels
uniform vec2 shift;     // of all rays, in halves of the picture
uniform vec3 right, up; // of the camera, in the shape's coordinates
#if SHAPE != 4
uniform vec3 forward;
#endif
uniform vec3 eye;       // likewise; lights are, too
out vec4 color;
#if MASKED
uniform int stripes;
uniform float duty;
uniform bool has_mask;
uniform sampler2D mask;

float mask_at(vec2 st)
{
    if (stripes > 0 && fract(st.x * float(stripes)) >= duty)
        return 0.0;
    if (!has_mask)
        return 1.0;
    ivec2 n = textureSize(mask, 0);
    return texelFetch(mask, clamp(ivec2(floor(vec2(st.x, 1.0 - st.y) * vec2(n))), ivec2(0), n - 1),
                      0).r;
}
#else
float mask_at(vec2 st)
{
    return 1.0;
}
#endif

void main()
{
    // Row 0 of the target is the top row of the picture.
    vec2 at = 2.0 * gl_FragCoord.xy / size - 1.0 + shift;
    vec3 dir = forward + at.x * right - at.y * up;
    Hit hit;
    if (!shape_hit(eye, dir, hit))
        discard;
    gl_FragDepth = 1.0 - 1.0 / (1.0 + hit.distance);

    mat3 local = transpose(mat3(hit.t, cross(hit.n, hit.t), hit.n));
    vec3 wo = local * normalize(-dir);
    float diffracts = mask_at(hit.st);
    vec3 sum = vec3(0.0);
    for (int k = 0; k < n_lights; k++) {
        vec3 way = light_at[k].xyz - light_at[k].w * hit.at;
        float fall = light_at[k].w == 0.0 ? 1.0 : 1.0 / dot(way, way);
        sum += fall * light_power[k].rgb * reflected(local * normalize(way), wo, diffracts);
    }
#if SURROUND
    sum += surrounded(local, wo, diffracts);
#endif
    color = vec4(sum, 1.0);
}

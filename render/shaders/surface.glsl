// surface.glsl - fragment shader: the ray of the pixel, its hit, the light it sends back.
layout(std140) uniform Lights {
    vec4 light[MAX_LIGHTS]; // xyz: position, or direction where w < 0; |w|: intensity or irradiance
};
uniform int n_lights;
uniform vec2 size;                // of the picture in pixels
uniform vec3 right, up, forward;  // of the camera, in the shape's coordinates
uniform vec3 eye;                 // likewise; lights are, too
out vec4 color;

void main()
{
    // Row 0 of the target is the top row of the picture.
    vec2 at = 2.0 * gl_FragCoord.xy / size - 1.0;
    vec3 dir = forward + at.x * right - at.y * up;
    Hit hit;
    if (!shape_hit(eye, dir, hit))
        discard;
    gl_FragDepth = 1.0 - 1.0 / (1.0 + hit.distance);

    vec3 b = cross(hit.n, hit.t);
    mat3 local = transpose(mat3(hit.t, b, hit.n));
    vec3 wo = local * normalize(-dir);
    vec3 sum = vec3(0.0);
    for (int k = 0; k < n_lights; k++) {
        vec3 way = light[k].xyz;
        float irradiance = -light[k].w;
        if (light[k].w >= 0.0) {
            way -= hit.at;
            irradiance = light[k].w / dot(way, way);
        }
        sum += irradiance * reflected(local * normalize(way), wo);
    }
    color = vec4(sum, 1.0);
}

// One pass of R17's algorithm 1: the filter along one axis, at every pixel of the map.
uniform sampler2D map;  // [h + 2][w]
uniform sampler2D taps; // [1][n] r, g, b: weight; a: half vector along the axis
uniform int n;
uniform vec2 axis; // in the plane of columns (right) and rows (down)
out vec4 color;

void main()
{
    vec3 r = pixel_direction();
    vec3 right = normalize(vec3(-r.z, 0.0, r.x)), down = cross(r, right);
    vec3 along = axis.x * right + axis.y * down, sum = vec3(0.0);
    for (int k = 0; k < n; k++) {
        vec4 tap = texelFetch(taps, ivec2(k, 0), 0);
        vec3 h = normalize(tap.a * along + (1.0 + sqrt(1.0 - tap.a * tap.a)) * r); // algorithm 2
        vec3 wi = 2.0 * dot(r, h) * h - r;
        vec2 at = pixel_of(wi) + vec2(0.5, 1.5); // the map's first row lies beyond the pole
        sum += tap.rgb * textureLod(map, at / (size + vec2(0.0, 2.0)), 0.0).rgb;
    }
    color = vec4(sum, 1.0);
}

// Another map in turned directions: Catmull-Rom cubic, never below zero (process/environment.h).
uniform sampler2D map;  // [rows][columns], no rows beyond the poles when rim is 0
uniform vec2 from_size; // its columns and rows, without those beyond the poles
uniform int rim;        // rows beyond each pole
uniform mat3 turn;      // direction in `map` of a direction here
uniform float scale;
out vec4 color;

vec4 weights(float x)
{
    return vec4(x * (-0.5 + x * (1.0 - 0.5 * x)), 1.0 + x * x * (-2.5 + 1.5 * x),
                x * (0.5 + x * (2.0 - 1.5 * x)), x * x * (-0.5 + 0.5 * x));
}

void main()
{
    vec3 d = turn * pixel_direction();
    vec2 at = pixel_of(d) / size * from_size + 0.5 * from_size / size - 0.5;
    ivec2 whole = ivec2(floor(at)), most = ivec2(from_size);
    vec4 wx = weights(at.x - float(whole.x)), wy = weights(at.y - float(whole.y));
    vec3 sum = vec3(0.0);
    for (int q = 0; q < 4; q++) {
        int y = whole.y + q - 1, shift = 0;
        if (y < 0 || y >= most.y) { // beyond a pole: the row before it, half a turn on
            y = y < 0 ? -1 - y : 2 * most.y - 1 - y;
            shift = most.x / 2;
        }
        for (int p = 0; p < 4; p++) {
            int x = (whole.x + p - 1 + shift + 2 * most.x) % most.x;
            sum += wx[p] * wy[q] * texelFetch(map, ivec2(x, y + rim), 0).rgb;
        }
    }
    color = vec4(scale * max(sum, 0.0), 1.0);
}

// lens.glsl - fragment shader: the blur of a thin lens, from a picture and its depth.
//
// Every pixel spreads evenly over its circle of confusion; gathered from `taps` places around. What
// lies behind a sharper pixel does not spread over it.
uniform sampler2D picture, depth; // depth: 1 - 1 / (1 + distance along the view)
uniform float spread;             // radius in px is spread |1 / focus - 1 / distance|
uniform float focus, reach;       // m; px, no circle is larger
uniform int taps;
out vec4 color;

const float PI = 3.14159265358979;

// x: radius of the circle of confusion, px; y: 1 / distance
vec2 circle(ivec2 at)
{
    float d = texelFetch(depth, at, 0).r;
    float near = (1.0 - d) / max(d, 1e-7);
    return vec2(min(reach, spread * abs(1.0 / focus - near)), near);
}

void main()
{
    ivec2 here = ivec2(gl_FragCoord.xy), size = textureSize(picture, 0);
    vec2 own = circle(here);
    float weight = 1.0 / max(1.0, PI * own.x * own.x);
    vec3 sum = weight * texelFetch(picture, here, 0).rgb;
    float share = max(1.0, PI * reach * reach / float(taps)); // pixels that a tap stands for
    for (int k = 0; k < taps; k++) {
        float r = reach * sqrt((float(k) + 0.5) / float(taps)), angle = 2.3999632 * float(k);
        ivec2 way = ivec2(round(r * vec2(cos(angle), sin(angle)))), at = here + way;
        if (way == ivec2(0) || any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size)))
            continue;
        vec2 other = circle(at);
        float radius = other.y < own.y ? min(other.x, own.x) : other.x;
        float cover = clamp(radius - length(vec2(way)) + 0.5, 0.0, 1.0);
        float w = share * cover / max(1.0, PI * radius * radius);
        sum += w * texelFetch(picture, at, 0).rgb;
        weight += w;
    }
    color = vec4(sum / weight, 1.0);
}

// layers.glsl - what a surface does with light, per unit irradiance: f cos_i (docs/render.md).
// Directions are in the surface frame. DIFFRACTION is 0 none, 1 table, 2 slits, 3 Stam's; GLOSSY,
// COAT and LINEAR (nodes) leave out what a material does not have: on a CPU branches cost both sides.
uniform vec3 diffuse, specular, light_color;
uniform float roughness, coat_ior;
uniform float r0, gain;

const float PI = 3.14159265358979;

float schlick(float at_normal, float cos_half)
{
    float x = max(0.0, 1.0 - cos_half), x2 = x * x;
    return at_normal + (1.0 - at_normal) * x2 * x2 * x;
}

float dielectric(float ior, float cos_i)
{
    float cos_t = sqrt((ior - 1.0) * (ior + 1.0) + cos_i * cos_i) / ior; // as in material.c
    float s = (cos_i - ior * cos_t) / (cos_i + ior * cos_t);
    float p = (ior * cos_i - cos_t) / (ior * cos_i + cos_t);
    return 0.5 * (s * s + p * p);
}

#if DIFFRACTION == 1
uniform sampler2DArray table;
uniform float range, power, nodes, table_scale;
uniform int tables; // how many of the array are added
uniform bool over_w2;
#if CURVES
uniform sampler2D curves; // row m: the weight of table m at equal steps over w_range
uniform vec2 w_range;

float curve(int m, float w)
{
    vec2 n = vec2(textureSize(curves, 0));
    float at = clamp((w - w_range.x) / (w_range.y - w_range.x), 0.0, 1.0) * (n.x - 1.0);
    return texture(curves, (vec2(at, float(m)) + 0.5) / n).r;
}
#endif

// Linear between nodes, in the nodes' own coordinate: u = R sgn(s) |s|^p.
vec3 pattern(vec3 h)
{
    vec2 s = abs(h.xy) / range;
    if (max(s.x, s.y) > 1.0)
        return vec3(0.0);
#if !LINEAR
    s = pow(s, vec2(1.0 / power));
#endif
    vec2 at = ((sign(h.xy) * s * 0.5 + 0.5) * (nodes - 1.0) + 0.5) / nodes;
#if CURVES
    vec3 sum = vec3(0.0);
    for (int m = 0; m < tables; m++)
        sum += curve(m, h.z) * texture(table, vec3(at, float(m))).rgb;
#else
    vec3 sum = texture(table, vec3(at, 0.0)).rgb;
#endif
    return sum * (over_w2 ? table_scale / (h.z * h.z) : table_scale);
}
#elif DIFFRACTION == 2
uniform float slit_across;
uniform bool slit_radial;
uniform sampler2D slit_light; // crossed: the light's colour per wavelength; else the row over u
#if CROSSED
uniform vec2 slit_pitch, slit_width, slit_count; // metres
uniform vec2 slit_band;                          // first and last wavelength, metres

float sinc2(float x)
{
    float y = PI * x;
    return abs(y) < 0.01 ? 1.0 - y * y / 3.0 : sin(y) * sin(y) / (y * y);
}

// T17 eq. 16, second factor; at the zeros of its denominator the limit.
float comb(float n, float x)
{
    float rest = PI * (x - round(x));
    if (abs(rest) * n < 0.01)
        return 1.0 - (n * n - 1.0) * rest * rest / 3.0;
    float ratio = sin(n * rest) / (n * sin(rest));
    return ratio * ratio;
}

float row(float u, float pitch, float width, float count, float lambda)
{
    return count * width * width / (pitch * lambda) * sinc2(width * u / lambda) *
           comb(count, pitch * u / lambda);
}

vec3 pattern(vec3 h)
{
    int n = textureSize(slit_light, 0).x;
    vec3 sum = vec3(0.0);
    for (int k = 0; k < n; k++) {
        float lambda = mix(slit_band.x, slit_band.y, float(k) / float(n - 1));
        sum += row(h.x, slit_pitch.x, slit_width.x, slit_count.x, lambda) *
               row(h.y, slit_pitch.y, slit_width.y, slit_count.y, lambda) *
               texelFetch(slit_light, ivec2(k, 0), 0).rgb;
    }
    return sum / 4.0; // 4 pi^2 S_d
}
#else
vec3 pattern(vec3 h)
{
    vec2 uv = slit_radial ? vec2(length(h.xy), 0.0) : vec2(abs(h.x), h.y / slit_across);
    if (abs(uv.y) > 6.0)
        return vec3(0.0);
    float n = float(textureSize(slit_light, 0).x);
    vec2 at = vec2((0.5 * uv.x * (n - 1.0) + 0.5) / n, 0.5);
    float across = exp(-0.5 * uv.y * uv.y) / (sqrt(2.0 * PI) * slit_across);
    return 4.0 * PI * PI * across * texture(slit_light, at).rgb;
}
#endif
#elif DIFFRACTION == 3
uniform float stam_spacing, stam_roughness; // um
uniform vec3 stam_highlight;

vec3 pattern(vec3 h)
{
    float u = h.x * stam_spacing, e = stam_roughness * u / h.z;
    vec3 sum = stam_roughness > 0.0 ? stam_highlight * exp(-e * e) : vec3(0.0);
    for (int n = 1; n < 8; n++) {
        vec3 x = 4.0 * (2.0 * abs(u) / float(n) - 1.0 - vec3(0.75, 0.5, 0.25));
        sum += max(vec3(0.0), 1.0 - x * x);
    }
    return sum;
}
#endif

vec3 diffraction(vec3 wi, vec3 wo)
{
    vec3 h = wi + wo;
#if DIFFRACTION == 3
    return gain * pattern(h);
#elif DIFFRACTION > 0
    float x = 0.5 * dot(h, h); // 1 + wi.wo
    return gain * schlick(r0, sqrt(0.5 * x)) * x * x / wo.z * pattern(h);
#else
    return vec3(0.0);
#endif
}

vec3 glossy(vec3 wi, vec3 wo)
{
#if GLOSSY
    vec3 m = normalize(wi + wo);
    float cos_half = dot(m, wo);
    float m2 = roughness * roughness, c2 = m.z * m.z;
    float d = exp((c2 - 1.0) / (c2 * m2)) / (PI * m2 * c2 * c2);
    float g = min(1.0, 2.0 * m.z * min(wi.z, wo.z) / cos_half);
    vec3 f = vec3(schlick(specular.r, cos_half), schlick(specular.g, cos_half),
                  schlick(specular.b, cos_half));
    return f * (d * g / (4.0 * wo.z));
#else
    return vec3(0.0);
#endif
}

float through(float cos_i)
{
#if COAT
    return 1.0 - dielectric(coat_ior, cos_i);
#else
    return 1.0;
#endif
}

vec3 reflected(vec3 wi, vec3 wo, float diffracts)
{
    if (wi.z <= 0.0 || wo.z <= 0.0)
        return vec3(0.0);
    vec3 sum = (diffuse / PI * wi.z + glossy(wi, wo)) * light_color;
#if DIFFRACTION > 0
    sum += diffracts * diffraction(wi, wo);
#endif
    return sum * through(wi.z) * through(wo.z);
}

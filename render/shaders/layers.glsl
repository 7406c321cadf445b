// layers.glsl - what a surface does with light, per unit irradiance: f cos_i (docs/render.md).
// Directions are in the surface frame. TABLES is the number of tables in use, 0 for none.
uniform vec3 diffuse, specular, light_color;
uniform float roughness, coat_ior;
uniform float r0, gain;
uniform float range, power, nodes;
uniform bool over_w2;
uniform vec2 w_range; // where the curves over w hold
#if TABLES > 0
uniform sampler2DArray table;
uniform sampler2D curves; // row m: the weight of table m at equal steps over w_range
#endif

const float PI = 3.14159265358979;

float schlick(float at_normal, float cos_half)
{
    float x = max(0.0, 1.0 - cos_half), x2 = x * x;
    return at_normal + (1.0 - at_normal) * x2 * x2 * x;
}

float dielectric(float ior, float cos_i)
{
    float cos_t = sqrt(max(0.0, 1.0 - (1.0 - cos_i * cos_i) / (ior * ior)));
    float s = (cos_i - ior * cos_t) / (cos_i + ior * cos_t);
    float p = (ior * cos_i - cos_t) / (ior * cos_i + cos_t);
    return 0.5 * (s * s + p * p);
}

#if TABLES > 0
// Linear between nodes, in the nodes' own coordinate: u = R sgn(s) |s|^p.
vec3 table_value(vec3 h)
{
    vec2 s = abs(h.xy) / range;
    if (max(s.x, s.y) > 1.0)
        return vec3(0.0);
    if (power != 1.0)
        s = pow(s, vec2(1.0 / power));
    vec2 at = ((sign(h.xy) * s * 0.5 + 0.5) * (nodes - 1.0) + 0.5) / nodes;
#if TABLES == 1 && !CURVES
    return texture(table, vec3(at, 0.0)).rgb;
#else
    float n = float(textureSize(curves, 0).x);
    float w = clamp((h.z - w_range.x) / (w_range.y - w_range.x), 0.0, 1.0);
    float column = (w * (n - 1.0) + 0.5) / n;
    vec3 sum = vec3(0.0);
    for (int m = 0; m < TABLES; m++)
        sum += texture(curves, vec2(column, (float(m) + 0.5) / float(textureSize(curves, 0).y))).r *
               texture(table, vec3(at, float(m))).rgb;
    return sum;
#endif
}
#endif

vec3 reflected(vec3 wi, vec3 wo)
{
    if (wi.z <= 0.0 || wo.z <= 0.0)
        return vec3(0.0);
    vec3 h = wi + wo;
    vec3 sum = diffuse / PI * wi.z * light_color;
    float cos_half = 0.5 * length(h);
    if (specular != vec3(0.0)) {
        vec3 m = normalize(h);
        float m2 = roughness * roughness, c2 = m.z * m.z;
        float d = exp((c2 - 1.0) / (c2 * m2)) / (PI * m2 * c2 * c2);
        float g = min(1.0, 2.0 * m.z * min(wi.z, wo.z) / cos_half);
        vec3 f = vec3(schlick(specular.r, cos_half), schlick(specular.g, cos_half),
                      schlick(specular.b, cos_half));
        sum += f * (d * g / (4.0 * wo.z)) * light_color;
    }
#if TABLES > 0
    float x = 2.0 * cos_half * cos_half; // 1 + wi.wo
    float weight = gain * schlick(r0, cos_half) * x * x / wo.z;
    if (over_w2)
        weight /= h.z * h.z;
    sum += weight * table_value(h);
#endif
    if (coat_ior != 1.0)
        sum *= (1.0 - dielectric(coat_ior, wi.z)) * (1.0 - dielectric(coat_ior, wo.z));
    return sum;
}

// lobes.glsl - light from all around on lobes: the environment without its spots, looked up around
// the directions that the cells of a pattern (lobes.h) and the points of a glossy lobe mirror.
#if FAR
uniform sampler2D rest;   // the environment without spots, in levels
uniform float rest_height; // rows of the first
uniform int n_levels;
uniform int which_pass, passes; // of the pictures whose mean is meant, this one

// The nearest level: reading between two costs twice and shows no less.
vec3 rest_radiance(vec3 dir, float extent)
{
    float level = log2(max(1e-9, 2.0 * extent * rest_height / PI));
    return textureLod(rest, surround_place(dir), clamp(ceil(level - 0.5), 0.0, float(n_levels - 1))).rgb;
}

#if LOBES && DIFFRACTION > 0
uniform sampler2D cells; // row k: u, v, rms extent; then the integral of each table over the cell

vec3 cell_light(int k, float w)
{
#if DIFFRACTION == 1 && CURVES
    vec3 sum = vec3(0.0);
    for (int m = 0; m < tables; m++)
        sum += curve(m, w) * texelFetch(cells, ivec2(1 + m, k), 0).rgb;
#else
    vec3 sum = texelFetch(cells, ivec2(1, k), 0).rgb;
#endif
#if DIFFRACTION == 1
    return sum * (over_w2 ? table_scale / (w * w) : table_scale);
#else
    return 4.0 * PI * PI * sum;
#endif
}

// The solid angle of a cell is its area over wi.z, at the horizon no more than the mean over it.
vec3 from_cells(mat3 out_of, vec3 wo)
{
    vec3 sum = vec3(0.0);
    int n = textureSize(cells, 0).y;
    for (int k = 0; k < n; k++) {
        vec3 cell = texelFetch(cells, ivec2(0, k), 0).xyz;
        vec2 t = cell.xy - wo.xy;
        float square = 1.0 - dot(t, t);
        if (square <= 0.0)
            continue;
        vec3 wi = vec3(t, sqrt(square)), h = wi + wo;
        float x = 0.5 * dot(h, h), steep = max(wi.z, sqrt(cell.z));
        float weight = through(wi.z) * schlick(r0, sqrt(0.5 * x)) * x * x / steep;
        sum += weight * cell_light(k, h.z) * rest_radiance(out_of * wi, cell.z / sqrt(steep));
    }
    return gain / wo.z * sum;
}
#endif

#if GLOSSY
// Slopes as Beckmann's lobe has them: of all of them a share q is below roughness sqrt(-ln(1 - q)).
vec3 from_slopes(mat3 out_of, vec3 wo)
{
    const int points = 32;
    int n = points * passes;
    vec3 sum = vec3(0.0);
    for (int k = which_pass; k < n; k += passes) {
        float above = 1.0 - (float(k) + 0.5) / float(n), angle = 2.3999632 * float(k);
        float slope = roughness * sqrt(-log(above));
        vec3 m = normalize(vec3(slope * cos(angle), slope * sin(angle), 1.0));
        float cos_half = dot(m, wo);
        vec3 wi = 2.0 * cos_half * m - wo;
        if (cos_half <= 0.0 || wi.z <= 0.0)
            continue;
        float g = min(1.0, 2.0 * m.z * min(wi.z, wo.z) / cos_half);
        vec3 f = vec3(schlick(specular.r, cos_half), schlick(specular.g, cos_half),
                      schlick(specular.b, cos_half));
        float extent = 2.0 * roughness * sqrt(PI / (12.0 * float(n) * above));
        sum += through(wi.z) * g * cos_half / m.z * f * rest_radiance(out_of * wi, extent);
    }
    return sum / (float(points) * wo.z);
}
#endif
#endif

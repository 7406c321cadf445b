// spectrum.c - piecewise-linear spectra, illuminants, the observer, sRGB.
#define _GNU_SOURCE
#include "core/spectrum.h"
#include "core/cie_data.h"
#include "core/mem.h"
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char illuminant_names[] = "E A D50 D65 F1 F2 F11 inverse-A";

void spectrum_finish(struct spectrum *s)
{
    if (!s)
        return;
    free(s->lambda_m);
    free(s->value);
    *s = (struct spectrum){0};
}

static void append(struct spectrum *s, double lambda_m, double value)
{
    s->lambda_m = xrealloc(s->lambda_m, (size_t)s->n + 1, sizeof *s->lambda_m);
    s->value = xrealloc(s->value, (size_t)s->n + 1, sizeof *s->value);
    s->lambda_m[s->n] = lambda_m;
    s->value[s->n++] = value;
}

double spectrum_at(const struct spectrum *s, double lambda_m)
{
    const double slack = 1e-15; // wavelengths come from sums of steps
    if (s->n < 2 || lambda_m < s->lambda_m[0] - slack || lambda_m > s->lambda_m[s->n - 1] + slack)
        return 0;
    int lo = 0, hi = s->n - 1;
    while (hi - lo > 1) {
        const int mid = (lo + hi) / 2;
        *(s->lambda_m[mid] <= lambda_m ? &lo : &hi) = mid;
    }
    const double f = (lambda_m - s->lambda_m[lo]) / (s->lambda_m[hi] - s->lambda_m[lo]);
    return s->value[lo] + fmax(0, fmin(1, f)) * (s->value[hi] - s->value[lo]);
}

static bool parse_row(struct spectrum *s, const char *path, int line, const char *row,
                      struct err *e)
{
    char *end;
    const double nm = strtod(row, &end);
    const bool has_comma = end != row && *(end += strspn(end, " \t")) == ',';
    const char *second = end + 1;
    const double value = has_comma ? strtod(second, &end) : NAN;
    const bool rest = has_comma && end != second && !end[strspn(end, " \t\r\n")];
    if (!rest || !isfinite(nm) || !isfinite(value))
        return err_set(e, ERR_DATA, "%s:%d: expected two finite numbers 'nm,power'", path, line);
    if (nm < 1 || nm > 1e5)
        return err_set(e, ERR_DATA, "%s:%d: wavelength %g is not in nanometres (1 to 1e5)", path,
                       line, nm);
    if (value < 0)
        return err_set(e, ERR_DATA, "%s:%d: negative power %g", path, line, value);
    if (s->n && nm * 1e-9 <= s->lambda_m[s->n - 1])
        return err_set(e, ERR_DATA, "%s:%d: wavelengths must rise, %g nm follows %g nm", path, line,
                       nm, s->lambda_m[s->n - 1] * 1e9);
    append(s, nm * 1e-9, value);
    return true;
}

// A step more than 2.5 times the median step is a missing row, not a coarse table.
static bool check_gaps(const struct spectrum *s, const char *path, struct err *e)
{
    double least = INFINITY;
    for (int k = 1; k < s->n; k++)
        least = fmin(least, s->lambda_m[k] - s->lambda_m[k - 1]);
    for (int k = 1; k < s->n; k++)
        if (s->n > 4 && s->lambda_m[k] - s->lambda_m[k - 1] > 1.5 * least &&
            fabs(fmod((s->lambda_m[k] - s->lambda_m[k - 1]) / least + 0.5, 1) - 0.5) < 1e-3)
            return err_set(e, ERR_DATA, "%s: rows missing between %g and %g nm (steps are %g nm)",
                           path, s->lambda_m[k - 1] * 1e9, s->lambda_m[k] * 1e9, least * 1e9);
    return true;
}

bool spectrum_read_csv(struct spectrum *s, const char *path, struct err *e)
{
    FILE *f = fopen(path, "r");
    if (!f)
        return err_errno(e, "%s", path);
    struct spectrum got = {0};
    char *row = NULL;
    size_t size = 0;
    bool ok = true, header = false;
    for (int line = 1; ok && getline(&row, &size, f) > 0; line++) {
        const char *text = row + strspn(row, " \t\r\n");
        if (!*text || *text == '#')
            continue;
        if (!got.n && !header && isalpha((unsigned char)*text)) {
            header = true;
            continue;
        }
        ok = parse_row(&got, path, line, text, e);
    }
    free(row);
    fclose(f);
    if (ok && got.n < 2)
        ok =
            err_set(e, ERR_DATA, "%s: a spectrum needs two rows 'nm,power', found %d", path, got.n);
    if (ok && check_gaps(&got, path, e))
        *s = got;
    else
        spectrum_finish(&got), ok = false;
    return ok;
}

static double nm_of(int row)
{
    return CIE_FIRST_NM + row * CIE_STEP_NM;
}

bool illuminant_get(struct spectrum *s, const char *name, struct err *e)
{
    struct spectrum got = {0};
    const bool inverse = !strcasecmp(name, "inverse-A");
    if (!strcasecmp(name, "E"))
        for (int k = 0; k < CIE_ROWS; k++)
            append(&got, nm_of(k) * 1e-9, 1);
    for (const struct cie_illuminant *i = cie_illuminants; i->name; i++)
        if (!strcasecmp(name, i->name) || (inverse && !strcmp(i->name, "A")))
            for (int k = 0; k < CIE_ROWS; k++) // inverse: blue and red change places
                append(&got, nm_of(k) * 1e-9, i->power[inverse ? CIE_ROWS - 1 - k : k]);
    if (got.n) {
        *s = got;
        return true;
    }
    if (!strchr(name, '.') && !strchr(name, '/'))
        return err_set(e, ERR_DATA, "unknown illuminant '%s': use one of %s, or a CSV file", name,
                       illuminant_names);
    return spectrum_read_csv(s, name, e);
}

void cie_xyz(double lambda_m, double xyz[3])
{
    const double at = (lambda_m * 1e9 - CIE_FIRST_NM) / CIE_STEP_NM;
    const bool inside = at > -1e-6 && at < CIE_ROWS - 1 + 1e-6;
    const double x = fmax(0, fmin(CIE_ROWS - 1, at));
    const int k = x < CIE_ROWS - 2 ? (int)x : CIE_ROWS - 2;
    for (int c = 0; c < 3; c++)
        xyz[c] = inside
                     ? cie_observer[k][c] + (x - k) * (cie_observer[k + 1][c] - cie_observer[k][c])
                     : 0;
}

double illuminant_scale(const struct spectrum *s)
{
    // Both factors are linear between the union of their knots, so Simpson's rule is exact there.
    double sum = 0;
    int k = 0;
    double a = CIE_FIRST_NM * 1e-9;
    const double last = CIE_LAST_NM * 1e-9;
    for (int row = 1; a < last;) {
        while (k < s->n && s->lambda_m[k] <= a + 1e-15)
            k++;
        double b = nm_of(row) * 1e-9;
        if (b <= a + 1e-15) {
            row++;
            continue;
        }
        if (k < s->n && s->lambda_m[k] < b)
            b = s->lambda_m[k];
        const double at[3] = {a, 0.5 * (a + b), b};
        double f[3];
        for (int q = 0; q < 3; q++) {
            double xyz[3];
            cie_xyz(at[q], xyz);
            f[q] = xyz[1] * spectrum_at(s, at[q]);
        }
        sum += (b - a) / 6 * (f[0] + 4 * f[1] + f[2]);
        a = b;
    }
    return sum > 0 ? 1 / sum : 0;
}

// IEC 61966-2-1, D65, and its inverse computed from it to double precision.
static const double rgb_from_xyz[3][3] = {
    {3.2406, -1.5372, -0.4986}, {-0.9689, 1.8758, 0.0415}, {0.0557, -0.2040, 1.0570}};

void xyz_to_rgb(const double xyz[3], double rgb[3])
{
    const double x = xyz[0], y = xyz[1], z = xyz[2];
    for (int c = 0; c < 3; c++)
        rgb[c] = rgb_from_xyz[c][0] * x + rgb_from_xyz[c][1] * y + rgb_from_xyz[c][2] * z;
}

void rgb_to_xyz(const double rgb[3], double xyz[3])
{
    const double(*m)[3] = rgb_from_xyz;
    double adj[3][3], det = 0;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            const int r1 = (c + 1) % 3, r2 = (c + 2) % 3, c1 = (r + 1) % 3, c2 = (r + 2) % 3;
            adj[r][c] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
        }
    for (int c = 0; c < 3; c++)
        det += m[0][c] * adj[c][0];
    const double in[3] = {rgb[0], rgb[1], rgb[2]};
    for (int r = 0; r < 3; r++)
        xyz[r] = (adj[r][0] * in[0] + adj[r][1] * in[1] + adj[r][2] * in[2]) / det;
}

double srgb_encode(double linear)
{
    const double x = fmax(0, fmin(1, linear));
    return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
}

double srgb_decode(double encoded)
{
    return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4);
}

// cmd_calib.c - nacre calib: what this rig really is, as dated records.
#define _GNU_SOURCE
#include "ui/calib.h"
#include "ui/commands.h"
#include <string.h>

#define AT(field) offsetof(struct calib_args, field)
static const struct opt opts[] = {
    {"times", OPT_LIST, AT(times), "exif|T,..", "exif",
     "exposure times, from the files or given in their order", .verbs = "dark noise response"},
    {"method", OPT_CHOICE, AT(method), "debevec|robertson", "debevec",
     "least squares, or alternating estimates", .verbs = "response"},
    {"dark", OPT_FILE, AT(dark), "FILE", NULL, "a dark record", .verbs = "noise response"},
    {"black", OPT_NUM, AT(black), "COUNTS", NULL, "the black level (default: the files')",
     .verbs = "noise"},
    {"white", OPT_NUM, AT(white), "COUNTS", NULL, "where pixels saturate (default: the files')",
     .verbs = "noise response"},
    {"light", OPT_TEXT, AT(light), "NAME|FILE|X,Y,Z", NULL,
     "of a session or rig: this light; for geometry a light record, or X,Y,Z from the board's "
     "middle "
     "along t (right), b (up), n (to the camera)",
     .verbs = "dark noise response spectral geometry"},
    {"filter", OPT_TEXT, AT(filter), "NAME", NULL, "of a session or rig: this filter",
     .verbs = "dark noise response spectral"},
    {"lines", OPT_NUM, AT(lines_per_m), "N", NULL, "lines of the known grating, e.g. 600/mm",
     UNIT_PER_M, .verbs = "bokeh spectral"},
    {"blaze", OPT_NUM, AT(blaze_rad), "ANGLE", NULL, "its blaze angle, e.g. 13deg", UNIT_RAD,
     .verbs = "bokeh"},
    {"turn", OPT_TEXT, AT(turn), "auto|DEG", "auto",
     "geometry: of the sample on the board, from t towards b (auto: 0); bokeh: how far the sensor "
     "shows the sample turned counter-clockwise (auto: by the lines, which stand upright on it)",
     .verbs = "geometry bokeh"},
    {"channel", OPT_CHOICE, AT(channel), "r|g|b", NULL,
     "the channel to use (default b; by the wavelength)", .verbs = "bokeh spectral"},
    {"response", OPT_FILE, AT(response), "auto|srgb|linear|FILE", "auto",
     "what 8-bit samples mean: sRGB (auto, with a note), light itself, or by a response record",
     .verbs = "bokeh"},
    {"board", OPT_TEXT, AT(board), "COLSxROWS", NULL,
     "inner corners of a chessboard; with --marker squares of a ChArUco board",
     .verbs = "lens board"},
    {"square", OPT_NUM, AT(square_m), "D", NULL, "side of a square", UNIT_M, .verbs = "lens board"},
    {"marker", OPT_NUM, AT(marker_m), "D", NULL, "side of a ChArUco board's markers", UNIT_M,
     .verbs = "lens board"},
    {"dictionary", OPT_TEXT, AT(dictionary), "NAME", "4x4_50",
     "of the markers: 4x4_50, 5x5_100, 6x6_250, original, 36h11 ...", .verbs = "lens board"},
    {"plane", OPT_FILE, AT(plane), "IMAGE", NULL,
     "the picture whose board lay where the sample lies (default: the first)",
     .verbs = "lens geometry"},
    {"size", OPT_LIST, AT(size), "W,H", NULL, "the sample's extent about the board's middle",
     .verbs = "geometry"},
    {"tangents", OPT_CHOICE, AT(tangents), "fixed|radial", "fixed",
     "radial: the sample is a disc, its tangent runs outwards and W of --size is its diameter",
     .verbs = "geometry"},
    {"hub", OPT_NUM, AT(hub_m), "R", "0", "... and inside this radius there is no sample", UNIT_M,
     .verbs = "geometry"},
    {"beam", OPT_NUM, AT(beam), "N", "0",
     "the light's intensity falls as cos^N about its axis to the sample", .verbs = "geometry"},
    {"fresnel", OPT_CHOICE, AT(fresnel), "constant|schlick", "constant",
     "F over the angle, for the weights", .verbs = "geometry"},
    {"r0", OPT_NUM, AT(r0), "R0", "0.04", "reflectance at normal incidence, for schlick",
     .verbs = "geometry"},
    {"lens", OPT_FILE, AT(lens), "FILE", NULL, "the camera, a lens record", .verbs = "light"},
    {"radius", OPT_NUM, AT(radius_m), "R", NULL,
     "of the mirror ball in the pictures; without it they show specular lobes", UNIT_M,
     .verbs = "light"},
    {"ball", OPT_LIST, AT(ball), "X,Y,R,..", NULL,
     "where the ball is in each picture, px (default: the largest thing)", .verbs = "light"},
    {"poses", OPT_LIST, AT(poses), "IMAGE,..", NULL,
     "for each lobe the picture whose board lay where the sample lay (default: all views of "
     "the lens record, in order)",
     .verbs = "light"},
    {"lambda", OPT_NUM, AT(lambda_m), "L", NULL, "in place of curves, a nominal band", UNIT_M,
     .verbs = "spectral"},
    {"width", OPT_NUM, AT(width_m), "W", "10nm", "its full width at half maximum", UNIT_M,
     .verbs = "spectral"},
    {"accuracy", OPT_NUM, AT(accuracy_m), "D", "1nm",
     "standard uncertainty of the curves' wavelengths", UNIT_M, .verbs = "spectral"},
    {"grating", OPT_FILE, AT(grating), "PATTERN", NULL,
     "the pattern of a grating of known --lines, to check the wavelength by", .verbs = "spectral"},
    {"geometry", OPT_FILE, AT(geometry), "FILE", NULL, "half vectors of that pattern",
     .verbs = "spectral"},
    {"h-per-pixel", OPT_NUM, AT(h_per_px), "X", NULL, "or their step, and ...",
     .verbs = "spectral"},
    {"center", OPT_TEXT, AT(center), "X,Y", "auto", "... the pixel where h = 0",
     .verbs = "spectral"},
    {"o", OPT_FILE, AT(out), "FILE", NULL, "the record", .needed = true},
    {0},
};

static const struct verb verbs[] = {
    {"dark", "FRAME...|SESSION", "black level, read noise, dark current, hot pixels"},
    {"noise", "FRAME...|SESSION", "gain, read noise and PRNU from pairs of equal exposures"},
    {"response", "IMAGE...|SESSION", "the curve of 8-bit pictures; of counts a linearity check"},
    {"flat", "PICTURE", "vignetting and fall-off, from an even target"},
    {"lens", "IMAGE...", "focal length, distortion, poses, from a printed board"},
    {"board", "", "such a board, to print"},
    {"light", "PICTURE...", "where the light is, from mirror balls or specular lobes"},
    {"geometry", "LENS",
     "half vector, cosines and weight of every pixel, for nacre lut --geometry"},
    {"spectral", "[CURVE.csv...|RIG]", "effective wavelength and band, checked by a known grating"},
    {"bokeh", "IMAGE", "scale, turn, blur of bokeh photographs, from a known grating"},
    {0},
};

static const struct job {
    const char *name;
    bool (*run)(const struct calib_args *a, struct cli *cli, struct err *e);
} jobs[] = {
    {"dark", calib_dark},
    {"noise", calib_noise},
    {"response", calib_response},
    {"flat", calib_flat},
    {"geometry", calib_geometry},
    {"lens", calib_lens},
    {"board", calib_board},
    {"light", calib_light},
    {"spectral", calib_spectral},
    {"bokeh", calib_bokeh},
    {NULL, NULL},
};

static bool run(const void *args, struct cli *cli, struct err *e)
{
    struct cli rest = *cli;
    rest.n--;
    rest.operand++;
    for (const struct job *v = jobs; v->name; v++)
        if (!strcmp(v->name, cli->operand[0])) {
            if (rest.n < 1 && v->run != calib_board && v->run != calib_spectral)
                return err_set(e, ERR_USAGE, "calib %s: needs a file to work on", v->name);
            doc_text(cli->doc, "output", ((const struct calib_args *)args)->out);
            return v->run(args, &rest, e);
        }
    return err_set(e, ERR_USAGE,
                   "calib: '%.40s' is not one of dark, noise, response, flat, lens, board, light, "
                   "geometry, spectral, bokeh",
                   cli->operand[0]);
}

const struct command cmd_calib = {
    .name = "calib",
    .summary = "calibration records: what this rig really is",
    .operands = "VERB FILE...",
    .min_operands = 1,
    .max_operands = 256,
    .opts = opts,
    .args_size = sizeof(struct calib_args),
    .verbs = verbs,
    .notes =
        "  nacre calib dark dark*.dng -o dark.yaml\n"
        "  nacre calib noise session --filter open -o noise.yaml\n"
        "  nacre calib response bracket*.jpg -o response.yaml\n"
        "  nacre calib board --board 9x6 --square 25mm -o board.png\n"
        "  nacre calib lens board*.png --board 9x6 --square 25mm -o lens.yaml\n"
        "  nacre calib light ball1.exr ball2.exr --lens lens.yaml --radius 20mm -o light.yaml\n"
        "  nacre calib geometry lens.yaml --light light.yaml -o geometry.exr\n"
        "  nacre calib spectral filter.csv led.csv --grating ring.exr --lines 600/mm \\\n"
        "                       --geometry geometry.exr -o green.yaml\n"
        "  nacre calib bokeh grating.png --lines 600/mm --blaze 13deg -o bokeh.yaml",
    .run = run,
};

// cmd_calib.c - nacre calib: what this rig really is, as dated records.
#define _GNU_SOURCE
#include "ui/calib.h"
#include "ui/commands.h"
#include <string.h>

#define AT(field) offsetof(struct calib_args, field)
static const struct opt opts[] = {
    {"times", OPT_LIST, AT(times), "exif|T,..", "exif",
     "dark, noise, response: exposure times, from the files or given in their order"},
    {"method", OPT_CHOICE, AT(method), "debevec|robertson", "debevec",
     "response: least squares, or alternating estimates"},
    {"dark", OPT_FILE, AT(dark), "FILE", NULL, "noise, response of counts: a dark record"},
    {"black", OPT_NUM, AT(black), "COUNTS", NULL, "noise: the black level (default: the files')"},
    {"white", OPT_NUM, AT(white), "COUNTS", NULL,
     "noise, response of counts: where pixels saturate (default: the files')"},
    {"light", OPT_TEXT, AT(light), "NAME|FILE|X,Y,Z", NULL,
     "of a session or rig: this light; "
     "geometry: a light record, or X,Y,Z from the board's middle along t (right), b (up), n (to "
     "the camera)"},
    {"filter", OPT_TEXT, AT(filter), "NAME", NULL, "of a session or rig: this filter"},
    {"lines", OPT_NUM, AT(lines_per_m), "N", NULL,
     "bokeh, spectral: lines of the known grating, e.g. 600/mm", UNIT_PER_M},
    {"blaze", OPT_NUM, AT(blaze_rad), "ANGLE", NULL, "bokeh: its blaze angle, e.g. 13deg",
     UNIT_RAD},
    {"turn", OPT_TEXT, AT(turn), "auto|DEG", "auto",
     "geometry: of the sample on the board, from t towards b; bokeh: how far the sensor shows the "
     "sample turned counter-clockwise; auto: 0; by the lines, "
     "which "
     "stand upright on the sample"},
    {"channel", OPT_CHOICE, AT(channel), "r|g|b", NULL,
     "bokeh, spectral: the channel to use (default b; by the wavelength)"},
    {"board", OPT_TEXT, AT(board), "COLSxROWS", NULL,
     "lens, board: inner corners of a chessboard; with --marker squares of a ChArUco board"},
    {"square", OPT_NUM, AT(square_m), "D", NULL, "lens, board: side of a square", UNIT_M},
    {"marker", OPT_NUM, AT(marker_m), "D", NULL, "lens, board: side of a ChArUco board's markers",
     UNIT_M},
    {"dictionary", OPT_TEXT, AT(dictionary), "NAME", "4x4_50",
     "lens, board: of the markers: 4x4_50, 5x5_100, 6x6_250, original, 36h11 ..."},
    {"plane", OPT_FILE, AT(plane), "IMAGE", NULL,
     "lens, geometry: the picture whose board lay where the sample lies (default: the first)"},
    {"size", OPT_LIST, AT(size), "W,H", NULL,
     "geometry: the sample's extent about the board's middle"},
    {"beam", OPT_NUM, AT(beam), "N", "0",
     "geometry: the light's intensity falls as cos^N about its axis to the sample"},
    {"fresnel", OPT_CHOICE, AT(fresnel), "constant|schlick", "constant",
     "geometry: F over the angle, for the weights"},
    {"r0", OPT_NUM, AT(r0), "R0", "0.04", "geometry: reflectance at normal incidence, for schlick"},
    {"lens", OPT_FILE, AT(lens), "FILE", NULL, "light: the camera, a lens record"},
    {"radius", OPT_NUM, AT(radius_m), "R", NULL,
     "light: of the mirror ball in the pictures; without it they show specular lobes", UNIT_M},
    {"ball", OPT_LIST, AT(ball), "X,Y,R,..", NULL,
     "light: where the ball is in each picture, px (default: the largest thing)"},
    {"poses", OPT_LIST, AT(poses), "IMAGE,..", NULL,
     "light: for each lobe the picture whose board lay where the sample lay (default: all views of "
     "the lens record, in order)"},
    {"lambda", OPT_NUM, AT(lambda_m), "L", NULL, "spectral: in place of curves, a nominal band",
     UNIT_M},
    {"width", OPT_NUM, AT(width_m), "W", "10nm", "spectral: its full width at half maximum",
     UNIT_M},
    {"accuracy", OPT_NUM, AT(accuracy_m), "D", "1nm",
     "spectral: standard uncertainty of the curves' wavelengths", UNIT_M},
    {"grating", OPT_FILE, AT(grating), "PATTERN", NULL,
     "spectral: the pattern of a grating of known --lines, to check the wavelength by"},
    {"geometry", OPT_FILE, AT(geometry), "FILE", NULL, "spectral: half vectors of that pattern"},
    {"h-per-pixel", OPT_NUM, AT(h_per_px), "X", NULL, "spectral: or their step, and ..."},
    {"center", OPT_TEXT, AT(center), "X,Y", "auto", "spectral: ... the pixel where h = 0"},
    {"o", OPT_FILE, AT(out), "FILE", NULL, "the record", .needed = true},
    {0},
};

static const struct verb {
    const char *name;
    bool (*run)(const struct calib_args *a, struct cli *cli, struct err *e);
} verbs[] = {
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
    for (const struct verb *v = verbs; v->name; v++)
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
    .notes =
        "dark      FRAME...|SESSION   black level, read noise, dark current, hot pixels\n"
        "noise     FRAME...|SESSION   gain, read noise and PRNU from pairs of equal exposures\n"
        "response  IMAGE...|SESSION   the curve of 8-bit pictures; of counts a linearity check\n"
        "flat      PICTURE            vignetting and fall-off, from an even target\n"
        "lens      IMAGE...           focal length, distortion, poses, from a printed board\n"
        "board                        such a board, to print\n"
        "light     PICTURE...         where the light is, from mirror balls or specular lobes\n"
        "geometry  LENS               half vector, cosines and weight of every pixel: an .exr for\n"
        "                             nacre lut --geometry\n"
        "spectral  CURVE.csv...|RIG   effective wavelength and band, checked by a known grating\n"
        "bokeh     IMAGE              scale, turn, blur of bokeh photographs, from a grating\n"
        "  nacre calib noise session --filter open -o noise.yaml\n"
        "  nacre calib lens board*.png --board 9x6 --square 25mm -o lens.yaml\n"
        "  nacre calib light ball1.exr ball2.exr --lens lens.yaml --radius 20mm -o light.yaml\n"
        "  nacre calib geometry lens.yaml --light light.yaml -o geometry.exr\n"
        "  nacre calib spectral filter.csv led.csv --grating ring.exr --lines 600/mm \\\n"
        "                       --geometry geometry.exr -o green.yaml\n"
        "  nacre calib bokeh grating.png --lines 600/mm --blaze 13deg -o bokeh.yaml",
    .run = run,
};

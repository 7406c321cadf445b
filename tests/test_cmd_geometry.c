// test_cmd_geometry.c - nacre calib lens and geometry: a simulated board through a simulated lens,
// and what is refused.
#include "tests/test.h"

#include "core/imgfile.h"
#include "tests/run.h"

static void refused(const char *words, int status, const char *sentence)
{
    assert_refuses(words, status, sentence);
    assert_int_not_equal(access("out.yaml", F_OK), 0);
    assert_int_not_equal(access("out.exr", F_OK), 0);
}

// A board at (x, y, z) with its normal along (nx, ny, 1) before a lens that sees 45 degrees off its
// axis.
static void photograph(const char *name, const char *board, double x, double y, double z, double nx,
                       double ny)
{
    char words[200];
    FILE *f = fopen("scene.yaml", "w");
    fprintf(f,
            "sample: {kind: flat}\n"
            "view:\n  kind: camera\n  width: 640\n  height: 480\n  camera: [0m, 0m, 0.5m]\n"
            "  target: [0m, 0m, 0m]\n  sample: [%gm, %gm, %gm]\n  normal: [%g, %g, 1]\n"
            "  light: [0.2m, 0.1m, 0.9m]\n  focal: 2mm\n  pixel: 5um\n  center-x: 322px\n"
            "  center-y: 237px\n  distortion: [-0.12, 0.03, 0.0007, -0.0004, 0]\n"
            "  defocus: 0.6px\nboard: %s\n",
            x, y, z, nx, ny, board);
    fclose(f);
    snprintf(words, sizeof words, "simulate scene.yaml --what board -o %s", name);
    do_run(words);
}

static const double pose[][5] = {
    {0, 0, 0, 0, 0},           {-.15, -.1, 0.05, 0.4, 0.1}, {.15, -.1, 0, -0.1, 0.4},
    {-.15, .1, 0.1, 0.3, -.4}, {.15, .1, 0.05, -0.4, -.2},  {0, 0.02, 0.12, 0.5, 0.3},
};

static void photograph_all(const char *board)
{
    for (int k = 0; k < 6; k++) {
        char name[20];
        snprintf(name, sizeof name, "%d.png", k);
        photograph(name, board, pose[k][0], pose[k][1], pose[k][2], pose[k][3], pose[k][4]);
    }
}

// The largest differences of u, v, w; the weights' relative ones.
static void assert_geometry(const char *got, const char *truth)
{
    struct image a, b;
    struct err e;
    assert_true(image_read(&a, got, &e));
    assert_true(image_read(&b, truth, &e));
    assert_int_equal(a.w, b.w);
    assert_int_equal(a.nc, 7);
    double worst = 0, weight = 0;
    int apart = 0;
    for (size_t k = 0; k < (size_t)a.w * (size_t)a.h; k++) {
        const float *p = a.px + 7 * k, *q = b.px + 4 * k;
        if (isnan(p[0]) || isnan(q[0])) { // the rim may fall to either side
            apart += isnan(p[0]) != isnan(q[0]);
            continue;
        }
        for (int c = 0; c < 3; c++)
            worst = fmax(worst, fabs((double)(p[c] - q[c])));
        weight = fmax(weight, fabs((double)(p[3] / q[3] - 1)));
    }
    assert_in_range(apart, 0, a.w + a.h);
    assert_near(worst, 0, 2e-4);
    assert_near(weight, 0, 5e-4);
    image_finish(&a);
    image_finish(&b);
}

TEST(a_chessboard_gives_every_pixel_its_half_vector)
{
    enter_scratch("calib_geometry");
    photograph_all("{squares: [10, 7], square: 40mm}");
    struct run r =
        do_run("calib lens 0.png 1.png 2.png 3.png 4.png 5.png --board 9x6 --square 40mm "
               "-o lens.yaml --json");
    assert_non_null(strstr(r.out, "\"focal_px\": ["));
    photograph("truth.png", "{squares: [10, 7], square: 40mm}", 0, 0, 0, 0, 0);
    do_run("simulate scene.yaml --what geometry -o truth.exr");
    do_run("calib geometry lens.yaml --light 0.2m,0.1m,0.9m --beam 1 --size 1m,1m -o geometry.exr");
    assert_geometry("geometry.exr", "truth.exr");

    // of 25 by 20 cm only a part of the picture is sample
    assert_int_equal(system("sed -i 's/^view:/view:\\n  size: [0.25m, 0.2m]/' scene.yaml"), 0);
    do_run("simulate scene.yaml --what geometry -o truth.exr");
    r = do_run("calib geometry lens.yaml --light 0.2m,0.1m,0.9m --beam 1 --size 250mm,200mm -o "
               "geometry.exr");
    assert_non_null(strstr(r.out, "seen_share"));

    refused("calib geometry lens.yaml --light 0m,0m,-0.5m -o out.exr", 3,
            "the light is not on the camera's side of the sample");
    refused("calib geometry lens.yaml --light 1m,2m -o out.exr", 2, "is not X,Y,Z");
    refused("calib geometry lens.yaml -o out.exr", 2, "give the light");
    refused("calib geometry lens.yaml --light lens.yaml -o out.exr", 3,
            "is a lens record, not a light record");
    refused("calib geometry lens.yaml --light 0m,0m,1m --plane 7.png -o out.exr", 3,
            "lens.yaml: has no view --plane 7.png");
    refused("calib geometry lens.yaml --light 0m,0m,1m -o out.yaml", 3, "is an .exr");

    // its pictures were of another size, camera and focus
    do_run("simulate sim -o small.exr");
    refused("lut small.exr --lambda 530nm --geometry geometry.exr --range 0.3 --size 32 -o out.exr",
            3, "geometry.exr: made at 640 x 480 pixels, but this is 1000 x 1000");
}

TEST(a_charuco_board_may_be_cut_off)
{
    enter_scratch("calib_charuco");
    do_run("calib board --board 11x8 --square 40mm --marker 30mm -o board.png");
    photograph_all("{picture: board.png, size: [0.52m, 0.4m]}");
    photograph("6.png", "{picture: board.png, size: [0.52m, 0.4m]}", 0.35, 0.2, 0, 0, 0);
    do_run("calib lens 0.png 1.png 2.png 3.png 4.png 5.png 6.png --board 11x8 --square 40mm "
           "--marker 30mm --plane 6.png -o lens.yaml");
    photograph("truth.png", "{squares: [10, 7], square: 40mm}", 0.35, 0.2, 0, 0, 0);
    do_run("simulate scene.yaml --what geometry -o truth.exr");
    do_run("calib geometry lens.yaml --light -0.15m,-0.1m,0.9m --beam 1 --size 1m,1m "
           "-o geometry.exr");
    assert_geometry("geometry.exr", "truth.exr");
    refused("calib lens 0.png 1.png 2.png --board 11x8 --square 40mm --marker 30mm --dictionary "
            "9x9_1 -o out.yaml",
            3, "no dictionary '9x9_1'; there are 4x4_50 ");
    refused("calib lens 0.png 1.png 2.png --board 11x8 --square 40mm --marker 50mm -o out.yaml", 3,
            "--marker between 0 and --square");
}

TEST(views_that_tell_no_camera_are_refused)
{
    static const char board[] = "{squares: [10, 7], square: 30mm}";
    enter_scratch("calib_views");
    for (int k = 0; k < 4; k++) { // alike: the board slides along a line
        char name[20];
        snprintf(name, sizeof name, "%d.png", k);
        photograph(name, board, -0.1 + 0.06 * k, 0.02 * k, 0, 0, 0);
    }
    photograph("edge.png", board, 0, 0, 0, 0, 30);
    refused("calib lens 0.png 1.png --board 9x6 --square 30mm -o out.yaml", 3,
            "2 views of the board: needs 3 or more, tilted differently");
    refused("calib lens 0.png 1.png 2.png 3.png --board 9x6 --square 30mm -o out.yaml", 3,
            "the board is tilted alike in all 4 views");
    refused("calib lens edge.png edge.png edge.png --board 9x6 --square 30mm -o out.yaml", 3,
            "a board seen edge-on or cut off cannot be found");
    refused("calib lens 0.png 1.png 2.png --board 9 --square 30mm -o out.yaml", 2,
            "is not COLSxROWS such as 9x6");
    refused("calib lens 0.png --square 30mm -o out.yaml", 2, "give the target");
    do_run("simulate sim -o other.exr");
    refused("calib lens 0.png other.exr 1.png --board 9x6 --square 30mm -o out.yaml", 3,
            "other.exr: the first picture: made at 640 x 480 pixels, but this is 1000 x 1000");
}

TEST_MAIN(cmocka_unit_test(a_chessboard_gives_every_pixel_its_half_vector),
          cmocka_unit_test(a_charuco_board_may_be_cut_off),
          cmocka_unit_test(views_that_tell_no_camera_are_refused))

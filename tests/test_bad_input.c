// test_bad_input.c - every kind of bad input at the command line: one clear line, the documented
// exit code, no output file.
#include "core/imgfile.h"
#include "tests/run.h"
#include "tests/test.h"

static void write_text(const char *path, const char *text, size_t size)
{
    FILE *f = fopen(path, "wb");
    assert_int_equal(fwrite(text, 1, size, f), size);
    fclose(f);
}

// A flat picture; values of 8-bit formats are linear and encoded on writing.
static void write_flat(const char *path, int w, int h, float value)
{
    struct image im;
    struct err e = {0};
    assert_true(image_init(&im, w, h, 3, &e));
    for (int k = 0; k < w * h * 3; k++)
        im.px[k] = value;
    if (!image_write(&im, path, &e))
        fail_msg("%s", e.msg);
    image_finish(&im);
}

static void copy_part(const char *from, const char *to, double part)
{
    static char data[1 << 20];
    FILE *f = fopen(from, "rb");
    const size_t n = fread(data, 1, sizeof data, f);
    fclose(f);
    write_text(to, data, (size_t)(part * (double)n));
}

static void make_inputs(void)
{
    write_flat("a.jpg", 32, 24, 0.2f);
    write_flat("b.jpg", 32, 24, 0.4f);
    write_flat("small.jpg", 16, 24, 0.4f);
    write_flat("white1.jpg", 32, 24, 1);
    write_flat("white2.jpg", 32, 24, 1);
    write_flat("good.exr", 64, 64, 0.5f);
    copy_part("good.exr", "cut.exr", 0.6);
    copy_part("a.jpg", "cut.jpg", 0.3);
    write_text("text.jpg", "this is not a picture\n", 22);
    write_text("text.exr", "this is not a picture\n", 22);
    write_flat("good.pfm", 8, 8, 0.5f);
    struct image im;
    struct err e = {0};
    assert_true(image_read(&im, "good.pfm", &e));
    im.px[(3 * 8 + 5) * 3] = NAN;
    assert_true(image_write(&im, "nan.pfm", &e));
    image_finish(&im);
    write_text("zero.pfm", "PF\n0 8\n-1.0\n", 12);
    write_text("negative.pfm", "PF\n-8 8\n-1.0\n", 13);
    write_text("huge.pfm", "PF\n60000 60000\n-1.0\n", 20);
}

// What a table needs, before a case's own words: of a repeated option the last one counts.
#define LUT                                                                                        \
    "lut --lambda 530nm --h-per-pixel 0.01 --illuminant E --f0 1 --size 33 --range 0.05 --power "  \
    "1 -o out.exr "

static const struct {
    const char *words;
    int status;
    const char *names[2]; // what the line must name: the file or option, and the reason
} cases[] = {
    {"hdr absent.jpg b.jpg --times 1,2 -o out.exr", 5, {"absent.jpg", "No such file"}},
    {"hdr a.jpg text.jpg --times 1,2 -o out.exr", 3, {"text.jpg", ""}},
    {"hdr a.jpg cut.jpg --times 1,2 -o out.exr", 3, {"cut.jpg", ""}},
    {"hdr a.jpg small.jpg --times 1,2 -o out.exr", 3, {"small.jpg", "16 x 24"}},
    {"hdr a.jpg b.jpg --times 1,1 -o out.exr", 3, {"b.jpg", "exposure time"}},
    {"hdr a.jpg b.jpg --times exif -o out.exr", 3, {"a.jpg", "EXIF"}},
    {"hdr a.jpg b.jpg --times 1,-1 -o out.exr", 3, {"-1", ""}},
    {"hdr a.jpg b.jpg --times 1,zwei -o out.exr", 2, {"zwei", "is not a time"}},
    {"hdr a.jpg b.jpg --times 1 -o out.exr", 3, {"--times", "2"}},
    {"hdr white1.jpg white2.jpg --times 1,2 -o out.exr", 3, {"white", "saturated"}},
    {"hdr a.jpg --times 1 -o out.exr", 3, {"", "two"}},
    {"hdr nan.pfm good.pfm --times 1,2 --linear -o out.exr", 3, {"nan.pfm", "NaN"}},
    {"hdr -o out.exr", 2, {"IMAGE", ""}},
    {"hdr a.jpg b.jpg", 2, {"-o", ""}},
    {"convert absent.exr out.exr", 5, {"absent.exr", "No such file"}},
    {"convert cut.exr out.exr", 3, {"cut.exr", ""}},
    {"convert text.exr out.exr", 3, {"text.exr", ""}},
    {"convert text.jpg out.exr", 3, {"text.jpg", ""}},
    {"convert zero.pfm out.exr", 3, {"zero.pfm", "0 x 8"}},
    {"convert negative.pfm out.exr", 3, {"negative.pfm", "-8 x 8"}},
    {"convert huge.pfm out.exr", 3, {"huge.pfm", ""}},
    {"convert good.exr out.xyz", 3, {"out.xyz", ""}},
    {"convert good.exr nowhere/out.exr", 5, {"nowhere", ""}},
    {"compare good.exr a.jpg", 3, {"good.exr", "sizes must agree"}},
    {"prefilter nan.pfm --lut good.pfm --range 0.3 --power 1 --tangent 1,0,0 --normal 0,0,1 --size "
     "9 -o out.exr",
     3,
     {"nan.pfm", ""}},
    {LUT "absent.pfm --center 4,4", 5, {"absent.pfm", "No such file"}},
    {LUT "good.pfm --center 4,4 --size 0", 3, {"size", "0"}},
    {LUT "good.pfm --center 4,4 --size -5", 3, {"size", "-5"}},
    {LUT "good.pfm --center 400,4", 3, {"400", "outside the 8 x 8 image"}},
    {"render absent.yaml -o out.png", 5, {"absent.yaml", "No such file"}},
    {"render text.jpg -o out.png", 3, {"text.jpg", ""}},
    {"capture --rig absent.yaml --plan absent.yaml -o out.exr", 5, {"absent.yaml", "No such file"}},
    {"capture --rig text.jpg --plan text.jpg -o out.exr", 3, {"text.jpg:1", ""}},
    {"nonsense", 2, {"nonsense", "unknown command"}},
    {"lut --nonsense", 2, {"--nonsense", "unknown option"}},
};

TEST(bad_input_gets_one_clear_line_the_exit_code_and_leaves_nothing)
{
    enter_scratch("bad_input");
    make_inputs();
    int failures = 0;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const struct run r = run_nacre(cases[k].words);
        const bool named = strstr(r.err, cases[k].names[0]) && strstr(r.err, cases[k].names[1]);
        const bool left =
            !access("out.exr", F_OK) || !access("out.png", F_OK) || !access("out.xyz", F_OK);
        const bool ok =
            r.status == cases[k].status && named && count_errors(r.err) == 1 && !left && !*r.out;
        if (!ok)
            print_message("nacre %s\n  exit %d, expected %d naming '%s' and '%s'%s:\n  %s%s\n",
                          cases[k].words, r.status, cases[k].status, cases[k].names[0],
                          cases[k].names[1], left ? ", left an output file" : "", r.err, r.out);
        failures += !ok;
        if (left && system("rm -rf out.exr out.png out.xyz"))
            failures++;
    }
    assert_int_equal(failures, 0);
    assert_int_equal(system("ls -A | grep -q '^\\.'"), 1 << 8); // no temporary file left behind
}

TEST_MAIN(cmocka_unit_test(bad_input_gets_one_clear_line_the_exit_code_and_leaves_nothing))

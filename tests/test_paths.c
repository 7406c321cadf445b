// test_paths.c - the same bytes from any number of threads, and from every processor's code.
#include "tests/test.h"

#include "core/imgfile.h"
#include "tests/run.h"

// In this order: what a command makes is there for the next. ulps: how far the code for one
// processor may be from another's; blurs fuse products and sums where the processor does.
static const struct {
    const char *out;
    double ulps;
    const char *words;
} steps[] = {
    {"pattern.pfm", 0, "convert pattern-seed.exr pattern.pfm"},
    {"exact.exr", 0,
     "lut pattern.pfm --lambda 530nm --h-per-pixel 3.6e-3 --center 99.5,99.5 --method exact "
     "--size 129 --range 0.24 -o exact.exr"},
    {"sampled.exr", 0,
     "lut pattern.pfm --lambda 530nm --h-per-pixel 2e-2 --center 99.5,99.5 --method sampled "
     "--size 33 --range 0.9 -o sampled.exr"},
    {"sharp.pfm", 16, "deconvolve pattern.pfm --sigma 1.7 --iterations 6 -o sharp.pfm"},
    {"wide.pfm", 16, "deconvolve pattern.pfm --sigma 12 --iterations 3 -o wide.pfm"},
    {"tables.exr", 0,
     "tables height.gsf --size 41 --power 1 --range 0.5 --tolerance 1e-2 -o tables.exr"},
    {"factors.exr", 0, "factor exact.exr --rank 2 -o factors.exr"},
    {"map.exr", 0,
     "prefilter studio --lut sampled.exr --tangent 1,0,0 --normal 0,0,1 --size 32 --products 4 "
     "-o map.exr"},
    {"slits.exr", 0,
     "slits --pitch 2um --width 0.5um --count 21 --window 0,0.02 --size 65 --range 0.5 -o "
     "slits.exr"},
    {"render.pfm", 0, "render scene.yaml --backend cpu --size 64x48 -o render.pfm"},
};
enum { STEPS = sizeof steps / sizeof *steps };

static void make_inputs(void)
{
    FILE *f = fopen("seed.yaml", "w");
    fputs("sample: {kind: lcd, pitch: 25um}\nview: {width: 200, height: 200, h-per-pixel: "
          "3.6e-3}\n",
          f);
    fclose(f);
    f = fopen("scene.yaml", "w");
    fputs("camera: {eye: [0, 0, 0.5], target: [0, 0, 0], fov: 20deg}\n"
          "lights: [{at: [12mm, 20mm, 0.5], intensity: 1}]\n"
          "sample: {shape: sphere, radius: 80mm, table: exact.exr, diffuse: 0.1, specular: 0.04}\n",
          f);
    fclose(f);
    do_run("simulate seed.yaml -o pattern-seed.exr");
    do_run("simulate " SOURCE_DIR "/rigs/samples/quasi-periodic.yaml --what height --pixel 1um "
           "--size 65 -o height.gsf");
}

static void make_all(const char *program, const char *env, const char *options, const char *folder)
{
    char line[1000];
    snprintf(line, sizeof line,
             "rm -rf %s && mkdir %s && cp pattern-seed.exr height.gsf scene.yaml %s", folder,
             folder, folder);
    assert_int_equal(system(line), 0);
    for (int k = 0; k < STEPS; k++) {
        snprintf(line, sizeof line, "cd %s && %s %s/%s %s %s --quiet >>log 2>&1 </dev/null", folder,
                 env, BIN_DIR, program, steps[k].words, options);
        if (system(line))
            fail_msg("%s: failed: see %s/log", line, folder);
    }
}

// The largest difference in units of the last place of the picture's largest sample, and how many
// samples differ.
static double apart(const char *folder_a, const char *folder_b, const char *name, long *differ)
{
    char path[200];
    struct image a, b;
    struct err e;
    double peak = 0, most = 0;
    snprintf(path, sizeof path, "%s/%s", folder_a, name);
    assert_true(image_read(&a, path, &e));
    snprintf(path, sizeof path, "%s/%s", folder_b, name);
    assert_true(image_read(&b, path, &e));
    assert_true(a.w == b.w && a.h == b.h && a.nc == b.nc);
    const size_t n = (size_t)a.w * (size_t)a.h * (size_t)a.nc;
    *differ = 0;
    for (size_t k = 0; k < n; k++) {
        *differ += memcmp(a.px + k, b.px + k, sizeof *a.px) != 0;
        if (isfinite(a.px[k]))
            peak = fmax(peak, fabs((double)a.px[k]));
        if (isfinite(a.px[k]) && isfinite(b.px[k]))
            most = fmax(most, fabs((double)a.px[k] - (double)b.px[k]));
        else
            assert_true(!isfinite(a.px[k]) && !isfinite(b.px[k]));
    }
    image_finish(&a);
    image_finish(&b);
    return peak > 0 ? most / (peak * 0x1p-24) : 0;
}

// The steps' own bounds, or one for all.
static void compare(const char *what, const char *a, const char *b, double all)
{
    for (int k = 0; k < STEPS; k++) {
        long differ;
        const double d = apart(a, b, steps[k].out, &differ);
        const double ulps = isnan(all) ? steps[k].ulps : all;
        if (differ)
            print_message("%s: %s: %ld samples differ, by %.3g ulp of the peak at most\n", what,
                          steps[k].out, differ, d);
        if (d > ulps)
            fail_msg("%s: %s: %g ulp of the peak", what, steps[k].out, d);
    }
}

TEST(one_two_and_seven_threads_give_the_same_bytes)
{
    enter_scratch("paths");
    make_inputs();
    make_all("nacre", "", "--threads 1", "one");
    make_all("nacre", "", "--threads 2", "two");
    make_all("nacre", "", "--threads 7", "seven");
    compare("2 threads", "one", "two", 0);
    compare("7 threads", "one", "seven", 0);
}

// Our own code for each. -ffp-contract=off leaves nothing that a vector's width could change, but
// where the code itself asks for fused products and sums.
TEST(avx512_avx2_and_baseline_code_differ_by_16_ulps_of_the_peak_where_sums_are_fused)
{
    enter_scratch("paths_code");
    make_inputs();
    make_all("nacre-baseline", "", "--threads 2", "baseline");
    if (!__builtin_cpu_supports("avx2"))
        skip();
    make_all("nacre-avx2", "", "--threads 2", "avx2");
    compare("AVX2", "baseline", "avx2", NAN);
    if (!__builtin_cpu_supports("avx512f"))
        return;
    make_all("nacre-avx512", "", "--threads 2", "avx512");
    compare("AVX-512", "baseline", "avx512", NAN);
}

// The C library's and OpenBLAS's too; only FFTW's choice cannot be taken from it.
TEST(a_processor_without_fma_is_within_64_ulps_of_the_peak)
{
    enter_scratch("paths_old");
    make_inputs();
    make_all("nacre", "", "--threads 2", "new");
    make_all("nacre-baseline",
             "GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA,-AVX2_Usable,-FMA_Usable "
             "OPENBLAS_CORETYPE=Nehalem",
             "--threads 2", "old");
    compare("without FMA", "new", "old", 64);
}

TEST_MAIN(cmocka_unit_test(one_two_and_seven_threads_give_the_same_bytes),
          cmocka_unit_test(
              avx512_avx2_and_baseline_code_differ_by_16_ulps_of_the_peak_where_sums_are_fused),
          cmocka_unit_test(a_processor_without_fma_is_within_64_ulps_of_the_peak))

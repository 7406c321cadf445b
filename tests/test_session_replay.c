// test_session_replay.c - what a session's products were made from and how is on record, and they
// can be made again, byte for byte.
#include "tests/test.h"

#include "core/outfile.h"
#include "tests/run.h"

static const char rig[] = "name: small\n"
                          "camera: {uri: 'sim:w=96,h=64,rig=@rig,world=@run', bits: 12}\n"
                          "lights:\n  trigger: 'sim:lines=1,world=@run'\n  list:\n"
                          "  - {name: led, line: 0, irradiance: 10, centre: 560nm, width: 180nm, "
                          "max_on: 2s}\n"
                          "filters:\n  trigger: 'sim:positions=1,world=@run'\n"
                          "  list: [{name: red, position: 0, centre: 650nm, width: 10nm, "
                          "throughput: 0.05}]\n";
static const char plan[] = "name: p\nlights: [led]\nfilters: [red]\n"
                           "exposures: {first: 1ms, last: 16ms, step: 1}\n";
static const char lut[] =
    "lut s/products/r.exr --lambda 650nm --h-per-pixel 7e-3 --center 47.5,31.5 "
    "--scale 0.25 --illuminant E --f0 0.2 --size 64 --range 0.24 --power 1";

static void expect(const char *words, int status, const char *in_out, const char *in_err)
{
    const struct run r = run_nacre(words);
    if (r.status != status || !strstr(r.out, in_out) || !strstr(r.err, in_err))
        fail_msg("nacre %s\n exit %d, expected %d with '%s' and '%s':\n%s%s", words, r.status,
                 status, in_out, in_err, r.out, r.err);
}

static void shell(const char *line)
{
    if (system(line))
        fail_msg("%s", line);
}

// A session of five frames, with two products one of which is made from the other.
static int make_original(void **state)
{
    char line[600];
    struct err e;
    (void)state;
    enter_scratch("session_replay");
    assert_true(outfile_write("rig.yaml", rig, sizeof rig - 1, &e));
    assert_true(outfile_write("plan.yaml", plan, sizeof plan - 1, &e));
    expect("capture --rig rig.yaml --plan plan.yaml -o s", 0, "complete", "");
    expect("hdr s -o s/products/r.exr", 0, "", "");
    snprintf(line, sizeof line, "%s -o s/products/t.exr", lut);
    expect(line, 0, "", "");
    return rename("s", "original");
}

static int setup(void **state)
{
    (void)state;
    return system("rm -rf s && cp -r original s");
}

TEST(products_are_on_record_and_come_out_the_same)
{
    expect("session show s --json", 0, "\"command\": \"nacre hdr . -o products/r.exr\"", "");
    expect("session replay s --verify --json", 0, "\"same\": 2", "");
    expect("session verify s", 0, "complete", "");
}

TEST(a_session_that_was_moved_or_exported_still_proves_its_products)
{
    expect("session export s -o bag", 0, "", "");
    shell("mkdir away && mv s 'away/a b' && cp -r 'away/a b' s2");
    expect("session replay 'away/a b' --verify --json", 0, "\"same\": 2", "");
    expect("session replay s2 --verify --json", 0, "\"same\": 2", "");
    expect("session replay bag/data --verify --json", 0, "\"same\": 2", "");
}

TEST(the_same_command_from_another_folder_makes_the_same_bytes)
{
    shell("cp s/products/r.exr r1.exr && mkdir deep");
    char line[1200];
    snprintf(line, sizeof line, "cd deep && %s/nacre hdr ../s -o ../s/products/r.exr >out 2>err",
             BIN_DIR);
    shell(line);
    shell("cmp r1.exr s/products/r.exr");
    expect("session replay s --verify --json", 0, "\"same\": 2", "");
}

TEST(a_product_that_was_changed_or_lost_is_named)
{
    shell("printf x >> s/products/t.exr");
    expect("session replay s --verify", 6, "",
           "1 of 2 products cannot be proven: products/t.exr: the file is not the one");
    shell("rm s/products/t.exr");
    expect("session replay s --verify", 6, "", "products/t.exr: No such file");
    // Without --verify it is made once more, and then all is well.
    expect("session replay s", 0, "", "");
    expect("session replay s --verify --json", 0, "\"same\": 2", "");
}

TEST(a_changed_input_is_named)
{
    shell("printf x >> s/products/r.exr");
    expect("session replay s --verify --json", 6, "its input products/r.exr has changed since",
           "2 of 2 products");
    expect("session replay s", 0, "", "");
    expect("session replay s --verify", 0, "", "");
}

TEST(a_list_of_records_is_found_from_within_and_on_record)
{
    char line[600];
    shell("printf 'nm,value\n640,0\n650,1\n660,0\n' >band.csv");
    snprintf(line, sizeof line, "%s --band band.csv -o s/products/b.exr", lut);
    expect(line, 0, "", "");
    expect("session replay s --verify --json", 0, "\"same\": 3", "");
    shell("printf '670,0\n' >>band.csv");
    expect("session replay s --verify", 6, "", "band.csv");
}

TEST(an_altered_frame_is_named)
{
    shell("printf x | dd of=s/frames/000002.dng bs=1 seek=3000 conv=notrunc 2>dd");
    expect("session replay s --verify", 6, "", "frames/000002.dng: its content has changed");
    expect("capture --rig rig.yaml --plan plan.yaml -o s --resume", 0, "complete", "");
    expect("session replay s --verify --json", 6, "\"result\": \"same\"",
           "1 of 2 products cannot be proven: products/r.exr: its input (the session's frames)");
}

TEST(a_product_elsewhere_is_on_record_too)
{
    expect("hdr s -o else.pfm", 0, "", "");
    expect("session replay s --verify --json", 0, "\"same\": 3", "");
    shell("mv s moved");
    expect("session replay moved --verify --json", 0, "\"skipped\": 1", "");
}

TEST(a_product_made_again_replaces_its_record)
{
    expect("hdr s --method debevec -o s/products/r.exr", 0, "", "");
    expect("session replay s --verify", 6, "", "products/t.exr: its input products/r.exr");
    char line[600];
    snprintf(line, sizeof line, "%s -o s/products/t.exr", lut);
    expect(line, 0, "", "");
    expect("session replay s --verify --json", 0, "\"same\": 2", "");
    expect("hdr s --group 7 -o s/products/no.exr", 3, "", "no good frames");
    expect("session replay s --verify --json", 0, "\"same\": 2", ""); // a failed command left none
}

#define T(name) cmocka_unit_test_setup(name, setup)
int main(void)
{
    const struct CMUnitTest tests[] = {
        T(products_are_on_record_and_come_out_the_same),
        T(a_session_that_was_moved_or_exported_still_proves_its_products),
        T(the_same_command_from_another_folder_makes_the_same_bytes),
        T(a_product_that_was_changed_or_lost_is_named),
        T(a_changed_input_is_named),
        T(a_list_of_records_is_found_from_within_and_on_record),
        T(an_altered_frame_is_named),
        T(a_product_elsewhere_is_on_record_too),
        T(a_product_made_again_replaces_its_record),
    };
    return cmocka_run_group_tests(tests, make_original, NULL);
}

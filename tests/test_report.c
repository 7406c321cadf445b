// test_report.c - nacre report, and the workflow that calls it.
#include "tests/run.h"

#include "core/imgfile.h"

static void put(const char *path, const char *text)
{
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    fputs(text, f);
    fclose(f);
}

static char *get(const char *path)
{
    static char text[65536];
    FILE *f = fopen(path, "r");
    assert_non_null(f);
    text[fread(text, 1, sizeof text - 1, f)] = 0;
    fclose(f);
    return text;
}

static void make_table(const char *path)
{
    struct err e;
    struct image im;
    assert_true(image_init(&im, 4, 4, 3, &e));
    meta_set_text(&im.meta, "nacre.command", "nacre lut <photo> & more");
    meta_set_text(&im.meta, "nacre.version", "0.1.0");
    assert_true(image_write(&im, path, &e));
    image_finish(&im);
}

static const char list[] = "title: Two\n"
                           "samples:\n"
                           "- name: good\n"
                           "  stages:\n"
                           "  - {stage: table, file: table.exr, log: table.log, time: table.tsv}\n"
                           "  - {stage: report, file: good.json, log: good.log, time: good.tsv}\n"
                           "- name: broken\n"
                           "  stages:\n"
                           "  - {stage: photo, file: table.exr, log: table.log}\n"
                           "  - {stage: proof, file: none.json, log: proof.log}\n"
                           "  - {stage: report, file: none-either.json, log: no.log}\n";

TEST(a_card_tells_sums_commands_and_errors)
{
    enter_scratch("report_card");
    make_table("table.exr");
    put("error.json", "{\"relative_l2\": 0.0125, \"worst_of_peak\": 0.5}");
    put("record.yaml", "kind: x\nversion: 0.1.0\ncommand: nacre calib dark\n");
    do_run("report sample lcd table=table.exr error=error.json dark=record.yaml -o card.json");
    const char *card = get("card.json");
    assert_non_null(strstr(card, "\"error\": 0.0125"));
    assert_non_null(strstr(card, "\"command\": \"nacre lut <photo> & more\""));
    assert_non_null(strstr(card, "\"command\": \"nacre calib dark\""));
    assert_non_null(strstr(card, "\"sha256\": \""));
    char first[8192];
    snprintf(first, sizeof first, "%.8191s", card);
    do_run("report sample lcd table=table.exr error=error.json dark=record.yaml -o card.json");
    assert_string_equal(get("card.json"), first);
}

TEST(a_card_of_what_is_not_there_is_refused)
{
    enter_scratch("report_refused");
    put("error.json", "[1]");
    assert_refuses("report sample lcd table=absent.exr -o card.json", 5, "absent.exr");
    assert_refuses("report sample lcd table -o card.json", 2, "'table' is not STAGE=FILE");
    assert_refuses("report sample lcd a.b=error.json -o card.json", 2, "no dot");
    assert_refuses("report sample lcd error=error.json -o card.json", 3, "not a JSON object");
    assert_refuses("report page lcd -o card.json", 2, "'page' is not one of sample, library");
    assert_refuses("report library absent.yaml -o .", 5, "absent.yaml");
    put("list.yaml", "samples:\n- {name: a, stages: []}\n");
    assert_refuses("report library list.yaml -o .", 3, "list.yaml:2");
    assert_int_not_equal(access("card.json", F_OK), 0);
    assert_int_not_equal(access("index.html", F_OK), 0);
}

TEST(a_library_names_what_failed_and_where_and_says_partial)
{
    enter_scratch("report_library");
    make_table("table.exr");
    put("table.tsv", "s\th:m:s\tmax_rss\n2.5\t0:00:02\t96.5\n");
    put("table.log", "");
    put("proof.log", "nacre: session: frames/000003.dng: SHA-256 differs, \"<so>\"\n");
    put("list.yaml", list);
    do_run("report sample good table=table.exr -o good.json");
    assert_refuses("report library list.yaml -o .", 6, "1 of 2 samples are done");
    const char *page = get("index.html");
    assert_non_null(strstr(page, "nacre lut &lt;photo&gt; &amp; more"));
    assert_non_null(strstr(page, "proof: nacre: session: frames/000003.dng: SHA-256 differs, "
                                 "&quot;&lt;so&gt;&quot;"));
    const char *csv = get("samples.csv");
    assert_non_null(strstr(csv, "\ngood,done,,,2.5,96.5,\"\",\"\",\"table.exr\",\""));
    assert_non_null(strstr(csv, "\nbroken,missing,,,0,,\"proof\",\"nacre: session: "));
    assert_non_null(strstr(csv, "\"\"<so>\"\""));
}

// The products that a list leads to, by a dry run, one a line.
static void plan(const char *options, const char *to)
{
    char line[2400];
    snprintf(line, sizeof line,
             "{ cat head.yaml; echo 'options: {%s}'; } >list.yaml && "
             "NACRE=%s/nacre %s/workflows/run list.yaml out -n 2>plan.err | "
             "sed -n 's/^    output: //p' | tr ',' '\\n' | sort >%s",
             options, BIN_DIR, SOURCE_DIR, to);
    assert_int_equal(system(line), 0);
    if (!*get(to))
        fail_msg("no products: %s", get("plan.err"));
}

// The stages of the products that `b` has and `a` has not, in one line.
static const char *fresh(const char *a, const char *b)
{
    char line[400];
    snprintf(
        line, sizeof line,
        "comm -13 %s %s | sed 's|.*/\\(.*\\)-[0-9a-f]\\{12\\}.*|\\1|' | sort | tr '\\n' ' ' >fresh",
        a, b);
    assert_int_equal(system(line), 0);
    return get("fresh");
}

TEST(a_changed_option_renames_only_what_depends_on_it)
{
    if (system("snakemake --version >/dev/null 2>&1") != 0) {
        print_message("skipped: Snakemake 7 is not installed (tools/deps.sh --library)\n");
        skip();
    }
    enter_scratch("workflow");
    char line[2000];
    snprintf(line, sizeof line,
             "base: %s/workflows\nrig: ../rigs/sim.yaml\nscene: ../rigs/scenes/plane.yaml\n"
             "plans: {photo: pattern.yaml, blur: highlight.yaml}\n"
             "grating: {scene: ../rigs/samples/blazed.yaml}\n"
             "samples:\n- {name: lcd, scene: ../rigs/samples/lcd.yaml}\n",
             SOURCE_DIR);
    put("head.yaml", line);
    plan("factors: {rank: 3}", "a");
    plan("factors: {rank: 3}", "same");
    assert_string_equal(fresh("a", "same"), "");
    plan("factors: {rank: 4}", "b");
    assert_string_equal(fresh("a", "b"), "factors report ");
    plan("factors: {rank: 3}, radiance: {method: debevec}", "c");
    assert_string_equal(fresh("a", "c"), "error factors radiance render report table ");
    plan("factors: {rank: 3}, scale: {lines: 300/mm}", "d"); // shared by all samples
    assert_string_equal(fresh("a", "d"), "bokeh height report scale tables ");
}

TEST_MAIN(cmocka_unit_test(a_card_tells_sums_commands_and_errors),
          cmocka_unit_test(a_card_of_what_is_not_there_is_refused),
          cmocka_unit_test(a_library_names_what_failed_and_where_and_says_partial),
          cmocka_unit_test(a_changed_option_renames_only_what_depends_on_it))

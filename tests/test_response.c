// test_response.c - recovering a camera's curve from a bracket: known curves, records, failures.
#include "tests/test.h"

#include "calib/response_file.h"
#include "core/mem.h"

enum { W = 120, H = 80, N = 6 };

struct scene {
    uint8_t code[N][W * H * 3];
    const uint8_t *ptr[N];
    double time_s[N];
    struct bracket b;
};

// Film-like curves of their own for every channel, as code = 255 f(exposure).
static double film(double x, int c)
{
    const double gamma[] = {0.45, 0.5, 0.42};
    return 255 * (1 - exp(-pow(x, gamma[c]) * (1.2 + 0.1 * c)));
}
static double film_inverse(double code, int c)
{
    const double gamma[] = {0.45, 0.5, 0.42};
    return pow(-log(1 - code / 255) / (1.2 + 0.1 * c), 1 / gamma[c]);
}

// A smooth scene over 14 stops with some noise; shutter errors in log_error, in even stops.
static struct scene *shoot(const double *log_error)
{
    struct scene *s = xcalloc(1, sizeof *s);
    uint32_t seed = 1;
    for (int j = 0; j < N; j++) {
        s->time_s[j] = exp2(-2 * j);
        s->ptr[j] = s->code[j];
        for (int k = 0; k < W * H; k++)
            for (int c = 0; c < 3; c++) {
                const double radiance = exp2(-4 + 14.0 * (k % W) / W + 0.5 * sin(k / W * 0.1 + c));
                const double x = radiance * s->time_s[j] * exp(log_error ? log_error[j] : 0);
                seed = seed * 1664525 + 1013904223;
                const double noise = (seed >> 8) / 16777216.0 * 2 - 1;
                s->code[j][3 * k + c] = (uint8_t)fmax(0, fmin(255, film(x, c) + noise + 0.5));
            }
    }
    s->b = (struct bracket){N, W, H, 3, s->ptr, s->time_s};
    return s;
}

static double worst_error(const struct response *r, int from, int to)
{
    double worst = 0;
    for (int c = 0; c < 3; c++) {
        const double middle = log(film_inverse(RESPONSE_MIDDLE, c));
        for (int z = from; z <= to; z++)
            worst = fmax(worst, fabs(r->log_x[c][z] - log(film_inverse(z, c)) + middle));
    }
    return worst;
}

TEST(debevec_finds_the_curves_of_three_channels)
{
    struct scene *s = shoot(NULL);
    struct response r;
    struct err e;
    assert_true(response_debevec(&r, &s->b, NULL, &e));
    assert_near(worst_error(&r, 30, 230), 0, 0.04);
    for (int c = 0; c < 3; c++)
        for (int z = 1; z < RESPONSE_CODES; z++)
            assert_true(r.log_x[c][z] >= r.log_x[c][z - 1]);
    free(s);
}

TEST(debevec_finds_shutter_errors_that_are_no_trend)
{
    const double wrong[N] = {0, 0, 0.03, -0.03, 0, 0};
    struct scene *s = shoot(wrong);
    struct response r;
    struct err e;
    double found[N];
    assert_true(response_debevec(&r, &s->b, found, &e));
    assert_near(found[2] - found[3], 0.06, 0.02);
    free(s);
}

TEST(robertson_finds_the_curves_of_three_channels)
{
    struct scene *s = shoot(NULL);
    struct response r;
    struct err e;
    assert_true(response_robertson(&r, &s->b, &e));
    assert_near(worst_error(&r, 60, 200), 0, 0.12); // known to be the weaker one in the tails
    free(s);
}

TEST(a_record_reads_back_as_it_was_written)
{
    struct response r, back;
    struct record rec, head;
    struct err e = {0};
    response_srgb(&r, 3);
    record_init(&rec, "response", "test", 0.01, "rms of ln X");
    snprintf(rec.device, sizeof rec.device, "A \"quoted\" camera");
    char path[] = "/tmp/nacre-response-XXXXXX";
    close(mkstemp(path));
    if (!response_write(&r, &rec, "nacre calib response", path, &e) ||
        !response_read(&back, &head, path, &e))
        fail_msg("%s", e.msg);
    assert_string_equal(head.device, rec.device);
    assert_string_equal(head.date, rec.date);
    for (int z = 0; z < RESPONSE_CODES; z++)
        assert_near(back.log_x[1][z], r.log_x[1][z], 1e-8);

    struct record now = head;
    assert_true(record_fits(&head, path, &now, &e));
    snprintf(now.device, sizeof now.device, "Another");
    assert_false(record_fits(&head, "r.yaml", &now, &e));
    assert_string_equal(e.msg,
                        "r.yaml: made with camera 'A \"quoted\" camera', but this is 'Another'");
    now = head;
    snprintf(now.date, sizeof now.date, "2020-06-01T10:00:00");
    snprintf(head.date, sizeof head.date, "2019-06-03T10:00:00");
    assert_true(record_fits(&head, "r.yaml", &now, &e)); // 364 days, as 2020 leaps
    snprintf(head.date, sizeof head.date, "2019-05-31");
    assert_false(record_fits(&head, "r.yaml", &now, &e));
    assert_string_equal(e.msg, "r.yaml: made on 2019-05-31 and valid for 365 days, but this is of "
                               "2020-06-01: calibrate again");
    head.valid_days = NAN;
    assert_true(record_fits(&head, "r.yaml", &now, &e));
    unlink(path);
}

TEST(a_record_of_another_kind_or_a_falling_curve_is_refused)
{
    struct response r;
    struct record rec, head;
    struct err e = {0};
    char path[] = "/tmp/nacre-response-XXXXXX";
    close(mkstemp(path));
    response_srgb(&r, 1);
    r.log_x[0][100] = 9;
    record_init(&rec, "response", "test", 0, "");
    assert_true(response_write(&r, &rec, "", path, &e));
    assert_false(response_read(&r, &head, path, &e));
    assert_non_null(strstr(e.msg, "falls from code 100 to 101"));
    record_init(&rec, "dark", "test", 0, "");
    assert_true(response_write(&r, &rec, "", path, &e));
    assert_false(response_read(&r, &head, path, &e));
    assert_non_null(strstr(e.msg, "is a dark record, not a response record"));
    assert_int_equal(e.code, ERR_DATA);
    unlink(path);
}

TEST(frames_that_say_nothing_are_refused)
{
    struct scene *s = shoot(NULL);
    struct response r;
    struct err e;
    memset(s->code, 255, sizeof s->code);
    assert_false(response_debevec(&r, &s->b, NULL, &e));
    assert_non_null(strstr(e.msg, "neither black nor saturated"));
    memset(s->code, 0, sizeof s->code);
    assert_false(response_robertson(&r, &s->b, &e));
    s->b.n = 1;
    assert_false(response_debevec(&r, &s->b, NULL, &e));
    assert_non_null(strstr(e.msg, "2 to 64 frames, not 1"));
    free(s);
}

TEST_MAIN(cmocka_unit_test(debevec_finds_the_curves_of_three_channels),
          cmocka_unit_test(debevec_finds_shutter_errors_that_are_no_trend),
          cmocka_unit_test(robertson_finds_the_curves_of_three_channels),
          cmocka_unit_test(a_record_reads_back_as_it_was_written),
          cmocka_unit_test(a_record_of_another_kind_or_a_falling_curve_is_refused),
          cmocka_unit_test(frames_that_say_nothing_are_refused))

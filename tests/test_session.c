// test_session.c - what is acknowledged is on disk, what is on disk is checked.
#include "tests/test.h"

#include "core/outfile.h"
#include "core/session.h"
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>

static char folder[64];

static char *in(const char *name)
{
    static char path[4][128];
    static int turn;
    char *p = path[turn++ % 4];
    snprintf(p, sizeof path[0], "%s/%s", folder, name);
    return p;
}

static int setup(void **state)
{
    (void)state;
    strcpy(folder, "/tmp/nacre_test_XXXXXX");
    if (!mkdtemp(folder))
        return -1;
    struct err e;
    return outfile_write(in("plan.yaml"), "name: p\n", 8, &e) ? 0 : -1;
}

static int teardown(void **state)
{
    (void)state;
    char cmd[100];
    snprintf(cmd, sizeof cmd, "rm -rf %s", folder);
    return system(cmd);
}

static struct session *made(int steps)
{
    struct rig rig;
    struct err e = {0};
    struct session *s = NULL;
    if (!rig_open(&rig, SOURCE_DIR "/rigs/sim.yaml", &e) ||
        !session_create(&s, in("s"), &rig, in("plan.yaml"), &e))
        fail_msg("%s", e.msg);
    rig_finish(&rig);
    struct session_step step[20] = {0};
    for (int k = 0; k < steps; k++) {
        step[k] = (struct session_step){.index = k,
                                        .group = k / 3,
                                        .exposure_ns = 1000000L << k,
                                        .gain = 1,
                                        .focus_per_m = NAN};
        strcpy(step[k].light, "led");
        strcpy(step[k].filter, "red");
    }
    if (!session_add_steps(s, step, steps, true, &e))
        fail_msg("%s", e.msg);
    return s;
}

static void shoot(struct session *s, int step, const char *verdict)
{
    struct err e = {0};
    uint16_t raw[6] = {1, 2, 3, 4, 5, (uint16_t)step};
    struct dng picture = {.w = 3, .h = 2, .white = 4095, .gain = 1, .raw = raw};
    struct session_frame f = {.id = session_next_id(s),
                              .step.index = step,
                              .attempt = 1,
                              .seq = 7,
                              .reported_ns = 123,
                              .gain = 1,
                              .focus_per_m = NAN,
                              .temperature_k = 300.5,
                              .measured_sigma = NAN,
                              .w = 3,
                              .h = 2,
                              .white = 4095};
    strcpy(f.verdict, verdict);
    if (!session_add_frame(s, &f, &picture, &e))
        fail_msg("%s", e.msg);
}

static enum session_state state_of(const char *path, struct session_report *r)
{
    struct session *s;
    struct err e = {0};
    if (!session_open(&s, path, SESSION_READ, &e) || !session_verify(s, r, &e))
        fail_msg("%s", e.msg);
    session_close(s);
    return r->state;
}

TEST(frames_come_back_as_they_were_acknowledged)
{
    struct session *s = made(3);
    struct err e = {0};
    shoot(s, 0, "good");
    shoot(s, 1, "wrong-exposure");
    shoot(s, 1, "good");
    session_close(s);
    assert_true(session_open(&s, in("s"), SESSION_READ, &e));
    struct session_frame *f;
    struct session_step *step;
    int n;
    assert_true(session_frames(s, true, &f, &n, &e));
    assert_int_equal(n, 2);
    assert_int_equal(f[1].id, 3);
    assert_int_equal(f[1].step.index, 1);
    assert_true(f[1].step.exposure_ns == 2000000 && f[1].reported_ns == 123);
    assert_string_equal(f[1].step.filter, "red");
    assert_near(f[1].temperature_k, 300.5, 0);
    assert_true(isnan(f[1].focus_per_m) && isnan(f[1].step.focus_per_m));
    struct dng d;
    assert_true(dng_read(&d, in("s/frames/000003.dng"), &e));
    assert_int_equal(d.raw[5], 1);
    dng_finish(&d);
    free(f);
    assert_true(session_frames(s, false, &f, &n, &e));
    assert_int_equal(n, 3);
    assert_string_equal(f[1].verdict, "wrong-exposure");
    free(f);
    assert_true(session_steps(s, &step, &n, &e));
    assert_int_equal(n, 3);
    free(step);
    session_close(s);
}

TEST(complete_partial_and_damaged_are_found_by_looking)
{
    struct session_report r;
    struct session *s = made(2);
    shoot(s, 0, "good");
    session_close(s);
    assert_int_equal(state_of(in("s"), &r), SESSION_PARTIAL);
    struct err e = {0};
    assert_true(session_open(&s, in("s"), SESSION_WRITE, &e));
    shoot(s, 1, "good");
    session_close(s);
    assert_int_equal(state_of(in("s"), &r), SESSION_COMPLETE);
    assert_int_equal(r.good, 2);

    const int fd = open(in("s/frames/000002.dng"), O_WRONLY); // one bit of one sample
    assert_int_equal(pwrite(fd, "\7", 1, 12), 1);
    close(fd);
    assert_int_equal(state_of(in("s"), &r), SESSION_DAMAGED);
    assert_string_equal(r.problem[0],
                        "frames/000002.dng: its content has changed (SHA-256 differs)");
    unlink(in("s/frames/000002.dng"));
    assert_int_equal(state_of(in("s"), &r), SESSION_DAMAGED);
    assert_string_equal(r.problem[0], "frames/000002.dng: No such file or directory");
}

TEST(a_revoked_frame_opens_its_step_again)
{
    struct session_report r;
    struct err e = {0};
    struct session *s = made(1);
    shoot(s, 0, "good");
    assert_true(session_revoke(s, 1, "wrong-exposure", "pixels say 2 ms", &e));
    assert_true(session_status(s, &r, &e));
    assert_int_equal(r.state, SESSION_PARTIAL);
    shoot(s, 0, "good"); // and a second proof of a step is refused by the ledger itself
    struct session_frame f = {.id = 9, .step.index = 0, .verdict = "good"};
    uint16_t raw = 0;
    struct dng picture = {.w = 1, .h = 1, .white = 1, .gain = 1, .raw = &raw};
    assert_false(session_add_frame(s, &f, &picture, &e));
    session_close(s);
}

TEST(a_folder_that_exists_is_never_taken)
{
    struct rig rig;
    struct err e = {0};
    struct session *s = NULL;
    mkdir(in("s"), 0700);
    assert_true(rig_open(&rig, SOURCE_DIR "/rigs/sim.yaml", &e));
    assert_false(session_create(&s, in("s"), &rig, in("plan.yaml"), &e));
    assert_int_equal(e.code, ERR_FILE);
    assert_non_null(strstr(e.msg, "is there already; continue it with --resume"));
    assert_false(session_create(&s, in("t"), &rig, in("no-plan.yaml"), &e));
    assert_true(access(in("t"), F_OK)); // what was begun is taken away
    assert_false(session_open(&s, in("s"), SESSION_READ, &e));
    assert_non_null(strstr(e.msg, "not a session"));
    assert_false(session_open(&s, in("u"), SESSION_READ, &e));
    assert_int_equal(e.code, ERR_FILE);
    rig_finish(&rig);
}

TEST(what_a_killed_process_had_not_begun_is_begun_anew)
{
    assert_int_equal(mkdir(in("s"), 0755), 0);
    assert_int_equal(mkdir(in("s/frames"), 0755), 0);
    assert_int_equal(mkdir(in("s/products"), 0755), 0);
    struct err e;
    assert_true(outfile_write(in("s/rig.yaml"), "x", 1, &e));
    assert_true(outfile_write(in("s/.ledger.7.db"), "half", 4, &e));
    session_close(made(3));
}

TEST(one_writer_at_a_time_and_readers_beside_it)
{
    struct session *s = made(2), *other;
    struct session_report r;
    struct err e = {0};
    shoot(s, 0, "good");
    assert_false(session_open(&other, in("s"), SESSION_WRITE, &e));
    assert_non_null(strstr(e.msg, "another process is writing"));
    assert_int_equal(state_of(in("s"), &r), SESSION_PARTIAL);
    shoot(s, 1, "good");
    assert_int_equal(state_of(in("s"), &r), SESSION_COMPLETE);
    session_close(s);
}

TEST(a_killed_writer_leaves_a_readable_session)
{
    struct session_report r;
    const pid_t pid = fork();
    if (!pid) {
        struct session *s = made(3);
        struct err e;
        shoot(s, 0, "good");
        outfile_write(in("s/frames/000002.dng"), "x", 1, &e); // never acknowledged
        kill(getpid(), SIGKILL);
    }
    int status;
    waitpid(pid, &status, 0);
    assert_true(WIFSIGNALED(status));
    assert_int_equal(state_of(in("s"), &r), SESSION_PARTIAL);
    assert_int_equal(r.good, 1);
    struct session *s;
    struct err e = {0};
    assert_true(session_open(&s, in("s"), SESSION_WRITE, &e));
    assert_true(access(in("s/frames/000002.dng"), F_OK));
    shoot(s, 1, "good");
    shoot(s, 2, "good");
    session_close(s);
    assert_int_equal(state_of(in("s"), &r), SESSION_COMPLETE);
}

TEST(a_ledger_that_is_not_one_is_refused)
{
    struct session *s;
    struct err e = {0};
    mkdir(in("s"), 0700);
    char text[4096];
    memset(text, 'x', sizeof text);
    outfile_write(in("s/ledger.db"), text, sizeof text, &e);
    assert_false(session_open(&s, in("s"), SESSION_READ, &e));
    assert_int_equal(e.code, ERR_DATA);
    if (!strstr(e.msg, "ledger.db: file is not a database"))
        fail_msg("%s", e.msg);
    outfile_write(in("s/ledger.db"), "", 0, &e);
    assert_false(session_open(&s, in("s"), SESSION_READ, &e));
    assert_non_null(strstr(e.msg, "ledger of format 0"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(frames_come_back_as_they_were_acknowledged, setup,
                                        teardown),
        cmocka_unit_test_setup_teardown(complete_partial_and_damaged_are_found_by_looking, setup,
                                        teardown),
        cmocka_unit_test_setup_teardown(a_revoked_frame_opens_its_step_again, setup, teardown),
        cmocka_unit_test_setup_teardown(a_folder_that_exists_is_never_taken, setup, teardown),
        cmocka_unit_test_setup_teardown(what_a_killed_process_had_not_begun_is_begun_anew, setup,
                                        teardown),
        cmocka_unit_test_setup_teardown(one_writer_at_a_time_and_readers_beside_it, setup,
                                        teardown),
        cmocka_unit_test_setup_teardown(a_killed_writer_leaves_a_readable_session, setup, teardown),
        cmocka_unit_test_setup_teardown(a_ledger_that_is_not_one_is_refused, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

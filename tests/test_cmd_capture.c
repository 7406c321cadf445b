// test_cmd_capture.c - nacre capture and nacre session, as a user runs them.
#include "tests/test.h"

#include "core/outfile.h"
#include "tests/run.h"
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>

static const char rig[] = "name: small\n"
                          "camera: {uri: 'sim:w=96,h=64,rig=@rig,world=@run', bits: 12}\n"
                          "lights:\n  trigger: 'sim:lines=1,world=@run'\n  list:\n"
                          "  - {name: led, line: 0, irradiance: 10, centre: 560nm, width: 180nm, "
                          "max_on: 2s}\n"
                          "filters:\n  trigger: 'sim:positions=2,world=@run'\n  list:\n"
                          "  - {name: red, position: 0, centre: 650nm, width: 10nm, throughput: "
                          "0.05}\n"
                          "  - {name: blue, position: 1, centre: 450nm, width: 10nm, throughput: "
                          "0.05}\n";
static const char plan[] = "name: p\nlights: [led]\nfilters: [red, blue]\n"
                           "exposures: {first: 1ms, last: 16ms, step: 1}\ndarks: 1\n";

static void put(const char *path, const char *text)
{
    struct err e;
    assert_true(outfile_write(path, text, strlen(text), &e));
}

static int setup(void **state)
{
    (void)state;
    enter_scratch("cmd_capture");
    put("rig.yaml", rig);
    put("plan.yaml", plan);
    return 0;
}

static void expect(const char *words, int status, const char *in_out, const char *in_err)
{
    const struct run r = run_nacre(words);
    if (r.status != status || !strstr(r.out, in_out) || !strstr(r.err, in_err))
        fail_msg("nacre %s\n exit %d, expected %d with '%s' and '%s':\n%s%s", words, r.status,
                 status, in_out, in_err, r.out, r.err);
}

TEST(a_capture_is_complete_and_can_be_proven)
{
    expect("capture --rig rig.yaml --plan plan.yaml -o s --json", 0, "\"frames\": 15", "");
    expect("session verify s", 0, "complete", "");
    expect("session show s", 0, "frames/000015", "");
    expect("session show s --json", 0, "\"status\": \"complete\"", "");
    assert_int_equal(system("test $(grep -c '\"verdict\": \"good\"' run.out) = 15"), 0);
    expect("capture --rig rig.yaml --plan plan.yaml -o s", 5, "", "s: is there already");
    expect("capture --rig rig.yaml --plan plan.yaml -o s --resume", 0, "complete", "");
}

TEST(a_dry_run_leaves_nothing)
{
    expect("capture --rig rig.yaml --plan plan.yaml -o s --dry-run --json", 0, "\"frames\": 15",
           "");
    assert_true(access("s", F_OK));
    put("plan.yaml", "name: p\nlights: [led]\nexposures: [3s]\n");
    expect("capture --rig rig.yaml --plan plan.yaml -o s --dry-run", 3, "",
           "light 'led' would be on for 3.001 s, its limit is 2 s");
    expect("capture --rig rig.yaml --plan plan.yaml -o s", 3, "", "its limit is 2 s");
    assert_true(access("s", F_OK));
}

TEST(damage_is_found_and_resume_shoots_only_what_is_not_proven)
{
    expect("capture --rig rig.yaml --plan plan.yaml -o s", 0, "complete", "");
    assert_int_equal(truncate("s/frames/000004.dng", 100), 0);
    expect("session verify s", 3, "", "frames/000004.dng: 100 bytes");
    expect("session export s -o bag", 3, "", "frames/000004.dng");
    assert_true(access("bag", F_OK));
    expect("capture --rig rig.yaml --plan plan.yaml -o s --resume --json", 0, "\"frames\": 15", "");
    expect("session verify s", 0, "complete", ""); // the damaged frame proves nothing any more
    expect("session show s --json", 0, "", "");
    assert_int_equal(system("test $(grep -c '\"verdict\": \"good\"' run.out) = 15"), 0);
    assert_int_equal(system("test $(grep -c '\"verdict\": \"damaged\"' run.out) = 1"), 0);
}

TEST(resume_refuses_another_plan)
{
    expect("capture --rig rig.yaml --plan plan.yaml -o s", 0, "complete", "");
    put("other.yaml", "name: p\nexposures: [3ms]\n");
    expect("capture --rig rig.yaml --plan other.yaml -o s --resume", 3, "",
           "other.yaml: is not the plan.yaml that");
    expect("capture --rig rig.yaml --plan other.yaml -o t --resume", 5, "", "t: No such file");
}

TEST(an_automatic_bracket_finds_its_exposures)
{
    put("plan.yaml", "name: p\nlights: [led]\nfilters: [red, blue]\n"
                     "exposures: {meter: 100ms, step: 1, span: 5}\ndarks: 1\n");
    expect("capture --rig rig.yaml --plan plan.yaml -o s", 0, "complete", "");
    expect("session verify s", 0, "complete", "");
}

TEST(an_export_checks_itself)
{
    expect("capture --rig rig.yaml --plan plan.yaml -o s", 0, "complete", "");
    expect("session export s -o bag", 0, "complete", "");
    assert_int_equal(system("cd bag && sha256sum --quiet -c manifest-sha256.txt"), 0);
    assert_int_equal(system("test $(ls bag/data/frames | wc -l) = 15"), 0);
    expect("session export s -o bag", 5, "", "bag: is there already");
    expect("session verify bag/data", 0, "complete", "");
    expect("session nonsense s", 2, "", "not one of");
    expect("session show nowhere", 5, "", "nowhere: No such file");
    expect("session show bag", 5, "", "bag: not a session");
}

// A capture of 60 frames, which takes more than a second, gets a signal when three are kept;
// returns how nacre ended.
static int signal_a_capture(int which)
{
    static const char long_plan[] = "name: p\nlights: [led]\nfilters: [red]\n"
                                    "exposures: [20ms]\nrepeats: 60\n";
    const char *at = strstr(rig, "w=96");
    char text[1300];
    int status;
    snprintf(text, sizeof text, "%.*srealtime=1,%s", (int)(at - rig), rig, at);
    put("rig.yaml", text);
    put("plan.yaml", long_plan);
    const pid_t pid = fork();
    if (!pid) {
        assert_true(freopen("out", "w", stdout) && freopen("err", "w", stderr));
        execl(BIN_DIR "/nacre", "nacre", "capture", "--rig", "rig.yaml", "--plan", "plan.yaml",
              "-o", "s", NULL);
        _exit(127);
    }
    while (access("s/frames/000003.dng", F_OK) && !waitpid(pid, &status, WNOHANG))
        usleep(1000);
    kill(pid, which);
    waitpid(pid, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

TEST(an_interrupted_capture_is_partial_and_resumes)
{
    assert_int_equal(signal_a_capture(SIGINT), 6);
    expect("session verify s", 6, "partial", "partial:");
    expect("capture --rig rig.yaml --plan plan.yaml -o s --resume --json", 0, "\"frames\": 60", "");
}

TEST(a_killed_client_stops_its_capture_and_resume_waits_for_that)
{
    assert_int_equal(signal_a_capture(SIGKILL), 128 + SIGKILL);
    expect("capture --rig rig.yaml --plan plan.yaml -o s --resume --json", 0, "\"frames\": 60", "");
}

// Where nacred would listen: hangs up on the first who comes, and is gone.
static pid_t hang_up_once(const char *path)
{
    struct sockaddr_un at = {.sun_family = AF_UNIX};
    snprintf(at.sun_path, sizeof at.sun_path, "%s", path);
    const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    assert_int_equal(bind(fd, (struct sockaddr *)&at, sizeof at), 0);
    assert_int_equal(listen(fd, 1), 0);
    const pid_t pid = fork();
    if (pid == 0) {
        const int client = accept(fd, NULL, NULL);
        unlink(path);
        close(fd);
        close(client);
        _exit(0);
    }
    close(fd);
    return pid;
}

TEST(a_nacred_that_ends_before_it_answers_is_replaced)
{
    put("plan.yaml", "name: p\nlights: [led]\nfilters: [red]\nexposures: [1ms]\nrepeats: 3\n");
    const pid_t pid = hang_up_once("tired.sock");
    setenv("NACRE_SOCKET", "tired.sock", 1);
    expect("capture --rig rig.yaml --plan plan.yaml -o s", 0, "complete", "");
    unsetenv("NACRE_SOCKET");
    assert_int_equal(waitpid(pid, NULL, 0), pid);
}

// The rig whose camera is the session s.
static void put_replay_rig(void)
{
    const char *at = strstr(rig, "'sim:w=96"), *end = strchr(at + 1, '\'') + 1;
    char text[1300];
    snprintf(text, sizeof text, "%.*s'replay:s'%s", (int)(at - rig), rig, end);
    put("again.yaml", text);
}

static void replays_as(const char *exposures)
{
    char text[300];
    snprintf(text, sizeof text, "name: p\nlights: [led]\nfilters: [red, blue]\nexposures: %s\n",
             exposures);
    put("plan.yaml", text);
    put_replay_rig();
    expect("capture --rig rig.yaml --plan plan.yaml -o s", 0, "complete", "");
    setenv("NACRE_SOCKET", "here.sock", 1); // a nacred in this folder: the rig names s as it is
    expect("capture --rig again.yaml --plan plan.yaml -o t", 0, "complete", "");
    unsetenv("NACRE_SOCKET");
    assert_int_equal(system("diff -r s/frames t/frames"), 0);
}

TEST(a_session_replays_byte_for_byte)
{
    replays_as("{first: 1ms, last: 16ms, step: 0.7}\ndarks: 1"); // most of them are rounded
}

TEST(an_automatic_bracket_replays_with_its_metering)
{
    replays_as("{meter: 100ms, step: 1, span: 3}\ndarks: 1");
    expect("session show t --json", 0, "\"metering\"", "");
    expect("session verify t", 0, "complete", "");
}

TEST(a_series_over_focus_is_captured_and_a_focus_out_of_reach_refused)
{
    put("plan.yaml", "name: p\nlights: [led]\nfilters: [blue]\nfocus: [0, 6, 10]\n"
                     "exposures: [100ms, 400ms]\n");
    expect("capture --rig rig.yaml --plan plan.yaml -o s", 0, "complete", "");
    expect("session show s --json", 0, "\"focus_per_m\": 10", "");
    expect("hdr s --group 2 -o disc.pfm", 0, "", "");
    put("plan.yaml", "name: p\nlights: [led]\nfocus: [30]\nexposures: [1ms]\n");
    expect("capture --rig rig.yaml --plan plan.yaml -o t --dry-run", 3, "",
           "focus 30 dioptres: camera simulated");
}

#define T(name) cmocka_unit_test_setup(name, setup)
int main(void)
{
    const struct CMUnitTest tests[] = {
        T(a_capture_is_complete_and_can_be_proven),
        T(a_dry_run_leaves_nothing),
        T(damage_is_found_and_resume_shoots_only_what_is_not_proven),
        T(resume_refuses_another_plan),
        T(an_automatic_bracket_finds_its_exposures),
        T(an_export_checks_itself),
        T(a_series_over_focus_is_captured_and_a_focus_out_of_reach_refused),
        T(an_interrupted_capture_is_partial_and_resumes),
        T(a_nacred_that_ends_before_it_answers_is_replaced),
        T(a_session_replays_byte_for_byte),
        T(an_automatic_bracket_replays_with_its_metering),
        T(a_killed_client_stops_its_capture_and_resume_waits_for_that),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

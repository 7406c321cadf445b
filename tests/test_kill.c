// test_kill.c - SIGKILL at random moments: no acknowledged frame is lost, the light goes off, and
// --resume completes exactly what was planned. NACRE_KILLS says how often (default 3).
#include "tests/test.h"

#include "acquire/clock.h"
#include "core/outfile.h"
#include "core/session.h"
#include "core/sort.h"
#include "sim/world.h"
#include "tests/run.h"
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>

enum { PLANNED = 24, MAX_KILLS = 1000 };
static const double CAP_S = 0.4; // max_on of the rig below

static struct world *world;
static char world_name[40];
// Moments: "anywhere" is at random from the very start; the others are what nacred says that it is
// doing, but for two: to be paused it is asked, and the light is seen going off from outside,
// because nacred answers nothing until nacre-lights has answered it.
static struct {
    const char *name;
    int kills, seen;
} moments[] = {
    {"anywhere"},
    {"moving the filter"},
    {"letting settings settle"},
    {"resting the light"},
    {"switching the light on"},
    {"exposing"},
    {"holding the light"},
    {"switching the light off"},
    {"storing"},
    {"paused"},
};
enum { MOMENTS = sizeof moments / sizeof *moments };
static double off_after_s[MAX_KILLS];
static int n_lit;

static int kills(void)
{
    const char *text = getenv("NACRE_KILLS");
    const int n = text ? atoi(text) : 3;
    return n < 1 ? 1 : n > MAX_KILLS ? MAX_KILLS : n;
}

static void put(const char *path, const char *text)
{
    struct err e;
    assert_true(outfile_write(path, text, strlen(text), &e));
}

static int setup(void **state)
{
    char text[1000];
    struct err e;
    (void)state;
    enter_scratch("kill");
    snprintf(world_name, sizeof world_name, "test-kill-%d", (int)getpid());
    snprintf(text, sizeof text,
             "name: r\ncamera: {uri: 'sim:w=48,h=32,realtime=1,settle=1,world=%s'}\nlights:\n"
             "  trigger: 'sim:lines=1,world=%s'\n  list:\n"
             "  - {name: led, line: 0, max_on: 400ms, max_duty: 0.7, lead: 2ms, lag: 2ms}\n"
             "filters:\n  trigger: 'sim:positions=2,world=%s,settle=3ms'\n"
             "  list: [{name: a, position: 0}, {name: b, position: 1}]\n",
             world_name, world_name, world_name);
    put("rig.yaml", text);
    put("plan.yaml", "name: p\nlights: [led]\nfilters: [a, b]\nexposures: [4ms, 8ms, 16ms, 32ms]\n"
                     "repeats: 2\ndarks: 2\n");
    setenv("NACRE_SOCKET", "nacred.sock", 1);
    srand(17);
    world = world_open(world_name, &e);
    return world ? 0 : -1;
}

static int teardown(void **state)
{
    (void)state;
    world_close(world);
    return 0;
}

static pid_t start(const char *program, char *const args[])
{
    const pid_t pid = fork();
    if (!pid) {
        freopen("log", "a", stderr);
        freopen("/dev/null", "w", stdout);
        execv(program, args);
        _exit(127);
    }
    return pid;
}

static int try_connect(void)
{
    struct sockaddr_un a = {.sun_family = AF_UNIX, .sun_path = "nacred.sock"};
    const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    if (!connect(fd, (struct sockaddr *)&a, sizeof a))
        return fd;
    close(fd);
    return -1;
}

static int connected(void)
{
    int fd = try_connect();
    for (int k = 0; fd < 0 && k < 500; k++) {
        usleep(10000);
        fd = try_connect();
    }
    if (fd < 0)
        fail_msg("nacred does not listen");
    return fd;
}

// A client that had not yet connected when nacred was killed has started another one.
static void stop_any_other(void)
{
    static const char stop[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"daemon.stop\"}\n";
    for (int fd; (fd = try_connect()) >= 0; usleep(10000)) {
        (void)!write(fd, stop, sizeof stop - 1);
        close(fd);
    }
}

static pid_t start_daemon(void)
{
    char *args[] = {(char *)"nacred", (char *)"--socket", (char *)"nacred.sock", NULL};
    const pid_t pid = start(BIN_DIR "/nacred", args);
    close(connected());
    return pid;
}

static pid_t start_capture(bool resume)
{
    char *args[] = {(char *)"nacre",
                    (char *)"capture",
                    (char *)"--rig",
                    (char *)"rig.yaml",
                    (char *)"--plan",
                    (char *)"plan.yaml",
                    (char *)"-o",
                    (char *)"s",
                    resume ? (char *)"--resume" : NULL,
                    NULL};
    return start(BIN_DIR "/nacre", args);
}

// What nacred says that it is doing, asked on a line of its own.
static void ask_state(int fd, char name[40])
{
    static const char question[] =
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"capture.list\",\"params\":{}}\n";
    char text[2000] = "";
    strcpy(name, "no capture");
    if (write(fd, question, sizeof question - 1) > 0 && read(fd, text, sizeof text - 1) > 0) {
        const char *at = strstr(text, "\"state\":\"");
        if (at)
            sscanf(at + 9, "%39[^\"]", name);
    }
}

static void ask_to_pause(int fd)
{
    static const char pause[] = "{\"jsonrpc\":\"2.0\",\"method\":\"capture.pause\","
                                "\"params\":{\"capture\":1}}\n";
    (void)!write(fd, pause, sizeof pause - 1);
}

static bool is_lit(void)
{
    struct world_state s;
    world_read(world, &s);
    return s.n_lights && s.light[s.n_lights - 1].mask && s.light[s.n_lights - 1].to_ns > s.now_ns;
}

// Waits for the light to go off, again and again for up to `for_s`: true when it did.
static bool light_goes_off_within(double for_s)
{
    const int64_t until = clock_boot_ns() + (int64_t)(1e9 * for_s);
    bool was = false, is;
    while (clock_boot_ns() < until) {
        is = is_lit();
        if (was && !is)
            return true;
        was = is;
    }
    return false;
}

// Waits for a moment of a capture that takes whole_s; false when it did not come.
static bool wait_for_moment(int m, int fd, double whole_s)
{
    const int64_t from = clock_boot_ns();
    char name[40] = "no capture";
    if (!m) {
        usleep((useconds_t)(1e6 * whole_s * rand() / RAND_MAX));
        return true;
    }
    while (!strcmp(name, "no capture") && clock_boot_ns() - from < 3000000000)
        ask_state(fd, name);
    usleep((useconds_t)(0.7e6 * whole_s * rand() / RAND_MAX));
    if (!strcmp(moments[m].name, "switching the light off"))
        return light_goes_off_within(1);
    if (!strcmp(moments[m].name, "paused"))
        ask_to_pause(fd);
    while (strcmp(name, moments[m].name) != 0 && clock_boot_ns() - from < 3000000000)
        ask_state(fd, name);
    return !strcmp(name, moments[m].name);
}

// The light that was on at `since_ns` must not stay on for longer than its cap.
static void light_goes_off(int64_t since_ns)
{
    struct world_state s;
    int64_t off_ns;
    do {
        usleep(500);
        world_read(world, &s);
        off_ns = since_ns;
        for (int k = 0; k < s.n_lights; k++)
            if (s.light[k].mask & 1 && s.light[k].from_ns <= since_ns &&
                s.light[k].to_ns > since_ns)
                off_ns = s.light[k].to_ns;
    } while (off_ns > s.now_ns && s.now_ns - since_ns < 3000000000);
    const double after_s =
        1e-9 * (double)(off_ns - since_ns); // realtime=1: the world's clock is ours
    assert_true(after_s < CAP_S);
    if (after_s > 0)
        off_after_s[n_lit++] = after_s;
}

static struct session_frame *good_frames(int *n)
{
    struct session *s;
    struct session_frame *f;
    struct session_report r;
    struct err e = {0};
    if (!session_open(&s, "s", SESSION_READ, &e) || !session_verify(s, &r, &e) ||
        !session_frames(s, true, &f, n, &e))
        fail_msg("%s", e.msg);
    if (r.state == SESSION_DAMAGED)
        fail_msg("damaged: %s", r.problem[0]);
    session_close(s);
    return f;
}

static int wait_for(pid_t pid)
{
    int status;
    waitpid(pid, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

static void report(const char *what, int n)
{
    sort_doubles(off_after_s, (size_t)n_lit);
    print_message("%s: %d kills, %d with the light on; off after at most %.1f ms, p99 %.1f ms\n",
                  what, n, n_lit, n_lit ? 1e3 * off_after_s[n_lit - 1] : 0,
                  n_lit ? 1e3 * off_after_s[(n_lit - 1) * 99 / 100] : 0);
    n_lit = 0;
}

// Frames of before are still there, unchanged.
static void nothing_is_lost(const struct session_frame *before, int n_before)
{
    int n;
    struct session_frame *f = good_frames(&n);
    assert_int_equal(n, PLANNED);
    for (int k = 0; k < n_before; k++) {
        assert_int_equal(f[k].id, before[k].id);
        assert_string_equal(f[k].sha256, before[k].sha256);
    }
    free(f);
}

TEST(nacred_killed_at_any_moment)
{
    const int n = kills();
    double whole_s = 0; // how long a capture takes, for moments that spread over it
    for (int k = 0; k <= n; k++) {
        assert_int_equal(system("rm -rf s"), 0);
        const pid_t daemon = start_daemon();
        const int fd = connected();
        const int64_t from = clock_boot_ns();
        const pid_t client = start_capture(false);
        if (!k) { // the first one is left alone
            assert_int_equal(wait_for(client), 0);
            whole_s = 1e-9 * (double)(clock_boot_ns() - from);
            kill(daemon, SIGTERM);
            assert_int_equal(wait_for(daemon), 0);
            close(fd);
            continue;
        }
        const int m = k % MOMENTS;
        moments[m].kills++;
        moments[m].seen += wait_for_moment(m, fd, whole_s);
        const int64_t killed_ns = clock_boot_ns();
        kill(daemon, SIGKILL);
        wait_for(daemon);
        close(fd);
        light_goes_off(killed_ns);
        const int status = wait_for(client);
        assert_true(status == 4 || status == 0); // 0: it had ended
        stop_any_other();
        struct session_frame *before = NULL;
        int n_before = 0;
        const bool begun = !access("s/ledger.db", F_OK);
        if (begun)
            before = good_frames(&n_before);
        const pid_t second = start_daemon();
        assert_int_equal(wait_for(start_capture(begun)), 0);
        nothing_is_lost(before, n_before);
        free(before);
        kill(second, SIGTERM);
        assert_int_equal(wait_for(second), 0);
    }
    for (int m = 0; m < MOMENTS; m++)
        print_message("  %3d of %3d in '%s'\n", moments[m].seen, moments[m].kills, moments[m].name);
    report("nacred", n);
    for (int m = 0; m < MOMENTS && n >= 4 * MOMENTS; m++)
        assert_true(moments[m].seen > 0);
}

TEST(nacre_lights_killed_at_any_moment)
{
    const int n = kills();
    const pid_t daemon = start_daemon();
    char line[200];
    snprintf(line, sizeof line, "pkill -KILL -P %d nacre-lights", (int)daemon);
    for (int k = 0; k < n; k++) {
        assert_int_equal(system("rm -rf s"), 0);
        const pid_t client = start_capture(false);
        usleep((useconds_t)(200000 + 700000.0 * rand() / RAND_MAX));
        const int64_t killed_ns = clock_boot_ns();
        if (!system(line))
            light_goes_off(killed_ns);
        assert_int_equal(wait_for(client), 0); // it went on by itself
        nothing_is_lost(NULL, 0);
    }
    kill(daemon, SIGTERM);
    assert_int_equal(wait_for(daemon), 0);
    report("nacre-lights", n);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nacred_killed_at_any_moment),
        cmocka_unit_test(nacre_lights_killed_at_any_moment),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

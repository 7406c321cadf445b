// test_service.c - nacred under systemd: what it takes, says and leaves; and that the units are
// sound.
#include "tests/test.h"

#include "acquire/clock.h"
#include "core/outfile.h"
#include "sim/world.h"
#include "tests/run.h"
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>

static int setup(void **state)
{
    (void)state;
    enter_scratch("service");
    return 0;
}

static char notify_name[60]; // "@...": in no folder, as sd_notify wants no relative path

static int listening(const char *path, int type)
{
    struct sockaddr_un a = {.sun_family = AF_UNIX};
    snprintf(a.sun_path, sizeof a.sun_path, "%s", path);
    const int fd = socket(AF_UNIX, type, 0);
    const size_t size = offsetof(struct sockaddr_un, sun_path) + strlen(a.sun_path);
    if (*path == '@')
        a.sun_path[0] = 0;
    assert_int_equal(bind(fd, (struct sockaddr *)&a, (socklen_t)size), 0);
    if (type == SOCK_STREAM)
        assert_int_equal(listen(fd, 4), 0);
    return fd;
}

// nacred as systemd starts it: the socket is descriptor 3.
static pid_t start_as_service(int socket_fd)
{
    const pid_t pid = fork();
    if (pid)
        return pid;
    char self[20];
    snprintf(self, sizeof self, "%d", (int)getpid());
    setenv("LISTEN_PID", self, 1);
    setenv("LISTEN_FDS", "1", 1);
    setenv("WATCHDOG_PID", self, 1);
    setenv("WATCHDOG_USEC", "200000", 1);
    setenv("NOTIFY_SOCKET", notify_name, 1);
    dup2(socket_fd, 3);
    execl(BIN_DIR "/nacred", "nacred", NULL);
    _exit(127);
}

// What nacred tells systemd next, within 10 s.
static const char *told(int fd)
{
    static char text[200];
    struct pollfd p = {fd, POLLIN, 0};
    const ssize_t n = poll(&p, 1, 10000) == 1 ? recv(fd, text, sizeof text - 1, 0) : 0;
    text[n > 0 ? n : 0] = 0;
    return text;
}

TEST(a_socket_that_is_handed_over_is_served_and_systemd_is_told)
{
    char answer[500] = "";
    snprintf(notify_name, sizeof notify_name, "@nacre-test-%d", (int)getpid());
    const int asked = listening("d.sock", SOCK_STREAM), notify = listening(notify_name, SOCK_DGRAM);
    const int client = socket(AF_UNIX, SOCK_STREAM, 0);
    const struct sockaddr_un a = {.sun_family = AF_UNIX, .sun_path = "d.sock"};
    assert_int_equal(connect(client, (const struct sockaddr *)&a, sizeof a), 0); // before it runs
    static const char hello[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"hello\"}\n";
    assert_true(write(client, hello, sizeof hello - 1) > 0);
    const pid_t pid = start_as_service(asked);
    bool ready = false;
    int beats = 0;
    for (int k = 0; k < 20 && (beats < 4 || !ready); k++) {
        const char *text = told(notify);
        ready |= !strcmp(text, "READY=1");
        beats += !strcmp(text, "WATCHDOG=1");
    }
    assert_true(ready && beats >= 4);
    assert_true(read(client, answer, sizeof answer - 1) > 0);
    assert_non_null(strstr(answer, "\"program\":\"nacred\""));
    close(client);
    kill(pid, SIGTERM);
    bool stopping = false;
    for (int k = 0; k < 20 && !stopping; k++)
        stopping = !strcmp(told(notify), "STOPPING=1");
    assert_true(stopping);
    int status;
    waitpid(pid, &status, 0);
    assert_int_equal(status, 0);
    assert_int_equal(access("d.sock", F_OK), 0); // it is systemd's
    close(asked);
    close(notify);
}

static bool is_lit(struct world *w)
{
    struct world_state s;
    world_read(w, &s);
    return s.n_lights && s.light[s.n_lights - 1].mask && s.light[s.n_lights - 1].to_ns > s.now_ns;
}

TEST(lines_that_a_killed_service_has_left_on_are_switched_off)
{
    static const char rig[] = "name: r\ncamera: {uri: 'sim:'}\nlights:\n"
                              "  trigger: 'sim:lines=1,world=@run'\n"
                              "  list: [{name: led, line: 0, max_on: 5s}]\n";
    char run[40];
    struct err e;
    int ends[2], status;
    snprintf(run, sizeof run, "test-service-%d", (int)getpid());
    struct world *world = world_open(run, &e);
    assert_true(world && outfile_write("rig.yaml", rig, sizeof rig - 1, &e));
    assert_int_equal(system("mkdir -p runtime"), 0);
    setenv("RUNTIME_DIRECTORY", "runtime", 1);
    assert_int_equal(socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends), 0);
    const pid_t pid = fork();
    if (!pid) {
        dup2(ends[1], STDIN_FILENO);
        execl(BIN_DIR "/nacre-lights", "nacre-lights", "--rig", "rig.yaml", "--run", run, NULL);
        _exit(127);
    }
    char text[200];
    assert_true(recv(ends[0], text, sizeof text, 0) > 0); // ready
    assert_true(send(ends[0], "set 1", 5, 0) == 5 && recv(ends[0], text, sizeof text, 0) > 0);
    assert_true(is_lit(world));
    kill(pid, SIGKILL);
    waitpid(pid, &status, 0);
    assert_true(is_lit(world)); // as a GPIO line would be
    assert_int_equal(system("test $(ls runtime | wc -l) = 1"), 0);
    assert_int_equal(system(BIN_DIR "/nacre-lights --off </dev/null"), 0);
    assert_false(is_lit(world));
    assert_int_equal(system("test $(ls runtime | wc -l) = 0"), 0);
    assert_int_equal(system(BIN_DIR "/nacre-lights --off </dev/null"), 0); // nothing left to do
    unsetenv("RUNTIME_DIRECTORY");
    close(ends[0]);
    close(ends[1]);
    world_close(world);
}

// As root only: who connects as somebody else cannot stop what is not theirs.
TEST(another_user_cannot_stop_nacred)
{
    if (getuid())
        skip();
    const int fd = listening("e.sock", SOCK_STREAM);
    const pid_t daemon = start_as_service(fd);
    assert_int_equal(system("chmod 755 . && chmod 777 e.sock"), 0);
    const pid_t other = fork();
    if (!other) {
        static const char stop[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"daemon.stop\"}\n";
        const struct sockaddr_un a = {.sun_family = AF_UNIX, .sun_path = "e.sock"};
        char answer[300] = "";
        const int s = socket(AF_UNIX, SOCK_STREAM, 0);
        const bool said = !setuid(65534) && !connect(s, (const struct sockaddr *)&a, sizeof a) &&
                          write(s, stop, sizeof stop - 1) > 0 &&
                          read(s, answer, sizeof answer - 1) > 0;
        _exit(said && strstr(answer, "belongs to user 0, you are 65534") ? 0 : 1);
    }
    int status;
    waitpid(other, &status, 0);
    assert_int_equal(status, 0);
    kill(daemon, SIGTERM);
    waitpid(daemon, &status, 0);
    assert_int_equal(status, 0);
    close(fd);
}

TEST(the_units_are_sound)
{
    if (system("command -v systemd-analyze >/dev/null")) {
        print_message("skipped: no systemd-analyze\n");
        skip();
    }
    static const char line[] =
        "mkdir -p units && cp " SOURCE_DIR "/acquire/systemd/nacred.socket units && "
        "sed 's|/usr/bin|" BIN_DIR "|' " SOURCE_DIR
        "/acquire/systemd/nacred.service > units/nacred.service && "
        "systemd-analyze verify --man=no units/nacred.socket units/nacred.service 2>verify; "
        "! grep -i nacre verify";
    assert_int_equal(system(line), 0);
    assert_int_equal(system("systemd-analyze security --offline=true --threshold=25 "
                            "units/nacred.service >security 2>&1"),
                     0);
}

#define T(name) cmocka_unit_test_setup(name, setup)
TEST_MAIN(T(a_socket_that_is_handed_over_is_served_and_systemd_is_told),
          T(lines_that_a_killed_service_has_left_on_are_switched_off),
          T(another_user_cannot_stop_nacred), T(the_units_are_sound))

// test_daemon.c - nacred over its socket: what it answers, what it refuses, whom it drops.
#include "tests/test.h"

#include "acquire/preview.h"
#include "core/outfile.h"
#include "tests/run.h"
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

static pid_t daemon_pid;

static int connected(void)
{
    struct sockaddr_un a = {.sun_family = AF_UNIX, .sun_path = "d.sock"};
    for (int k = 0; k < 500; k++) {
        const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
        if (!connect(fd, (struct sockaddr *)&a, sizeof a))
            return fd;
        close(fd);
        usleep(10000);
    }
    fail_msg("nacred does not listen");
    return -1;
}

static int setup(void **state)
{
    static const char rig[] = "name: r\ncamera: {uri: 'sim:w=48,h=32,realtime=1,world=@run'}\n"
                              "lights:\n  trigger: 'sim:lines=1,world=@run'\n"
                              "  list: [{name: led, line: 0, max_on: 1s}]\n";
    static const char plan[] = "name: p\nlights: [led]\nexposures: [5ms]\nrepeats: 40\n";
    struct err e;
    (void)state;
    enter_scratch("daemon");
    assert_true(outfile_write("rig.yaml", rig, sizeof rig - 1, &e));
    assert_true(outfile_write("plan.yaml", plan, sizeof plan - 1, &e));
    daemon_pid = fork();
    if (!daemon_pid) {
        execl(BIN_DIR "/nacred", "nacred", "--socket", "d.sock", NULL);
        _exit(127);
    }
    close(connected());
    return 0;
}

static int teardown(void **state)
{
    int status;
    (void)state;
    kill(daemon_pid, SIGTERM);
    waitpid(daemon_pid, &status, 0);
    return status;
}

static void say(int fd, const char *text)
{
    assert_int_equal(write(fd, text, strlen(text)), (ssize_t)strlen(text));
}

// The next line, within 5 s.
static const char *hear(int fd)
{
    static char line[8192];
    size_t n = 0;
    struct pollfd p = {fd, POLLIN, 0};
    while (n < sizeof line - 1 && poll(&p, 1, 5000) == 1 && read(fd, line + n, 1) == 1)
        if (line[n++] == '\n')
            break;
    line[n] = 0;
    return line;
}

// Lines until one has this in it.
static const char *hear_of(int fd, const char *part)
{
    for (int k = 0; k < 1000; k++) {
        const char *line = hear(fd);
        if (strstr(line, part))
            return line;
        if (!*line)
            break;
    }
    fail_msg("never heard of %s", part);
    return NULL;
}

static void start(int fd, const char *session, bool detach)
{
    char cwd[500], text[3000];
    assert_non_null(getcwd(cwd, sizeof cwd));
    snprintf(text, sizeof text,
             "{\"jsonrpc\":\"2.0\",\"id\":7,\"method\":\"capture.start\",\"params\":{\"rig\":\"%s/"
             "rig.yaml\",\"plan\":\"%s/plan.yaml\",\"session\":\"%s/%s\",\"detach\":%s}}\n",
             cwd, cwd, cwd, session, detach ? "true" : "false");
    say(fd, text);
    assert_non_null(strstr(hear(fd), "\"id\":7,\"result\""));
}

#define CALL(method, params)                                                                       \
    "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"" method "\",\"params\":" params "}\n"

TEST(every_kind_of_bad_message_gets_its_error)
{
    static const struct {
        const char *line, *code, *text;
    } bad[] = {
        {"hello\n", "-32700", "not JSON"},
        {"[]\n", "-32600", "not a JSON-RPC 2.0 message"},
        {"{\"id\":1,\"method\":\"hello\"}\n", "-32600", "not a JSON-RPC 2.0 message"},
        {CALL("nonsense", "{}"), "-32601", "no such method"},
        {CALL("capture.abort", "{}"), "-32602", "capture.abort: needs 'capture'"},
        {CALL("capture.abort", "{\"capture\":\"x\"}"), "-32602", "must be a whole number"},
        {CALL("capture.list", "{\"x\":1}"), "-32602", "unknown parameter 'x'"},
        {CALL("capture.abort", "{\"capture\":99}"), "-1003", "no capture 99 is running"},
        {CALL("capture.start", "{\"rig\":\"/no\",\"plan\":\"/no\",\"session\":\"/no\"}"), "-1005",
         "/no: No such file"},
    };
    const int fd = connected();
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        say(fd, bad[k].line);
        const char *answer = hear(fd);
        if (!strstr(answer, bad[k].code) || !strstr(answer, bad[k].text))
            fail_msg("%s got %s", bad[k].line, answer);
    }
    say(fd, CALL("hello", "{}")); // and it still answers
    assert_non_null(strstr(hear(fd), "\"protocol\":1"));
    say(fd, CALL("describe", "{}"));
    assert_non_null(strstr(hear(fd), "capture.start"));
    close(fd);
}

TEST(the_socket_is_for_its_user_and_group)
{
    struct stat st;
    assert_int_equal(stat("d.sock", &st), 0);
    assert_int_equal(st.st_mode & 0777, 0660);
}

TEST(a_capture_tells_of_every_frame_and_of_its_end)
{
    const int fd = connected();
    start(fd, "a", false);
    for (int k = 0; k < 40; k++)
        hear_of(fd, "capture.frame");
    assert_non_null(strstr(hear_of(fd, "capture.end"), "\"code\":0"));
    close(fd);
}

TEST(pause_continue_watch_and_abort)
{
    const int fd = connected(), other = connected();
    start(fd, "b", false);
    hear_of(fd, "capture.frame");
    say(fd, CALL("capture.list", "{}"));
    int id = 0;
    assert_int_equal(sscanf(strstr(hear_of(fd, "captures"), "\"capture\":"), "\"capture\":%d", &id),
                     1);
    char text[300];
    snprintf(text, sizeof text, CALL("capture.pause", "{\"capture\":%d}"), id);
    say(fd, text);
    usleep(400000);
    snprintf(text, sizeof text, CALL("capture.watch", "{\"capture\":%d}"), id);
    say(other, text);
    assert_non_null(strstr(hear(other), "\"state\":\"paused\""));
    snprintf(text, sizeof text, CALL("capture.continue", "{\"capture\":%d}"), id);
    say(other, text);
    hear_of(other, "capture.frame");
    snprintf(text, sizeof text, CALL("capture.abort", "{\"capture\":%d}"), id);
    say(other, text);
    assert_non_null(strstr(hear_of(other, "capture.end"), "\"code\":6"));
    assert_non_null(strstr(hear_of(fd, "capture.end"), "frames are kept: stopped"));
    close(fd);
    close(other);
}

TEST(a_detached_capture_survives_its_client)
{
    int fd = connected();
    start(fd, "c", true);
    close(fd);
    fd = connected();
    for (int k = 0; k < 500; k++) {
        say(fd, CALL("capture.list", "{}"));
        if (strstr(hear(fd), "\"captures\":[]"))
            break;
        usleep(20000);
    }
    close(fd);
    const struct run r = run_nacre("session verify c");
    assert_int_equal(r.status, 0);
}

TEST(too_long_a_line_and_too_slow_a_reader_are_dropped)
{
    const int fd = connected(), slow = connected();
    char *text = calloc(1, 100001);
    memset(text, ' ', 100000);
    (void)!send(fd, text, 100000, MSG_NOSIGNAL);
    free(text);
    char c;
    struct pollfd p = {fd, POLLIN, 0};
    assert_int_equal(poll(&p, 1, 5000), 1);
    assert_true(read(fd, &c, 1) <= 0); // closed
    close(fd);
    const char ask[] = CALL("describe", "{}"); // 2 kB of answer each, never read
    bool dropped = false;
    for (int k = 0; k < 20000 && !dropped; k++)
        dropped = send(slow, ask, sizeof ask - 1, MSG_NOSIGNAL) < 0;
    assert_true(dropped && (errno == EPIPE || errno == ECONNRESET));
    const int third = connected();
    say(third, CALL("hello", "{}"));
    assert_non_null(strstr(hear(third), "nacred"));
    close(slow);
    close(third);
}

static int receive_fd(int fd, char *line, size_t size)
{
    union {
        struct cmsghdr align;
        char space[CMSG_SPACE(sizeof(int))];
    } control;
    struct iovec part = {line, size - 1};
    struct msghdr m = {.msg_iov = &part,
                       .msg_iovlen = 1,
                       .msg_control = control.space,
                       .msg_controllen = sizeof control.space};
    const ssize_t n = recvmsg(fd, &m, 0);
    line[n > 0 ? n : 0] = 0;
    struct cmsghdr *h = CMSG_FIRSTHDR(&m);
    int got = -1;
    if (h && h->cmsg_type == SCM_RIGHTS)
        memcpy(&got, CMSG_DATA(h), sizeof got);
    return got;
}

TEST(the_preview_shows_the_newest_frame_and_cannot_be_written)
{
    const int fd = connected();
    char line[500];
    say(fd, CALL("preview.open", "{}"));
    const int memory = receive_fd(fd, line, sizeof line);
    assert_true(memory >= 0 && strstr(line, "\"bytes\""));
    assert_true(mmap(NULL, sizeof(struct preview_memory), PROT_READ | PROT_WRITE, MAP_SHARED,
                     memory, 0) == MAP_FAILED);
    struct preview_memory *m = mmap(NULL, sizeof *m, PROT_READ, MAP_SHARED, memory, 0);
    assert_true(m != MAP_FAILED && m->magic == PREVIEW_MAGIC);
    start(fd, "d", false);
    hear_of(fd, "capture.end");
    const struct preview_picture *p = &m->picture[m->current];
    assert_int_equal(p->w, 48);
    assert_int_equal(p->h, 32);
    assert_int_equal(p->serial % 2, 0);
    assert_true(p->exposure_ns == 5000000 && p->px[0] > 0);
    munmap(m, sizeof *m);
    close(memory);
    close(fd);
}

TEST(of_many_that_start_at_once_one_stays_and_takes_its_socket_away)
{
    enum { MANY = 8 };
    struct sockaddr_un a = {.sun_family = AF_UNIX, .sun_path = "m.sock"};
    pid_t pid[MANY];
    int refused = 0, status;
    for (int k = 0; k < MANY; k++)
        if (!(pid[k] = fork())) {
            assert_true(freopen("m.err", "a", stderr));
            execl(BIN_DIR "/nacred", "nacred", "--socket", "m.sock", NULL);
            _exit(127);
        }
    for (int k = 0; k < 2000 && refused < MANY - 1; k++) {
        for (int n = 0; n < MANY; n++)
            if (pid[n] && waitpid(pid[n], &status, WNOHANG) == pid[n]) {
                assert_int_equal(WEXITSTATUS(status), 5);
                pid[n] = 0;
                refused++;
            }
        usleep(5000);
    }
    assert_int_equal(refused, MANY - 1);
    const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    assert_int_equal(connect(fd, (struct sockaddr *)&a, sizeof a), 0); // it is the one
    close(fd);
    for (int n = 0; n < MANY; n++)
        if (pid[n]) {
            kill(pid[n], SIGTERM);
            waitpid(pid[n], &status, 0);
            assert_int_equal(status, 0);
        }
    assert_true(access("m.sock", F_OK));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kind_of_bad_message_gets_its_error),
        cmocka_unit_test(the_socket_is_for_its_user_and_group),
        cmocka_unit_test(a_capture_tells_of_every_frame_and_of_its_end),
        cmocka_unit_test(pause_continue_watch_and_abort),
        cmocka_unit_test(a_detached_capture_survives_its_client),
        cmocka_unit_test(too_long_a_line_and_too_slow_a_reader_are_dropped),
        cmocka_unit_test(the_preview_shows_the_newest_frame_and_cannot_be_written),
        cmocka_unit_test(of_many_that_start_at_once_one_stays_and_takes_its_socket_away),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

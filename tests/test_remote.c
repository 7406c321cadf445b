// test_remote.c - a capture by a nacred that answers, is slow, or hangs.
#include "tests/test.h"

#include "tests/run.h"
#include "ui/remote.h"
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>

enum { SILENCE_MS = 300 };
static pid_t server;

static int setup(void **state)
{
    (void)state;
    enter_scratch("remote");
    setenv("NACRE_SOCKET", "r.sock", 1);
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    kill(server, SIGKILL);
    waitpid(server, NULL, 0);
    return 0;
}

// Someone who answers every line of the first client by the next of these, NULL after the last, and
// then listens in silence.
static void serve(const char *const answers[])
{
    struct sockaddr_un at = {.sun_family = AF_UNIX, .sun_path = "r.sock"};
    const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    assert_int_equal(bind(fd, (struct sockaddr *)&at, sizeof at), 0);
    assert_int_equal(listen(fd, 1), 0);
    server = fork();
    if (server) {
        close(fd);
        return;
    }
    const int client = accept(fd, NULL, NULL);
    for (char c; read(client, &c, 1) == 1;)
        if (c == '\n' && *answers) {
            if (write(client, *answers, strlen(*answers)) < 0)
                break;
            answers++;
        }
    _exit(0);
}

static struct err capture(void)
{
    const struct remote_order order = {
        .rig = "r.yaml", .plan = "p.yaml", .session = "s", .silence_ms = SILENCE_MS};
    struct err e = {0};
    alarm(60); // a client that waits for ever fails the test
    assert_true(remote_capture(&order, &e) == (e.code == ERR_NONE));
    alarm(0);
    return e;
}

#define STARTED "{\"jsonrpc\":\"2.0\",\"id\":1,\"result\":{\"capture\":1}}\n"
#define HELLO "{\"jsonrpc\":\"2.0\",\"id\":3,\"result\":{}}\n"
#define END                                                                                        \
    "{\"jsonrpc\":\"2.0\",\"method\":\"capture.end\",\"params\":{\"capture\":1,\"code\":0,"        \
    "\"message\":"                                                                                 \
    "\"complete\"}}\n"

TEST(a_nacred_that_hangs_is_not_waited_for)
{
    serve((const char *const[]){STARTED, NULL});
    const struct err e = capture();
    assert_int_equal(e.code, ERR_DEVICE);
    assert_string_equal(e.msg, "nacred does not answer; the light is off, and --resume goes on");
}

TEST(one_that_has_nothing_to_tell_but_answers_is)
{
    serve((const char *const[]){STARTED, HELLO, HELLO, HELLO END, NULL});
    assert_int_equal(capture().code, ERR_NONE);
}

TEST_MAIN(cmocka_unit_test_setup_teardown(a_nacred_that_hangs_is_not_waited_for, setup, teardown),
          cmocka_unit_test_setup_teardown(one_that_has_nothing_to_tell_but_answers_is, setup,
                                          teardown))

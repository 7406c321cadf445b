// test_window.c - the window itself, played by scripts on a screen of its own (Xvfb).
//
// Skipped, with a message, where there is no Xvfb.
#include "tests/run.h"

#include "core/imgfile.h"
#include "core/outfile.h"
#include "ui/coil.h"
#include <dirent.h>
#include <fcntl.h>
#include <signal.h>

static pid_t screen;
static char display[32];

// Xvfb picks a free display and writes its number to the descriptor.
static int open_screen(void **state)
{
    int p[2];
    (void)state;
    if (pipe(p))
        return -1;
    screen = fork();
    if (!screen) {
        const int quiet = open("/dev/null", O_WRONLY);
        char fd[16];
        dup2(quiet, STDERR_FILENO);
        close(p[0]);
        snprintf(fd, sizeof fd, "%d", p[1]);
        execlp("Xvfb", "Xvfb", "-displayfd", fd, "-screen", "0", "2600x1700x24", "-nolisten", "tcp",
               (char *)NULL);
        _exit(127);
    }
    close(p[1]);
    display[0] = ':';
    size_t n = 1; // to the line's end: Xvfb writes it in parts, and dies of a closed pipe
    while (n < sizeof display - 1 && read(p[0], display + n, 1) == 1 && display[n] != '\n')
        n++;
    display[n > 1 ? n : 0] = 0;
    close(p[0]);
    enter_scratch("window");
    return 0;
}

static int close_screen(void **state)
{
    (void)state;
    kill(screen, SIGTERM);
    waitpid(screen, NULL, 0);
    return 0;
}

static void need_screen(void)
{
    if (!display[0]) {
        print_message("skipped: no Xvfb to open a window on\n");
        skip();
    }
}

// The long ones run where they are asked for: NACRE_WINDOW=all.
static void need_all(void)
{
    need_screen();
    if (!getenv("NACRE_WINDOW"))
        skip();
}

// nacre-view with a script.
static struct run play(const char *words, const char *script)
{
    struct run r = {0};
    char line[4096];
    FILE *f = fopen("script", "w");
    fputs(script, f);
    fclose(f);
    // Drivers and X libraries keep what they allocated once.
    snprintf(line, sizeof line,
             "DISPLAY=%s ASAN_OPTIONS=detect_leaks=0 timeout 900 %s/nacre-view %s --script script "
             ">run.out 2>run.err </dev/null",
             display, BIN_DIR, words);
    const int status = system(line);
    r.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    f = fopen("run.out", "r");
    r.out[fread(r.out, 1, sizeof r.out - 1, f)] = 0;
    fclose(f);
    f = fopen("run.err", "r");
    r.err[fread(r.err, 1, sizeof r.err - 1, f)] = 0;
    fclose(f);
    return r;
}

static void expect(const struct run *r, const char *text)
{
    if (r->status || !strstr(r->out, text))
        fail_msg("status %d, no '%s' in:\n%s%s", r->status, text, r->out, r->err);
}

static void read_shot(const char *path, struct image *im)
{
    struct err e;
    if (!image_read(im, path, &e))
        fail_msg("%s", e.msg);
}

// Mean difference of two screenshots in the middle, where the picture is.
static double differ(const char *a, const char *b)
{
    struct image x, y;
    double sum = 0;
    read_shot(a, &x);
    read_shot(b, &y);
    assert_int_equal(x.w, y.w);
    assert_int_equal(x.h, y.h);
    for (int j = 0; j < x.h * 9 / 10; j++)
        for (int i = x.w / 4; i < x.w * 2 / 3; i++)
            for (int c = 0; c < 3; c++) {
                const size_t k = ((size_t)j * (size_t)x.w + (size_t)i) * 3 + (size_t)c;
                sum += fabs((double)x.px[k] - (double)y.px[k]);
            }
    const double mean = sum / (x.w * 5 / 12.0) / (x.h * 0.9) / 3;
    image_finish(&x);
    image_finish(&y);
    return mean;
}

#define SCENE SOURCE_DIR "/rigs/scenes/"

TEST(the_window_opens_shows_and_ends)
{
    need_screen();
    const struct run r = play("--size 900x600 " SCENE "cd-g04.yaml",
                              "settle\nmove material 0.4 0.3\nprint\nscreenshot a.png\n");
    expect(&r, "item             cd-g04");
    expect(&r, "on               sample");
    struct image im;
    read_shot("a.png", &im);
    assert_int_equal(im.w, 900);
    assert_int_equal(im.h, 600);
    image_finish(&im);
}

TEST(the_camera_the_light_and_the_kind_change_the_picture_and_undo_brings_it_back)
{
    need_screen();
    const struct run r = play("--size 800x600 " SCENE "radial-whole.yaml",
                              "settle\nmove 5 5\nscreenshot a.png\n"
                              "drag material 0.5 0.5 0.6 0.5\nmove 5 5\nscreenshot b.png\n"
                              "drag material 0.5 0.5 0.6 0.6 right\nmove 5 5\nscreenshot c.png\n"
                              "key K\nscreenshot d.png\n"
                              "key ctrl+Z\nkey ctrl+Z\nkey ctrl+Z\nscreenshot e.png\nprint\n"
                              "key ctrl+Y\nprint\n");
    expect(&r, "undone: yaw");
    expect(&r, "redone: yaw");
    assert_true(differ("a.png", "b.png") > 1e-3);
    assert_true(differ("b.png", "c.png") > 1e-3);
    assert_true(differ("c.png", "d.png") > 1e-3);
    assert_near(differ("a.png", "e.png"), 0, 1e-6);
}

TEST(exposure_costs_no_drawing)
{
    need_screen();
    const struct run r =
        play("--size 800x600 " SCENE "plane.yaml", "settle\nkey E\nkey E\nkey O\nkey C\nprint\n");
    expect(&r, "1 pictures, 0 rooms");
    expect(&r, "set.offset       0.1");
}

TEST(split_and_difference_show_the_other_kind)
{
    need_screen();
    const struct run r = play("--size 800x600 " SCENE "radial-whole.yaml",
                              "settle\nscreenshot a.png\nkey D\nscreenshot b.png\n"
                              "drag material 0.5 0.9 0.2 0.9\nprint\nkey D\nscreenshot c.png\n");
    expect(&r, "set.split        0.2");
    assert_true(differ("a.png", "b.png") > 1e-3);
    assert_true(differ("b.png", "c.png") > 1e-3);
}

TEST(a_file_that_is_broken_is_told_about_and_the_window_stays)
{
    need_screen();
    FILE *f = fopen("bad.yaml", "w");
    fputs("camera: {eye: [0, 0, 1m], target: [0, 0, 0], fov: 20deg}\nlights: []\n", f);
    fclose(f);
    const struct run r = play("--size 800x600 bad.yaml " SCENE "plane.yaml",
                              "settle\nprint\nkey E\nscreenshot a.png\nselect 2\nsettle\nprint\n");
    expect(&r, "trouble          bad.yaml:");
    expect(&r, "item             plane");
}

TEST(what_cannot_be_opened_is_an_exit_code)
{
    need_screen();
    struct run r = play("none.yaml", "quit\n");
    assert_int_equal(r.status, 5);
    r = play("--size 10x10", "quit\n");
    assert_int_equal(r.status, 3);
    r = play("--scale 9", "quit\n");
    assert_int_equal(r.status, 3);
    r = play("", "fly\n");
    assert_int_equal(r.status, 3);
    assert_non_null(strstr(r.err, "script:1: 'fly' is not a step"));
}

TEST(a_lost_context_is_made_anew_with_what_was_set)
{
    need_screen();
    const struct run r = play("--size 700x500 " SCENE "cd-g04.yaml",
                              "settle\nset 30 yaw\nset 1 exposure\nsettle\nscreenshot before.png\n"
                              "lose\nsettle\nscreenshot after.png\nprint\nkey E\nprint\n");
    expect(&r, "OpenGL lost its context; all was drawn anew");
    expect(&r, "set.yaw          30");
    expect(&r, "set.exposure     1.5");
    assert_true(differ("before.png", "after.png") < 0.002);
    char script[200] = "settle\n";
    for (int k = 0; k < 6; k++)
        strcat(script, "lose\nsettle\n");
    const struct run again = play("--size 700x500 " SCENE "cd-g04.yaml", script);
    assert_int_equal(again.status, 4);
    assert_non_null(strstr(again.err, "OpenGL lost its context 6 times; nacre render --backend cpu "
                                      "draws without it"));
}

// A small table under every name that the scenes ask for, and the coil.
static void make_tables(void)
{
    static const char *const names[] = {"phone-fine", "laptop", "holographic", "tv",
                                        "blazed",     "cd",     "snake"};
    const struct run r =
        run_nacre("simulate " SOURCE_DIR "/rigs/samples/lcd.yaml --what truth --illuminant D65 "
                  "--size 33 --range 0.3 --power 3 -o phone.exr");
    const struct run photo = run_nacre("simulate " SOURCE_DIR "/rigs/samples/laptop.yaml --what "
                                       "pattern --filter green -o laptop-photo.exr");
    struct err e;
    assert_int_equal(r.status, 0);
    assert_int_equal(photo.status, 0);
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        char line[100];
        snprintf(line, sizeof line, "cp phone.exr %s.exr", names[k]);
        assert_int_equal(system(line), 0);
    }
    assert_true(coil_write("snake.obj", &e));
}

TEST(every_shipped_scene_loads_and_is_drawn)
{
    need_all();
    char script[8000] = "";
    DIR *folder = opendir(SOURCE_DIR "/rigs/scenes");
    int n = 0;
    make_tables();
    for (const struct dirent *d; (d = readdir(folder));)
        if (strstr(d->d_name, ".yaml"))
            snprintf(script + strlen(script), sizeof script - strlen(script),
                     "select %d\nsettle\nmove material 0.5 0.5\nprint\n", ++n);
    closedir(folder);
    assert_true(n >= 20);
    const struct run r = play("--size 400x300 --tables . " SOURCE_DIR "/rigs/scenes", script);
    char check[100]; // the output is longer than a struct run holds
    assert_int_equal(r.status, 0);
    assert_int_not_equal(system("grep trouble run.out"), 0);
    snprintf(check, sizeof check, "test $(grep -c ' pictures, ' run.out) = %d", n);
    assert_int_equal(system(check), 0);
}

TEST(a_table_is_inspected_and_shown_at_twice_the_size)
{
    need_all();
    make_tables();
    const struct run r = play("--size 700x500 --scale 2 phone.exr",
                              "settle\nmove table 0.6 0.5\nkey G\nprint\nscreenshot a.png\n");
    expect(&r, "u, v             +0.0");
    expect(&r, "implied pitch");
    struct image im;
    read_shot("a.png", &im);
    assert_int_equal(im.w, 1400);
    image_finish(&im);
}

TEST(a_turntable_writes_frames_and_ends_where_it_began)
{
    need_all();
    const struct run r =
        play("--size 500x400 " SCENE "cd-g04.yaml", "settle\nturntable 4 turn\nsettle\nprint\n");
    expect(&r, "4 frames: ffmpeg");
    assert_null(strstr(r.out, "set.yaw"));
    assert_int_equal(access("turn/0003.png", R_OK), 0);
    assert_int_not_equal(access("turn/0004.png", R_OK), 0);
}

static void write_rig(const char *plan)
{
    static const char rig[] = "name: r\ncamera: {uri: 'sim:w=96,h=64,realtime=1,world=@run'}\n"
                              "lights:\n  trigger: 'sim:lines=1,world=@run'\n"
                              "  list: [{name: led, line: 0, max_on: 1s}]\n";
    struct err e;
    assert_true(outfile_write("rig.yaml", rig, sizeof rig - 1, &e));
    assert_true(outfile_write("plan.yaml", plan, strlen(plan), &e));
}

TEST(a_session_is_stepped_through)
{
    need_all();
    write_rig("name: p\nlights: [led]\nexposures: [2ms, 8ms, 32ms]\n");
    const struct run c = run_nacre("capture --rig rig.yaml --plan plan.yaml -o session");
    assert_int_equal(c.status, 0);
    const struct run r =
        play("--size 800x600 session", "settle\nkey left\nsettle\nprint\nkey Z\nkey space\nsettle\n"
                                       "move picture 0.5 0.5\nprint\n");
    expect(&r, "session          complete, 3 of 3 frames");
    expect(&r, "exposure         8 ms");
    expect(&r, "exposure         32 ms");
    expect(&r, "u, v ");
}

static pid_t start_daemon(const char *socket)
{
    const pid_t pid = fork();
    if (!pid) {
        execl(BIN_DIR "/nacred", "nacred", "--socket", socket, NULL);
        _exit(127);
    }
    return pid;
}

// Until the window has printed this, at most two minutes.
static void wait_for_print(const char *text)
{
    char line[200];
    snprintf(line, sizeof line,
             "timeout 120 sh -c 'until grep -q \"%s\" run.out; do sleep 0.2; done'", text);
    if (system(line))
        _exit(1);
}

TEST(a_daemon_that_dies_and_returns_is_followed)
{
    need_all();
    setenv("NACRE_SOCKET", "d.sock", 1);
    // Long enough to be noticed: the daemon is looked for every second.
    write_rig("name: p\nlights: [led]\nexposures: [100ms]\nrepeats: 40\n");
    assert_int_equal(system("rm -f run.out"), 0);
    const pid_t daemon = start_daemon("d.sock"), other = fork();
    if (!other) { // kills it, starts another, and captures
        wait_for_print("nacred  *process");
        kill(daemon, SIGKILL);
        wait_for_print("nacred has gone");
        const int status =
            system(BIN_DIR "/nacre capture --rig rig.yaml --plan plan.yaml -o live >cap.out");
        wait_for_print("complete, 40 of 40");
        _exit(status != 0);
    }
    char script[3000] = "settle\n";
    for (int k = 0; k < 100; k++)
        strcat(script, "wait 0.5\nprint\n");
    const struct run r = play("--size 800x600 --connect d.sock", script);
    int status;
    waitpid(other, &status, 0);
    unsetenv("NACRE_SOCKET");
    assert_int_equal(status, 0);
    assert_int_equal(r.status, 0);
    waitpid(daemon, &status, 0);
}

TEST(a_capture_is_begun_held_and_ended_in_the_window)
{
    need_all();
    write_rig("name: p\nlights: [led]\nexposures: [100ms]\nrepeats: 40\n");
    assert_int_equal(system("rm -rf shot && mkdir shot"), 0);
    const pid_t daemon = start_daemon("e.sock");
    const struct run r =
        play("--size 800x600 --connect e.sock --rig rig.yaml --plan plan.yaml --sessions shot",
             "wait 2\nkey ctrl+R\nwait 2\nprint\nkey space\nwait 1.5\nprint\nkey space\nwait "
             "1.5\nprint\nkey ctrl+R\nkey ctrl+X\nwait 1.5\nsettle\nprint\n");
    expect(&r, "capture          paused, ");
    expect(&r, "last             frame ");
    expect(&r, "note             a capture is running already");
    expect(&r, "capture          none is running");
    int status;
    kill(daemon, SIGTERM);
    waitpid(daemon, &status, 0);
    const struct run s = run_nacre("session verify $(ls -d shot/capture-*)");
    assert_non_null(strstr(s.out, "partial"));
    // Without nacred: said, and nothing else happens.
    const struct run none =
        play("--size 800x600 --connect none.sock --sessions shot", "wait 1.2\nkey ctrl+R\nprint\n");
    expect(&none, "a capture needs nacred");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_window_opens_shows_and_ends),
        cmocka_unit_test(
            the_camera_the_light_and_the_kind_change_the_picture_and_undo_brings_it_back),
        cmocka_unit_test(exposure_costs_no_drawing),
        cmocka_unit_test(split_and_difference_show_the_other_kind),
        cmocka_unit_test(a_file_that_is_broken_is_told_about_and_the_window_stays),
        cmocka_unit_test(what_cannot_be_opened_is_an_exit_code),
        cmocka_unit_test(every_shipped_scene_loads_and_is_drawn),
        cmocka_unit_test(a_table_is_inspected_and_shown_at_twice_the_size),
        cmocka_unit_test(a_turntable_writes_frames_and_ends_where_it_began),
        cmocka_unit_test(a_session_is_stepped_through),
        cmocka_unit_test(a_daemon_that_dies_and_returns_is_followed),
        cmocka_unit_test(a_capture_is_begun_held_and_ended_in_the_window),
        cmocka_unit_test(a_lost_context_is_made_anew_with_what_was_set),
    };
    return cmocka_run_group_tests(tests, open_screen, close_screen);
}

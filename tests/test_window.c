// test_window.c - the window itself, played by scripts on a screen of its own (Xvfb).
//
// Skipped, with a message, where there is no Xvfb.
#include "tests/run.h"

#include "core/imgfile.h"
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
             "DISPLAY=%s ASAN_OPTIONS=detect_leaks=0 timeout 120 %s/nacre-view %s --script script "
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
    };
    return cmocka_run_group_tests(tests, open_screen, close_screen);
}

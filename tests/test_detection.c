// test_detection.c - every kind of fault, injected into simulated brackets: each is noticed and
// named, and no frame that it spoiled counts; brackets without a fault raise no alarm.
//
// One fault a bracket, at a random shot. The same bracket without a fault is the truth that every
// frame that counts is held against. NACRE_FAULTS says how many brackets with and how many without
// (default 56); they run in a few processes side by side, because lost frames are waited for.
#include "tests/test.h"

#include "acquire/shooter.h"
#include "core/mem.h"
#include "core/outfile.h"
#include "sim/sim.h"
#include "tests/run.h"
#include <ftw.h>

enum { W = 96, H = 64, BANDS = 8, EXPOSURES = 5, LIT = 2 * EXPOSURES, STEPS = LIT + EXPOSURES };
enum { WORKERS = 8, MOST = 100000 };

static const struct cam_driver *const cams[] = {&sim_cam, &fault_cam, NULL};
static const struct trig_driver *const trigs[] = {&sim_trig, &fault_trig, NULL};
static const struct drivers drivers = {cams, trigs, false};

enum where { LIT_SHOTS, ALL_SHOTS, DRIFT_PEAKS, MOVE_1, MOVE_2, BRACKET };

// `sign`: what its frame's verdict, the history or the end of the capture must say; several are
// separated by '|'. Goes on: the capture completes by itself; else --resume completes it.
static const struct kind {
    const char *name, *cam, *lamp, *lights, *wheel, *sim; // options with the shot's number
    enum where where;
    int factors; // 1: exposure factors that the camera keeps to itself
    const char *sign;
    bool goes_on;
} kinds[] = {
    {"dropped", "drop=%d", .where = ALL_SHOTS, .sign = "no frame for shot", .goes_on = true},
    {"the frame before again", "duplicate=%d", .where = ALL_SHOTS, .sign = "duplicate",
     .goes_on = true},
    {"delivered twice", "twice=%d", .where = ALL_SHOTS, .sign = "a sequence number of before",
     .goes_on = true},
    {"late", "late=%d,delay=1500ms", .where = ALL_SHOTS, .sign = "too late a frame",
     .goes_on = true},
    {"torn", "torn=%d", .where = ALL_SHOTS, .sign = "damaged", .goes_on = true},
    {"marked as damaged", "damaged=%d", .where = ALL_SHOTS, .sign = "damaged", .goes_on = true},
    {"wrong exposure, hidden", "exposure=%d", .where = LIT_SHOTS, .factors = 1,
     .sign = "wrong-light|light-missed", .goes_on = true},
    {"wrong exposure, told", "rounds=%d", .where = ALL_SHOTS, .factors = 1,
     .sign = "wrong-exposure", .goes_on = true},
    {"settings a frame late, told", "lag=%d", .where = ALL_SHOTS, .sign = "wrong-exposure",
     .goes_on = true},
    {"settings ignored, hidden", "ignores=%d", .where = LIT_SHOTS,
     .sign = "wrong-light|light-missed", .goes_on = true},
    {"camera busy", "busy=%d", .where = ALL_SHOTS, .sign = "busy"},
    {"unplugged, comes back", "unplug=%d", .where = ALL_SHOTS, .sign = "unplugged"},
    {"stalled", "stall=%d", .where = ALL_SHOTS, .sign = "no frame came"},
    {"disk full", "disk-full=%d", .where = ALL_SHOTS, .sign = "File too large|disk"},
    {"flash missed", .lights = "miss=%d", .where = LIT_SHOTS, .sign = "wrong-light|light-missed",
     .goes_on = true},
    {"flash early", .lights = "early=%d,flash=100us", .where = LIT_SHOTS,
     .sign = "wrong-light|uneven", .goes_on = true},
    {"light fails", .lights = "fail=%d", .where = LIT_SHOTS, .sign = "does not answer"},
    {"light drifts", .lamp = ",drift=0.4,flaws=%d", .where = DRIFT_PEAKS, .sign = "wrong-light",
     .goes_on = true},
    {"light chopped (PWM)", .lamp = ",pwm=230Hz,duty=0.25,flaws=%d", .where = LIT_SHOTS,
     .sign = "wrong-light|uneven", .goes_on = true},
    {"wheel stuck, second filter", .wheel = "stuck=2", .where = MOVE_2, .sign = "same-filter",
     .goes_on = true},
    {"wheel stuck, first filter", .wheel = "stuck=1", .where = MOVE_1, .sign = "same-filter"},
    {"settings always late, told", "lag=2-999", .where = BRACKET, .sign = "wrong-exposure",
     .goes_on = true},
    {"settings always late, hidden", "ignores=2-999", .where = BRACKET,
     .sign = "wrong-light|light-missed", .goes_on = true},
    {"later than promised, hidden", "ignores=2-999,in=fault:ignores=2-999,in=fault:ignores=2-999",
     .sim = "settle=1,", .where = BRACKET, .sign = "wrong-light|light-missed", .goes_on = true},
};
enum { KINDS = sizeof kinds / sizeof *kinds };

struct tally { // of one kind, or (last) of clean brackets
    int injected, detected, harmless, missed, wrong, unfinished;
    double worst; // deviation from the truth of a frame that counts, in units of what is allowed
    char example[200];
};

static uint64_t random_state;

static int random_below(int n)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (int)((random_state >> 33) % (uint64_t)n);
}

// --- one bracket ---

static void ended(void *ctx, const struct err *how)
{
    void **to = ctx;
    *(struct err *)to[1] = *how;
    loop_stop(to[0]);
}

static struct err capture(bool resume)
{
    struct err e = {0}, how = {0};
    struct loop *l = loop_new();
    void *ctx[2] = {l, &how};
    const struct shooter_order order = {.rig = "rig.yaml",
                                        .plan = "plan.yaml",
                                        .session = "s",
                                        .resume = resume,
                                        .drivers = &drivers,
                                        .end = ended,
                                        .ctx = ctx};
    struct shooter *s = shooter_new(l, &order, &e);
    if (!s || !loop_run(l, &e))
        how = e;
    shooter_free(s);
    loop_free(l);
    return how;
}

static void put(const char *path, const char *text)
{
    struct err e;
    if (!outfile_write(path, text, strlen(text), &e))
        fail_msg("%s", e.msg);
}

static int remove_one(const char *path, const struct stat *st, int type, struct FTW *ftw)
{
    (void)st;
    (void)type;
    (void)ftw;
    return remove(path);
}

// The bracket `seed` with a fault of a kind (NULL: none) at an event.
static void prepare(const struct kind *k, int at, int seed)
{
    static const double factors[] = {0.4, 0.5, 0.75, 1.3, 2, 4};
    char cam[200] = "", lamp[80] = "", lights[80] = "", wheel[80] = "", text[1500];
    nftw("s", remove_one, 16, FTW_DEPTH | FTW_PHYS);
    remove("count");
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    if (k && k->cam)
        snprintf(cam, sizeof cam, k->cam, at);
    if (k && k->lamp)
        snprintf(lamp, sizeof lamp, k->lamp, at);
    if (k && k->lights)
        snprintf(lights, sizeof lights, k->lights, at);
#pragma GCC diagnostic pop
    if (k && k->factors)
        snprintf(cam + strlen(cam), sizeof cam - strlen(cam), ",factor=%g",
                 factors[random_below(6)]);
    if (k && k->wheel)
        snprintf(wheel, sizeof wheel, "%s", k->wheel);
    const bool backwards = k && k->where == MOVE_1; // the wheel rests at the first filter
    snprintf(text, sizeof text,
             "name: r\n"
             "camera: {uri: 'fault:%s%sstate=count,in=sim:%sw=%d,h=%d,seed=%d,grace=0,dead=300ms,"
             "world=@run'}\n"
             "lights:\n  trigger: 'fault:%s%sin=sim:lines=1,world=@run%s'\n"
             "  list: [{name: led, line: 0, max_on: 5s}]\n"
             "filters:\n  trigger: 'fault:%s%sin=sim:positions=2,world=@run'\n"
             "  list: [{name: a, position: %d}, {name: b, position: %d}]\n",
             cam, *cam ? "," : "", k && k->sim ? k->sim : "", W, H, seed, lights,
             *lights ? "," : "", lamp, wheel, *wheel ? "," : "", backwards, !backwards);
    put("rig.yaml", text);
    put("plan.yaml", "name: p\nlights: [led]\nfilters: [a, b]\n"
                     "exposures: {first: 1ms, last: 16ms}\ndarks: 1\nretries: 2\n");
}

struct light { // counts above black by band of rows
    double sum[BANDS];
};

static struct light light_of(const struct session_frame *f)
{
    struct light l = {0};
    struct dng d;
    struct err e;
    char path[100];
    snprintf(path, sizeof path, "s/%s", f->path);
    if (!dng_read(&d, path, &e))
        fail_msg("%s", e.msg);
    for (int j = 0; j < H; j++)
        for (int i = 0; i < W; i++)
            l.sum[j * BANDS / H] += d.raw[j * W + i] - f->black;
    dng_finish(&d);
    return l;
}

// How far light is from the truth, in units of what counts as right: a part of it, black to two
// counts a pixel, noise to six sigma.
static double off_by(double light, double truth, double pixels, double part)
{
    const double sigma = sqrt(2 * (pixels * 4 + fmax(truth, 0) / 2.5));
    return fabs(light - truth) / (part * fabs(truth) + 2 * pixels + 6 * sigma);
}

// The judge lets pass 8 % of a whole frame and 10 % of a band of rows, and five times the sigma
// that is in the ledger; bands it does not judge where much saturates, because of spilt charge.
static double deviation(const struct light *l, const struct light *truth, double saturated)
{
    double worst = 0, all = 0, all_true = 0;
    for (int b = 0; b < BANDS; b++) {
        if (saturated < 0.005)
            worst = fmax(worst, off_by(l->sum[b], truth->sum[b], W * H / BANDS, 0.5));
        all += l->sum[b];
        all_true += truth->sum[b];
    }
    return fmax(worst, off_by(all, all_true, W * H, 0.2));
}

static struct session_frame *all_frames(int *n, struct session_report *r)
{
    struct session *s;
    struct session_frame *f;
    struct err e = {0};
    if (!session_open(&s, "s", SESSION_READ, &e) || !session_frames(s, false, &f, n, &e) ||
        !session_verify(s, r, &e))
        fail_msg("%s", e.msg);
    if (r->state == SESSION_DAMAGED)
        fail_msg("damaged: %s", r->problem[0]);
    session_close(s);
    return f;
}

static bool says(const char *text, const char *signs)
{
    for (const char *at = signs; *at; at += strcspn(at, "|"), at += *at == '|') {
        char *sign = xasprintf("%.*s", (int)strcspn(at, "|"), at);
        const bool hit = strstr(text, sign) != NULL;
        free(sign);
        if (hit)
            return true;
    }
    return false;
}

static bool history_says(const char *signs)
{
    struct session *s;
    struct session_event *event;
    struct err e = {0};
    int n;
    bool any = false;
    if (!session_open(&s, "s", SESSION_READ, &e) || !session_history(s, &event, &n, &e))
        fail_msg("%s", e.msg);
    for (int k = 0; k < n; k++)
        any |= says(event[k].text, signs);
    free(event);
    session_close(s);
    return any;
}

static void clean_bracket(int seed, struct light truth[STEPS], struct tally *t)
{
    struct session_report r;
    int n, bad = 0;
    prepare(NULL, 0, seed);
    const struct err how = capture(false);
    if (how.code)
        fail_msg("a clean bracket ended: %s", how.msg);
    struct session_frame *f = all_frames(&n, &r);
    for (int k = 0; k < n; k++) {
        const bool good = !strcmp(f[k].verdict, "good");
        bad += !good;
        if (good)
            truth[f[k].step.index] = light_of(&f[k]);
        else
            snprintf(t->example, sizeof t->example, "step %d: %s: %.150s", f[k].step.index,
                     f[k].verdict, f[k].reason);
    }
    t->injected++;
    t->missed += bad > 0 || n != STEPS;
    free(f);
}

static int choose(enum where where)
{
    switch (where) {
    case LIT_SHOTS: return 2 + random_below(LIT - 1);
    case ALL_SHOTS: return 2 + random_below(STEPS - 1);
    case DRIFT_PEAKS: return 5 + random_below(LIT - 4); // sin(2 pi n / 40) is over 0.7
    case MOVE_1:
    case MOVE_2:
    case BRACKET: break;
    }
    return 0;
}

// Which step's truth a frame must show: the wheel's order may be the other way round.
static int truth_of(const struct kind *k, int step)
{
    return k->where != MOVE_1 || step >= LIT ? step : (step + EXPOSURES) % LIT;
}

static void faulty_bracket(const struct kind *k, int seed, const struct light truth[STEPS],
                           struct tally *t)
{
    struct session_report r;
    const int at = choose(k->where);
    int n;
    prepare(k, at, seed);
    const struct err how = capture(false);
    struct session_frame *f = all_frames(&n, &r);
    bool named = says(how.msg, k->sign) || history_says(k->sign), accepted = false;
    char verdict[200] = "no such frame";
    int wrong = 0;
    for (int i = 0; i < n; i++) {
        const bool good = !strcmp(f[i].verdict, "good"), its = f[i].shot == (uint64_t)at;
        named |= !good && (its || !at) && says(f[i].verdict, k->sign);
        if (its)
            snprintf(verdict, sizeof verdict, "%s: %.150s", f[i].verdict, f[i].reason);
        if (!good)
            continue;
        accepted |= its;
        const struct light l = light_of(&f[i]);
        const double off = deviation(&l, &truth[truth_of(k, f[i].step.index)], f[i].saturated);
        t->worst = fmax(t->worst, off);
        wrong += off > 1;
        if (off > 1)
            snprintf(t->example, sizeof t->example, "seed %d, event %d: step %d counts, %.1f off",
                     seed, at, f[i].step.index, off);
    }
    free(f);
    t->injected++;
    t->wrong += wrong;
    t->detected += named;
    t->harmless += !named && accepted && !wrong;
    t->missed += !named && !(accepted && !wrong);
    if (!named && !(accepted && !wrong))
        snprintf(t->example, sizeof t->example, "seed %d, event %d: %.150s", seed, at,
                 how.code ? how.msg : verdict);
    const bool by_itself = how.code == ERR_NONE;
    if (!k->goes_on && k->cam && !by_itself) { // the count of shots outlives the camera
        const struct err again = capture(true);
        if (again.code)
            snprintf(t->example, sizeof t->example, "seed %d, resumed: %.150s", seed, again.msg);
        t->unfinished += again.code != ERR_NONE;
    }
    t->unfinished += k->goes_on && !by_itself;
    if (k->goes_on && !by_itself)
        snprintf(t->example, sizeof t->example, "seed %d, event %d: %.150s", seed, at, how.msg);
}

// --- many, side by side ---

static void work(int worker, int brackets, int pipe_fd)
{
    struct tally t[KINDS + 1] = {0};
    char folder[100], line[200];
    snprintf(folder, sizeof folder, "%s/nacre-detection-%d",
             access("/dev/shm", W_OK) ? "/tmp" : "/dev/shm", (int)getpid());
    snprintf(line, sizeof line, "mkdir -p %s", folder);
    if (system(line) || chdir(folder))
        _exit(1);
    for (int b = 0; b < brackets; b++) {
        struct light truth[STEPS];
        if ((b + b / KINDS) % WORKERS != worker) // every one gets some of the kinds that take long
            continue;
        random_state = (uint64_t)b * 7919 + 1;
        clean_bracket(b + 1, truth, &t[KINDS]);
        faulty_bracket(&kinds[b % KINDS], b + 1, truth, &t[b % KINDS]);
    }
    snprintf(line, sizeof line, "rm -rf %s", folder);
    if (system(line) || write(pipe_fd, t, sizeof t) != sizeof t)
        _exit(1);
    _exit(0);
}

static void add(struct tally *to, const struct tally *from)
{
    to->injected += from->injected;
    to->detected += from->detected;
    to->harmless += from->harmless;
    to->missed += from->missed;
    to->wrong += from->wrong;
    to->unfinished += from->unfinished;
    to->worst = fmax(to->worst, from->worst);
    if (*from->example)
        snprintf(to->example, sizeof to->example, "%s", from->example);
}

TEST(every_fault_is_noticed_and_named_and_nothing_clean_is_suspected)
{
    const char *text = getenv("NACRE_FAULTS");
    const int brackets = text ? atoi(text) : 2 * KINDS;
    struct tally all[KINDS + 1] = {0}, part[KINDS + 1], sum = {0};
    int pipes[WORKERS][2];
    pid_t pid[WORKERS];
    assert_in_range(brackets, 1, MOST);
    setenv("OMP_NUM_THREADS", "1", 1);
    for (int w = 0; w < WORKERS; w++) {
        assert_int_equal(pipe(pipes[w]), 0);
        if (!(pid[w] = fork()))
            work(w, brackets, pipes[w][1]);
        close(pipes[w][1]);
    }
    for (int w = 0; w < WORKERS; w++) {
        int status;
        const bool whole = read(pipes[w][0], part, sizeof part) == sizeof part;
        close(pipes[w][0]);
        waitpid(pid[w], &status, 0);
        if (!whole || status)
            fail_msg("a worker has failed");
        for (int k = 0; k <= KINDS; k++)
            add(&all[k], &part[k]);
    }
    print_message("%-30s %8s %8s %8s %6s %6s %10s\n", "fault", "injected", "detected", "harmless",
                  "missed", "wrong", "unfinished");
    for (int k = 0; k < KINDS; k++) {
        const struct tally *t = &all[k];
        print_message("%-30s %8d %8d %8d %6d %6d %10d  %s\n", kinds[k].name, t->injected,
                      t->detected, t->harmless, t->missed, t->wrong, t->unfinished, t->example);
        add(&sum, t);
    }
    print_message("%-30s %8d %8d %8d %6d %6d %10d\n", "all", sum.injected, sum.detected,
                  sum.harmless, sum.missed, sum.wrong, sum.unfinished);
    print_message("clean brackets: %d, with an alarm: %d  %s\n", all[KINDS].injected,
                  all[KINDS].missed, all[KINDS].example);
    assert_int_equal(sum.missed + sum.wrong + sum.unfinished, 0);
    assert_int_equal(all[KINDS].missed, 0);
}

TEST_MAIN(cmocka_unit_test(every_fault_is_noticed_and_named_and_nothing_clean_is_suspected))

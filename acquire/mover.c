// mover.c - one thread, one wish at a time.
#define _GNU_SOURCE
#include "acquire/mover.h"
#include "acquire/clock.h"
#include <string.h>
#include <sys/eventfd.h>

static void *work(void *arg)
{
    struct mover *m = arg;
    pthread_mutex_lock(&m->mutex);
    while (!m->quit) {
        if (m->wanted < 0) {
            pthread_cond_wait(&m->wake, &m->mutex);
            continue;
        }
        const int position = m->wanted;
        m->wanted = -1;
        pthread_mutex_unlock(&m->mutex);
        struct err how = {0};
        m->move(m->trig, position, &how);
        pthread_mutex_lock(&m->mutex);
        if (m->wanted < 0 && !m->quit) { // else what has been done does not count any more
            m->trig->moved = how;
            m->trig->changed_ns = clock_boot_ns();
            eventfd_write(m->trig->fd, 1);
        }
    }
    pthread_mutex_unlock(&m->mutex);
    return NULL;
}

bool mover_init(struct mover *m, struct trig *trig,
                bool (*move)(struct trig *t, int position, struct err *e), struct err *e)
{
    *m = (struct mover){.trig = trig, .move = move, .wanted = -1};
    trig->fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    if (trig->fd < 0)
        return err_errno(e, "eventfd");
    pthread_mutex_init(&m->mutex, NULL);
    pthread_cond_init(&m->wake, NULL);
    const int rc = pthread_create(&m->thread, NULL, work, m);
    m->running = rc == 0;
    return m->running || err_set(e, ERR_DEVICE, "no thread: %s", strerror(rc));
}

void mover_finish(struct mover *m)
{
    if (!m->running)
        return;
    pthread_mutex_lock(&m->mutex);
    m->quit = true;
    pthread_cond_signal(&m->wake);
    pthread_mutex_unlock(&m->mutex);
    pthread_join(m->thread, NULL);
    pthread_cond_destroy(&m->wake);
    pthread_mutex_destroy(&m->mutex);
    m->running = false;
}

void mover_go(struct mover *m, int position)
{
    pthread_mutex_lock(&m->mutex);
    m->wanted = position;
    pthread_cond_signal(&m->wake);
    pthread_mutex_unlock(&m->mutex);
}

bool mover_told(struct mover *m)
{
    pthread_mutex_lock(&m->mutex);
    const bool told = m->quit || m->wanted >= 0;
    pthread_mutex_unlock(&m->mutex);
    return told;
}

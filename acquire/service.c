// service.c - libsystemd's sd-daemon, when it was there at build.
#include "acquire/service.h"
#ifdef HAVE_SYSTEMD
#include <systemd/sd-daemon.h>

int service_socket(void)
{
    return sd_listen_fds(1) == 1 ? SD_LISTEN_FDS_START : -1;
}
void service_say_ready(void)
{
    sd_notify(0, "READY=1");
}
void service_say_stopping(void)
{
    sd_notify(0, "STOPPING=1");
}
int64_t service_watchdog_ns(void)
{
    uint64_t us = 0;
    return sd_watchdog_enabled(0, &us) > 0 ? (int64_t)us * 1000 / 2 : 0;
}
void service_beat(void)
{
    sd_notify(0, "WATCHDOG=1");
}
#else
int service_socket(void)
{
    return -1;
}
void service_say_ready(void) {}
void service_say_stopping(void) {}
int64_t service_watchdog_ns(void)
{
    return 0;
}
void service_beat(void) {}
#endif

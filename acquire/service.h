// service.h - nacred as a service of systemd; without systemd every call is a quiet no.
#pragma once
#include <stdint.h>

int service_socket(void); // the descriptor of socket activation, -1: none
void service_say_ready(void);
void service_say_stopping(void);
int64_t service_watchdog_ns(void); // beat at least this often; 0: nobody watches
void service_beat(void);

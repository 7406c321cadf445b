// hid_report.c - relay boards and filter wheels, byte by byte.
#include "acquire/hid_report.h"
#include <string.h>

enum { ONE_ON = 0xff, ONE_OFF = 0xfd, ALL_ON = 0xfe, ALL_OFF = 0xfc };

int relay_count(const char *product)
{
    static const char name[] = "USBRelay";
    const size_t n = sizeof name - 1;
    if (strncmp(product, name, n) || product[n] < '1' || product[n] > '0' + RELAY_MAX ||
        product[n + 1])
        return 0;
    return product[n] - '0';
}

static void put(uint8_t out[RELAY_REPORT], int command, int relay)
{
    memset(out, 0, RELAY_REPORT);
    out[0] = (uint8_t)command;
    out[1] = (uint8_t)relay;
}

int relay_reports(uint32_t from, uint32_t to, int relays, uint8_t out[RELAY_MAX][RELAY_REPORT])
{
    const uint32_t all = (1u << relays) - 1;
    from &= all;
    to &= all;
    int n = 0;
    if (from == to)
        return 0;
    if (to == 0 || to == all) {
        put(out[n++], to ? ALL_ON : ALL_OFF, 0);
        return n;
    }
    for (int pass = 0; pass < 2; pass++)
        for (int k = 0; k < relays; k++)
            if ((from ^ to) >> k & 1 && (int)(to >> k & 1) == pass)
                put(out[n++], pass ? ONE_ON : ONE_OFF, k + 1);
    return n;
}

bool relay_read(const uint8_t *in, int n, struct relay_state *s)
{
    if (n != RELAY_REPORT)
        return false;
    for (int k = 0; k < RELAY_LETTERS; k++)
        if (in[k] <= ' ' || in[k] > '~')
            return false;
    memcpy(s->letters, in, RELAY_LETTERS);
    s->letters[RELAY_LETTERS] = 0;
    s->on = in[7];
    return true;
}

void wheel_go(int position, uint8_t out[WHEEL_REPORT])
{
    out[0] = (uint8_t)(position + 1);
    out[1] = 0;
}

void wheel_ask(uint8_t out[WHEEL_REPORT])
{
    out[0] = out[1] = 0;
}

void wheel_count(uint8_t out[WHEEL_REPORT])
{
    out[0] = 0;
    out[1] = 1;
}

bool wheel_read(const uint8_t *in, int n, struct wheel_state *s)
{
    if (n != WHEEL_REPORT || in[0] > WHEEL_MAX || in[1] > WHEEL_MAX)
        return false;
    *s = (struct wheel_state){in[0] - 1, in[1]};
    return true;
}

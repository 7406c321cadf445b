// hid_report.h - what two kinds of USB HID devices say, as bytes; the transfers are elsewhere.
//
// Relay boards (16c0:05df, product "USBRelay<n>", n relays): one feature report of 8 bytes.
//   read   0-4 the board's five letters, 5 zero, 7 the state, bit k is relay k + 1
//   write  0xff k on, 0xfd k off (k from 1), 0xfe all on, 0xfc all off
// Filter wheels (Starlight Xpress, 1278:0920; "Communication Protocols" in the maker's handbook):
// output and input reports of 2 bytes, each output is answered by one input.
//   write  n 0 go to filter n (from 1), 0 0 where are you, 0 1 count your filters
//   read   where (0: moving), how many filters (0: not known yet)
#pragma once
#include <stdbool.h>
#include <stdint.h>

enum { RELAY_REPORT = 8, RELAY_LETTERS = 5, RELAY_MAX = 8, WHEEL_REPORT = 2, WHEEL_MAX = 127 };

int relay_count(const char *product); // of "USBRelay4": 4; 0: not such a board

// Reports that lead from one state to another, relays off first; returns how many. One for all
// relays at once where that does it.
int relay_reports(uint32_t from, uint32_t to, int relays, uint8_t out[RELAY_MAX][RELAY_REPORT]);

struct relay_state {
    char letters[RELAY_LETTERS + 1];
    uint32_t on;
};
bool relay_read(const uint8_t *in, int n, struct relay_state *s); // false: no answer of a board

void wheel_go(int position, uint8_t out[WHEEL_REPORT]); // from 0
void wheel_ask(uint8_t out[WHEEL_REPORT]);
void wheel_count(uint8_t out[WHEEL_REPORT]); // makes it turn once

struct wheel_state {
    int position;  // from 0; -1: moving
    int positions; // 0: not known yet
};
bool wheel_read(const uint8_t *in, int n, struct wheel_state *s);

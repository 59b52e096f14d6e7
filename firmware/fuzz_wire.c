/* libFuzzer on everything that comes over the wire: make fuzz && build/fuzz-wire -max_total_time=60
 *
 * The first byte says whether the rest comes raw or cut into payloads that are framed properly, so that the requests
 * behind the CRC are reached as well, and whether a loop runs before. Between frames encoders move and ticks pass as the input says. Whatever comes:
 * power and command only where a host has armed the rig, never beyond the limit, and no fault without zero output. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bytes.h"
#include "frame.h"
#include "law.h"
#include "port.h"
#include "rig.h"

const char port_name[] = "fuzz";
bool port_virtual = true;
const uint16_t port_period = 1000;
const uint16_t port_steps = 32768;

static uint32_t counts[CHANNELS];
static uint16_t illegal;
static int16_t command;
static bool power;

uint32_t port_counts(uint8_t channel) { return counts[channel]; }
uint16_t port_illegal(void) { return illegal; }
void port_command(int16_t steps) { command = steps; }
bool port_settled(void) { return true; }
void port_enable(bool on) { power = on; }
uint8_t port_reset_cause(void) { return 0; }
uint32_t port_boot(void) { return 0; }
uint32_t port_lock(void) { return 0; }
void port_unlock(uint32_t before) { (void)before; }

static int16_t limit;    /* as the firmware reported it */
static uint16_t session; /* of its last answer */

static void claim(bool held, const char *what) {
    if (!held) fprintf(stderr, "not so: %s\n", what), abort();
}

void port_send(const uint8_t *bytes, uint16_t n) {
    static receiver_t host;
    for (uint16_t i = 0; i < n; i++) {
        uint16_t payload = frame_receive(&host, bytes[i]);
        claim(payload || i + 1 < n, "every frame that is sent is sound");
        if (payload) session = get_u16(host.bytes + 2);
        if (payload && host.bytes[0] == (CONFIGURE | REPLY) && host.bytes[4] == DONE)
            limit = (int16_t)get_u16(host.bytes + 54);
    }
}

static void check(void) {
    enum mode mode = rig_mode();
    bool may_move = mode == ARMED || mode == HOST || mode == MCU;
    claim(may_move == power, "power is on where the rig is armed, and nowhere else");
    claim(may_move || command == 0, "the command is zero in IDLE and FAULT");
    claim(command <= limit && command >= -limit, "the command stays within its limit");
}

#define HEAD 4 /* kind, sequence, session */

static void ask(uint8_t *payload, size_t n) {
    uint8_t frame[FRAME_MOST];
    uint16_t length = frame_make(payload, (uint16_t)n, frame);
    for (uint16_t i = 0; i < length; i++) rig_receive(frame[i]);
}

/* Requests as a host makes them, so that the fuzzer need not find lengths and ages by chance. */
static size_t proper(uint8_t *payload, size_t n, uint32_t tick) {
    static const uint8_t body[] = {
        [HELLO] = 5, [CONFIGURE] = 44, [SELF_TEST] = 4, [START] = 1, [EXCHANGE] = 8, [LAW] = LAW_BYTES, [SNAPSHOT] = 0,
    };
    payload[0] = 1 + payload[0] % SNAPSHOT;
    if (n < HEAD + (size_t)body[payload[0]]) memset(payload + n, 0, HEAD + body[payload[0]] - n);
    put_u16(payload + 2, session);
    if (payload[0] == EXCHANGE) put_u32(payload + HEAD + 4, tick);
    return HEAD + body[payload[0]];
}

/* The request of this kind, in the session that the firmware reported last. */
static void ask_now(uint8_t *payload, enum request kind, size_t n) {
    payload[0] = kind;
    put_u16(payload + 2, session);
    ask(payload, HEAD + n);
}

static void begin(enum mode mode) {
    uint8_t payload[PAYLOAD_MOST + CRC_BYTES] = {0}, *body = payload + HEAD;
    ask_now(payload, HELLO, 5);
    ask_now(payload, CLEAR, 0);
    for (int i = 0; i < 10; i++) put_u32(body + 4 * i, i == 6 || i == 7 ? 50 : 1000);
    put_u16(body + 40, 20);
    put_u16(body + 42, 3000);
    ask_now(payload, CONFIGURE, 44);
    ask_now(payload, ARM, 0);
    memset(payload, 0, sizeof payload); /* 10 steps for each count of encoder 1 */
    put_float(body + 4 * (COMMAND_ROW * INPUTS + MEMORIES), 10);
    put_u16(body + LAW_BYTES - 4, 32767);
    body[LAW_BYTES - 1] = 1;
    ask_now(payload, LAW, LAW_BYTES);
    body[0] = mode;
    ask_now(payload, START, 1);
    claim(rig_mode() == mode, "a rig that was cleared, configured and armed can be started");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    uint32_t tick = 0;
    if (!size--) return 0;
    uint8_t how = *data++;
    bool framed = how & 1;
    memset(counts, 0, sizeof counts);
    limit = 0;
    rig_reset();
    if (how & 2) begin(how & 4 ? MCU : HOST);
    while (size >= 2) {
        uint8_t payload[PAYLOAD_MOST + CRC_BYTES], shape = *data++;
        size_t n = 1 + shape % 128;
        if (n > --size) n = size;
        if (framed) {
            memcpy(payload, data, n);
            ask(payload, shape & 128 ? proper(payload, n, tick) : n);
        } else {
            for (size_t i = 0; i < n; i++) rig_receive(data[i]);
        }
        check();
        counts[0] += data[n - 1];
        counts[1] -= data[0];
        illegal += data[0] == 0xFF;
        rig_tick(tick += 1 + data[n / 2] / 128, 0);
        rig_poll();
        check();
        data += n;
        size -= n;
    }
    return 0;
}

#include "rig.h"

#include <string.h>

#include "bytes.h"
#include "ceilings.h"
#include "frame.h"
#include "law.h"
#include "port.h"

#define NO_LIMIT 0x7FFFFFFFUL /* on the wire, for a coordinate that may do what it likes */
#define FOREVER 0xFFFFFFFFUL

/* In counts, steps and ticks. */
typedef struct {
    uint32_t travel[CHANNELS];
    uint32_t speed[CHANNELS];  /* counts in SPEED_WINDOW ticks */
    uint32_t start[CHANNELS];
    uint32_t frozen[CHANNELS]; /* counts that one may travel while the other does not show one; 0 to not look */
    uint32_t twist;
    uint32_t saturation;
    uint16_t watchdog;
    int16_t command;
} limits_t;
#define LIMITS_BYTES 44

/* What a tick saw and did. */
typedef struct {
    uint32_t tick;
    uint16_t late;
    int32_t q[CHANNELS]; /* counts since they were zeroed */
    int16_t applied;     /* command that was put out until then */
    uint8_t mode;
    uint16_t faults;
} sample_t;

/* How it was when the first fault since the last CLEAR came. */
typedef struct {
    sample_t sample;
    int32_t moved[CHANNELS]; /* counts in the last SPEED_WINDOW ticks */
    int16_t command;         /* last asked for */
    uint8_t mode;            /* it came in */
} snapshot_t;

/* Shared with the tick. No `volatile`: the tick is called from outside of this file, so that whoever calls a function
 * of the port reads anew what the tick may have changed. */
static uint8_t mode;
static uint16_t faults;
static sample_t now;
static snapshot_t snapshot;
static limits_t limits;
static bool configured, has_law;
static law_t law;
static uint32_t zero[CHANNELS];                        /* counts of the port where the rig was zeroed */
static uint32_t past[SPEED_WINDOW][CHANNELS];          /* counts of the last ticks */
static uint32_t travelled_alone[CHANNELS];             /* while the other did not show one count */
static int32_t moved[CHANNELS];
static uint16_t illegal;                               /* transitions at the last tick */
static int16_t asked, output;                          /* command before and after its limit */
static float reference;
static uint32_t silence, saturated;                    /* ticks */
static int16_t pulse;
static uint16_t pulse_left;
static uint16_t braking;                               /* ticks that a stopped rig's power stage stays on */
static uint8_t until_law;                              /* ticks to the law's next sample */
static uint16_t lost;                                  /* ticks that never came */
static bool overran;                                   /* a tick came due during this one */
static uint16_t session;                               /* what a request has to name; see perform_once */
static bool awaited, due;                              /* an exchange; the sample that answers it */
static uint8_t answer_every = 1;                       /* ticks */
static uint32_t answer_at;                             /* the next tick that may answer */
static uint8_t awaited_sequence;

/* Outside of the tick. */
static receiver_t receiver;
static uint8_t payload[PAYLOAD_MOST + CRC_BYTES], frame[FRAME_MOST];
static uint8_t last_kind, last_sequence, last_result;
static uint32_t last_nonce;

static bool running(void) { return mode == HOST || mode == MCU; }
static bool powered(void) { return mode == ARMED || running(); }
static bool pulsing(void) { return mode == ARMED && pulse_left; }
static uint32_t size_of(int32_t v) { return v < 0 ? 0UL - (uint32_t)v : (uint32_t)v; }
static bool beyond(uint32_t size, uint32_t limit) { return limit != NO_LIMIT && size > limit; }
/* Twice the speed's limit in a single tick: a jump of counts that the window would take for a slow motion. */
static bool jumps(int32_t step, uint32_t speed) {
    return speed != NO_LIMIT && size_of(step) > speed / (SPEED_WINDOW / 2) + 2; /* rounding of both ends */
}

/* Zero output before anything else. */
static void power_off(enum mode next) {
    port_command(0);
    if (powered()) braking = CEILING_BRAKE;
    if (!braking) port_enable(false);
    mode = next;
    output = now.applied = 0;
    pulse_left = 0;
}

static void trip(uint16_t fault) {
    enum mode before = mode;
    int16_t was = output;
    power_off(FAULT);
    session++;
    if (!faults) {
        snapshot.sample = now;
        snapshot.sample.applied = was;
        snapshot.sample.faults = fault;
        snapshot.command = asked;
        snapshot.mode = before;
        memcpy(snapshot.moved, moved, sizeof moved);
    }
    faults |= fault;
}

/* Counts into the memory of the last ticks; returns the step since the last one. */
static int32_t remember(uint8_t channel, uint32_t counts, uint32_t tick, uint32_t elapsed) {
    const uint8_t mask = SPEED_WINDOW - 1;
    uint32_t previous = past[(tick - elapsed) & mask][channel];
    int32_t step = (int32_t)(counts - previous);
    if (elapsed > 1) { /* a straight line over ticks that never came */
        uint32_t left = elapsed < SPEED_WINDOW ? elapsed : SPEED_WINDOW;
        while (--left) {
            int64_t gone = (int64_t)step * (elapsed - left) / elapsed;
            past[(tick - left) & mask][channel] = previous + (uint32_t)gone;
        }
    }
    uint32_t *oldest = &past[tick & mask][channel];
    moved[channel] = (int32_t)(counts - *oldest);
    if (elapsed >= SPEED_WINDOW) moved[channel] = (int32_t)((int64_t)step * SPEED_WINDOW / elapsed);
    *oldest = counts;
    return step;
}

/* Positions, and whether the rig may go on with them. */
static void look(uint32_t tick, uint32_t elapsed) {
    uint16_t fault = 0;
    int32_t step[CHANNELS];
    for (uint8_t i = 0; i < CHANNELS; i++) {
        uint32_t counts = port_counts(i);
        step[i] = remember(i, counts, tick, elapsed);
        now.q[i] = (int32_t)(counts - zero[i]);
        if (beyond(size_of(now.q[i]), limits.travel[i])) fault |= F_OVERTRAVEL;
        if (beyond(size_of(moved[i]), limits.speed[i]) || (elapsed == 1 && jumps(step[i], limits.speed[i]))) fault |= F_OVERSPEED;
    }
    for (uint8_t i = 0; i < CHANNELS; i++) {
        uint8_t other = CHANNELS - 1 - i;
        travelled_alone[i] = step[other] ? 0 : travelled_alone[i] + size_of(step[i]);
        if (limits.frozen[i] && travelled_alone[i] > limits.frozen[i]) fault |= F_ENCODER;
    }
    /* a difference that runs over is beyond every twist as well */
    int32_t twist = (int32_t)((uint32_t)now.q[0] - (uint32_t)now.q[1]);
    if (beyond(size_of(twist), limits.twist)) fault |= F_TWIST;
    uint16_t seen = port_illegal();
    if (seen != illegal) fault |= F_ENCODER;
    illegal = seen;
    if (fault && powered()) trip(fault);
}

/* Limited, and put out. */
static void put_out(int16_t steps) {
    asked = steps;
    output = steps > limits.command ? limits.command : steps < -limits.command ? -limits.command : steps;
    port_command(output);
}

static void follow_law(void) {
    if (until_law) {
        until_law--;
        return;
    }
    until_law = law.every - 1;
    int16_t command;
    if (law_step(&law, now.q, reference, limits.command, &command)) put_out(command);
    else trip(F_GAINS);
}

void rig_tick(uint32_t tick, uint16_t late) {
    uint32_t elapsed = tick - now.tick;
    now.tick = tick;
    now.late = late;
    now.applied = output;
    if (elapsed > 1) lost += elapsed - 1 > 0xFFFFUL - lost ? 0xFFFF - lost : (uint16_t)(elapsed - 1);
    look(tick, elapsed);
    if (powered()) {
        silence += elapsed;
        saturated = size_of(output) < (uint32_t)limits.command ? 0 : saturated + elapsed;
        if (running() && elapsed > limits.watchdog) trip(F_OVERRUN);
        else if (silence > (running() || pulsing() ? limits.watchdog : CEILING_PATIENCE)) trip(F_WATCHDOG);
        else if (limits.saturation != FOREVER && saturated > limits.saturation) trip(F_SATURATION);
    }
    if (mode == MCU) follow_law();
    else if (pulsing()) {
        pulse_left -= elapsed < pulse_left ? (uint16_t)elapsed : pulse_left;
        put_out(pulse_left ? pulse : 0);
    }
    if (overran) {
        overran = false;
        if (running()) trip(F_OVERRUN);
    }
    if (!running() && !pulsing()) port_command(0); /* to a converter that lost its number, too */
    if (!powered()) {
        braking -= elapsed < braking ? (uint16_t)elapsed : braking;
        if (!braking) port_enable(false);
    }
    now.mode = mode;
    now.faults = faults;
    if ((int32_t)(tick - answer_at) < 0) return;
    due |= awaited;
    awaited = false;
    while ((int32_t)(tick - answer_at) >= 0) answer_at += answer_every;
}

void rig_overrun(void) { overran = true; }

static uint8_t *put_sample(uint8_t *at, const sample_t *sample) {
    put_u16(at, sample->late);
    for (uint8_t i = 0; i < CHANNELS; i++) put_u32(at + 2 + 4 * i, (uint32_t)sample->q[i]);
    put_u16(at + 2 + 4 * CHANNELS, (uint16_t)sample->applied);
    return at + 4 + 4 * CHANNELS;
}

/* Every reply begins alike; `end` is where its body ends. */
#define HEADER 4 /* kind, sequence, session */
static uint16_t session_now(void) {
    uint32_t before = port_lock();
    uint16_t copy = session;
    port_unlock(before);
    return copy;
}

#define BODY (HEADER + 8)
static void reply(uint8_t kind, uint8_t sequence, uint8_t result, const sample_t *at, const uint8_t *end) {
    payload[0] = kind | REPLY;
    payload[1] = sequence;
    put_u16(payload + 2, session_now());
    payload[HEADER] = result;
    payload[HEADER + 1] = at->mode;
    put_u16(payload + HEADER + 2, at->faults);
    put_u32(payload + HEADER + 4, at->tick);
    port_send(frame, frame_make(payload, (uint16_t)(end - payload), frame));
}

/* The newest sample as things stand now; a host that asks in this session is alive. */
static sample_t latest(bool alive) {
    uint32_t before = port_lock();
    sample_t copy = now;
    copy.mode = mode;
    copy.faults = faults;
    if (mode == ARMED && alive) silence = 0;
    port_unlock(before);
    return copy;
}

void rig_poll(void) {
    if (!due) return;
    uint32_t before = port_lock();
    sample_t sample = now;
    uint8_t sequence = awaited_sequence;
    due = false;
    port_unlock(before);
    reply(EXCHANGE, sequence, DONE, &sample, put_sample(payload + BODY, &sample));
}

bool rig_waiting(void) { return awaited; }
enum mode rig_mode(void) { return mode; }

/* Never wider than the board was compiled for. */
static void hold_to_ceilings(limits_t *offered) {
    static const uint32_t travel[CHANNELS] = {CEILING_TRAVEL_1, CEILING_TRAVEL_2};
    static const uint32_t speed[CHANNELS] = {CEILING_SPEED_1, CEILING_SPEED_2};
    int16_t command = (int16_t)((int32_t)port_steps * CEILING_COMMAND / 100 - (CEILING_COMMAND == 100));
    for (uint8_t i = 0; i < CHANNELS; i++) {
        if (offered->travel[i] > travel[i]) offered->travel[i] = travel[i];
        if (offered->speed[i] > speed[i]) offered->speed[i] = speed[i];
    }
    if (offered->saturation > CEILING_SATURATION) offered->saturation = CEILING_SATURATION;
    if (offered->command > command) offered->command = command;
}

static uint8_t configure(const uint8_t *b) {
    limits_t offered;
    uint32_t *numbers[] = {offered.travel, offered.speed, offered.start, offered.frozen};
    for (uint8_t part = 0; part < 4; part++)
        for (uint8_t i = 0; i < CHANNELS; i++, b += 4) {
            numbers[part][i] = get_u32(b);
            if (numbers[part][i] > NO_LIMIT) return WRONG_VALUE;
        }
    offered.twist = get_u32(b);
    offered.saturation = get_u32(b + 4);
    offered.watchdog = get_u16(b + 8);
    offered.command = (int16_t)get_u16(b + 10);
    if (!offered.watchdog || offered.watchdog > CEILING_WATCHDOG || !offered.saturation) return WRONG_VALUE;
    if (offered.command <= 0 || offered.command > (int32_t)port_steps || offered.twist > NO_LIMIT) return WRONG_VALUE;
    hold_to_ceilings(&offered);
    uint32_t before = port_lock();
    limits = offered;
    configured = true;
    port_unlock(before);
    return DONE;
}

static uint8_t *put_limits(uint8_t *b) {
    const uint32_t *numbers[] = {limits.travel, limits.speed, limits.start, limits.frozen};
    for (uint8_t part = 0; part < 4; part++)
        for (uint8_t i = 0; i < CHANNELS; i++, b += 4) put_u32(b, numbers[part][i]);
    put_u32(b, limits.twist);
    put_u32(b + 4, limits.saturation);
    put_u16(b + 8, limits.watchdog);
    put_u16(b + 10, (uint16_t)limits.command);
    return b + 12;
}

static uint8_t arm(void) {
    if (!configured) return NOT_CONFIGURED;
    port_command(0);
    while (!port_settled()) {} /* the power stage is on after that */
    uint32_t before = port_lock();
    bool off = false;
    for (uint8_t i = 0; i < CHANNELS; i++) off |= beyond(size_of(now.q[i]), limits.start[i]);
    if (off) {
        trip(F_START);
    } else {
        silence = saturated = 0;
        braking = 0;
        asked = output = 0;
        reference = 0;
        memset(travelled_alone, 0, sizeof travelled_alone);
        port_enable(true);
        mode = ARMED;
    }
    port_unlock(before);
    return off ? OFF_START : DONE;
}

/* A tick may have stopped the rig since it was found to be armed. */
static uint8_t start(enum mode whose) {
    uint32_t before = port_lock();
    bool armed = mode == ARMED;
    if (armed) {
        silence = until_law = 0;
        pulse_left = 0;
        put_out(0);
        law_start();
        mode = whose;
    }
    port_unlock(before);
    return armed ? DONE : FAULTED;
}

static uint8_t self_test(const uint8_t *b) {
    int16_t height = (int16_t)get_u16(b);
    uint16_t ticks = get_u16(b + 2);
    if (size_of(height) > (uint32_t)limits.command || !ticks) return WRONG_VALUE;
    if ((uint32_t)ticks * port_period > LONGEST_PULSE) return WRONG_VALUE;
    uint32_t before = port_lock();
    bool armed = mode == ARMED;
    if (armed) {
        pulse = height;
        pulse_left = ticks + 1;
        silence = 0; /* of the patience that an armed rig had until now */
    }
    port_unlock(before);
    return armed ? DONE : FAULTED;
}

static uint8_t take_law(const uint8_t *b) {
    has_law = law_take(&law, b, limits.command); /* no lock: the tick looks at it in MCU only */
    if (has_law) return DONE;
    uint32_t before = port_lock();
    trip(F_GAINS);
    port_unlock(before);
    return WRONG_VALUE;
}

/* A command for a sample that is older than the watchdog's time, or of another session, has waited in a buffer on its
 * way: stopping is safer than to follow it. */
static void exchange(uint8_t sequence, bool current, const uint8_t *b) {
    float offered = get_float(b);
    uint32_t answered = get_u32(b + 4);
    bool sound = sane(offered);
    /* before the lock, under which no edge of an encoder is heard */
    int32_t steps = sound ? (int32_t)offered : 0;
    if (size_of(steps) > INT16_MAX) steps = steps < 0 ? -INT16_MAX : INT16_MAX;
    uint32_t before = port_lock();
    if (running() && (!current || now.tick - answered > limits.watchdog)) trip(F_STALE);
    if (running() && !sound) trip(F_GAINS);
    if (mode == HOST) put_out((int16_t)steps);
    if (mode == MCU) reference = offered;
    if (current) silence = 0;
    awaited = true;
    awaited_sequence = sequence;
    port_unlock(before);
}

static bool allowed(uint8_t kind) {
    switch (kind) {
    case CONFIGURE:
    case ZERO:
    case ARM: return mode == IDLE;
    case LAW:
    case SELF_TEST:
    case START: return mode == ARMED;
    case CLEAR: return mode == IDLE || mode == FAULT;
    default: return true;
    }
}

#define GREETING_BYTES 5
static const uint8_t length_of[] = {
    [HELLO] = GREETING_BYTES, [CONFIGURE] = LIMITS_BYTES, [ZERO] = 0, [SELF_TEST] = 4, [ARM] = 0, [START] = 1, [EXCHANGE] = 8,
    [STOP] = 0, [ESTOP] = 0, [CLEAR] = 0, [LAW] = LAW_BYTES, [SNAPSHOT] = 0,
};

/* A number for a new host that no frame of an earlier one names, whatever it says for its own. */
static uint16_t fresh(uint32_t nonce) {
    uint8_t mixed[12];
    put_u32(mixed, nonce);
    put_u32(mixed + 4, session ^ port_boot());
    put_u32(mixed + 8, now.tick);
    uint32_t number = crc32_of(mixed, sizeof mixed);
    return (uint16_t)(number ^ number >> 16);
}

/* Whoever stops the rig, or looks at it, needs no number. */
static bool of_any_session(uint8_t kind) { return kind == HELLO || kind == STOP || kind == ESTOP || kind == SNAPSHOT; }

static uint8_t perform(uint8_t kind, const uint8_t *b) {
    switch (kind) {
    case CONFIGURE: return configure(b);
    case ARM: return arm();
    case SELF_TEST: return self_test(b);
    case LAW: return take_law(b);
    case START:
        if (b[0] != HOST && b[0] != MCU) return WRONG_VALUE;
        if (b[0] == MCU && !has_law) return NOT_CONFIGURED;
        return start((enum mode)b[0]);
    }
    uint32_t before = port_lock();
    switch (kind) {
    case HELLO: /* of a new host: whatever the one before it was at is over, its word to stop as well */
        power_off(FAULT);
        faults = (faults & ~F_STOP) | F_RESET;
        configured = has_law = false;
        session = fresh(get_u32(b + 1));
        answer_every = b[0] ? b[0] : 1;
        answer_at = now.tick - now.tick % answer_every + answer_every;
        break;
    case ZERO:
        for (uint8_t i = 0; i < CHANNELS; i++) {
            zero[i] = port_counts(i);
            now.q[i] = 0;
        }
        break;
    case STOP: power_off(mode == FAULT ? FAULT : IDLE); break;
    case ESTOP: trip(F_STOP); break;
    case CLEAR:
        faults = 0;
        mode = IDLE;
        break;
    }
    port_unlock(before);
    return DONE;
}

static uint8_t *put_answer(uint8_t kind, uint8_t *b) {
    switch (kind) {
    case HELLO: {
        uint8_t n = (uint8_t)strlen(port_name);
        b[0] = PROTOCOL;
        b[1] = port_virtual;
        b[2] = CHANNELS;
        b[3] = SPEED_WINDOW;
        b[4] = port_reset_cause();
        put_u16(b + 5, port_period);
        put_u16(b + 7, port_steps);
        put_u32(b + 9, last_nonce); /* that this answers what was asked now */
        memcpy(b + 13, port_name, n);
        return b + 13 + n;
    }
    case CONFIGURE: return put_limits(b);
    case LAW: law_give(&law, b); return b + LAW_BYTES;
    case SNAPSHOT: {
        uint32_t before = port_lock();
        snapshot_t first = snapshot;
        port_unlock(before);
        b[0] = first.mode;
        put_u16(b + 1, first.sample.faults);
        put_u32(b + 3, first.sample.tick);
        b = put_sample(b + 7, &first.sample);
        for (uint8_t i = 0; i < CHANNELS; i++, b += 4) put_u32(b, (uint32_t)first.moved[i]);
        put_u16(b, (uint16_t)first.command);
        put_u16(b + 2, lost);
        put_u16(b + 4, receiver.dropped);
        return b + 6;
    }
    }
    return b;
}

/* What is done counts the session on, and so does a fault: what was asked once, and lies in a buffer or is sent again
 * by somebody, is of another session and not done again. */
static uint8_t perform_once(uint8_t kind, const uint8_t *b) {
    uint8_t result = perform(kind, b);
    uint32_t before = port_lock();
    if (result == DONE && kind != SNAPSHOT && kind != HELLO) session++;
    port_unlock(before);
    return result;
}

/* Not inlined: a byte from the wire must not save all the registers that a whole frame needs. */
__attribute__((noinline)) static void answer(const uint8_t *request, uint16_t n) {
    uint8_t kind = request[0], sequence = request[1], result;
    bool current = get_u16(request + 2) == session_now();
    /* A host that missed the reply asks again by the same number: it is told once more, but nothing is done twice. */
    bool again = kind == last_kind && sequence == last_sequence && kind != EXCHANGE;
    if (kind == HELLO && n == HEADER + GREETING_BYTES) {
        again &= get_u32(request + HEADER + 1) == last_nonce;
        last_nonce = get_u32(request + HEADER + 1);
    }
    if (again) {
        result = last_result;
    } else if (kind == 0 || kind >= sizeof length_of) {
        result = UNKNOWN;
    } else if (n - HEADER != length_of[kind]) {
        result = WRONG_LENGTH;
    } else if (!allowed(kind)) {
        result = mode == FAULT ? FAULTED : WRONG_MODE;
    } else if (kind == EXCHANGE) {
        exchange(sequence, current, request + HEADER);
        last_kind = kind;
        return; /* answered by the tick that follows it */
    } else if (!current && !of_any_session(kind)) {
        sample_t at = latest(false);
        reply(kind, sequence, WRONG_SESSION, &at, payload + BODY);
        return; /* nor does it take the place of what was asked last */
    } else {
        result = perform_once(kind, request + HEADER);
    }
    last_kind = kind;
    last_sequence = sequence;
    last_result = result;
    sample_t at = latest(current);
    bool told = result == DONE || kind == CONFIGURE || kind == LAW;
    reply(kind, sequence, result, &at, told ? put_answer(kind, payload + BODY) : payload + BODY);
}

void rig_receive(uint8_t byte) {
    uint16_t n = frame_receive(&receiver, byte);
    if (n >= HEADER) answer(receiver.bytes, n);
}

void rig_reset(void) {
    mode = FAULT; /* nothing to brake */
    braking = 0;
    power_off(FAULT);
    faults = F_RESET;
    memset(&now, 0, sizeof now);
    memset(&snapshot, 0, sizeof snapshot);
    memset(&limits, 0, sizeof limits);
    memset(&receiver, 0, sizeof receiver);
    memset(travelled_alone, 0, sizeof travelled_alone);
    configured = has_law = awaited = due = overran = false;
    last_kind = 0;
    lost = 0;
    answer_every = 1;
    answer_at = 0;
    illegal = port_illegal();
    for (uint8_t i = 0; i < CHANNELS; i++) {
        zero[i] = port_counts(i);
        for (uint8_t k = 0; k < SPEED_WINDOW; k++) past[k][i] = zero[i];
    }
    frame_prepare();
}

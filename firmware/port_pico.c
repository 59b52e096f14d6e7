/* Raspberry Pi Pico (RP2040 at 125 MHz): a tick of 1 kHz, two encoders, an H-bridge by PWM of 20 kHz in 6250 steps, the
 * host at 1 Mbaud through an adapter. pins_pico.h has the wires. Registers by their addresses in the RP2040's data sheet.
 *
 * Its watchdog counts the crystal's microseconds in hardware of its own; a crystal that stops, stops it as well. */
#include "drive.h"
#include "pins_pico.h"
#include "port.h"
#include "rig.h"

#if DRIVE == DRIVE_ANALOG
#error "a Pico drives an H-bridge: DRIVE_PAIR or DRIVE_SIGN"
#endif

#define CLOCK 125000000UL
#define PERIOD_US 1000
#define PWM_STEPS 6250 /* 20 kHz */
#define WATCHDOG_US 15000
#define BLINK_TICKS 256 /* a power of two */

const char port_name[] = "upright firmware, RP2040, " DRIVE_NAME;
bool port_virtual = false;
const uint16_t port_period = PERIOD_US;
const uint16_t port_steps = PWM_STEPS;

#define AT(address) (*(volatile uint32_t *)(address))
#define CLEARING 0x3000 /* to a register's address: writes clear bits */
#define RESETS 0x4000C000
#define RESET_DONE (RESETS + 8)
enum { R_IO = 1 << 5, R_PADS = 1 << 8, R_PLL = 1 << 12, R_PWM = 1 << 14, R_TIMER = 1 << 21, R_UART = 1 << 22 };
#define CLOCKS 0x40008000
#define XOSC 0x40024000
#define PLL 0x40028000
#define WATCHDOG 0x40058000
#define RESET_BY_WATCHDOG 0x40010008 /* PSM_WDSEL */
#define ALL_BUT_OSCILLATORS 0x1FFFC
#define TIMER 0x40054000
enum { ALARM0 = 0x10, TIMER_NOW = 0x28, TIMER_RAISED = 0x34, TIMER_INTERRUPTS = 0x38 };
#define IO 0x40014000
#define PADS 0x4001C000
enum { PAD_INPUT = 1 << 6, PAD_UP = 1 << 3, PAD_SCHMITT = 1 << 1 };
enum { BY_UART = 2, BY_PWM = 4, BY_PROGRAM = 5 };
#define SIO 0xD0000000
enum { PINS_IN = 4, PINS_HIGH = 0x14, PINS_LOW = 0x18, PINS_TOGGLE = 0x1C, PINS_OUT = 0x24 };
#define SLICE 0x40050000 /* of PWM, number 0: GP16 is its A, GP17 its B */
enum { SLICE_CONTROL, SLICE_DIVIDER = 4, SLICE_COUNTER = 8, SLICE_LEVELS = 12, SLICE_TOP = 16 };
#define UART 0x40034000
enum { U_DATA, U_FLAGS = 0x18, U_WHOLE = 0x24, U_PART = 0x28, U_LINE = 0x2C, U_CONTROL = 0x30, U_INTERRUPTS = 0x38, U_CLEAR = 0x44 };
enum { U_EMPTY = 1 << 4, U_FULL = 1 << 5, U_RECEIVED = 1 << 4, U_PAUSED = 1 << 6 };
#define NVIC_ENABLE 0xE000E100
#define NVIC_PRIORITIES 0xE000E400
enum { IRQ_TIMER = 0, IRQ_IO = 13, IRQ_UART = 20 };

static void hand_to(int pin, uint32_t who) { AT(IO + 8 * pin + 4) = who; }

/* The bridge. */

#if DRIVE == DRIVE_PAIR
static const int bridge[] = {FORWARD, REVERSE};
#define OTHERS 0
#else
static const int bridge[] = {PWM};
#define OTHERS (1UL << SIDE_A | 1UL << SIDE_B)
#endif
enum { BRIDGE_PINS = sizeof bridge / sizeof bridge[0] };

static void rest(void) { /* at once: pins of the program's own, which are low */
    for (int i = 0; i < BRIDGE_PINS; i++) hand_to(bridge[i], BY_PROGRAM);
    AT(SIO + PINS_LOW) = OTHERS;
}

void port_command(int16_t steps) {
    static int16_t last;
    if (steps > PWM_STEPS) steps = PWM_STEPS;
    if (steps < -PWM_STEPS) steps = -PWM_STEPS;
    uint32_t before = port_lock();
    bool turns = !steps || (steps > 0) != (last > 0) || (steps < 0) != (last < 0);
    uint32_t size = (uint32_t)(steps < 0 ? -steps : steps);
    if (turns) rest();
#if DRIVE == DRIVE_PAIR
    AT(SLICE + SLICE_LEVELS) = steps > 0 ? size : size << 16;
    int pin = steps > 0 ? FORWARD : REVERSE;
#else
    AT(SLICE + SLICE_LEVELS) = size;
    if (turns && steps) AT(SIO + PINS_HIGH) = 1UL << (steps > 0 ? SIDE_A : SIDE_B);
    int pin = PWM;
#endif
    if (turns && steps) {
        AT(SLICE + SLICE_COUNTER) = PWM_STEPS - 1; /* a period begins, and with it the new levels */
        hand_to(pin, BY_PWM);
    }
    last = steps;
    port_unlock(before);
}

bool port_settled(void) { return true; } /* pins are low before the call ends */

void port_enable(bool on) { AT(SIO + (on ? PINS_HIGH : PINS_LOW)) = 1UL << POWER_STAGE; }

/* Encoders: x4 decoding, an interrupt for each edge. */

#define FIRST ENCODER_1_A
_Static_assert(ENCODER_1_B == FIRST + 1 && ENCODER_2_A == FIRST + 2 && ENCODER_2_B == FIRST + 3 && FIRST < 5,
               "four pins in a row, of the first 8");
enum { ILLEGAL = 2 };
static const int8_t quadrature[16] = {0, 1, -1, ILLEGAL, -1, 0, ILLEGAL, 1, 1, ILLEGAL, 0, -1, ILLEGAL, -1, 1, 0};
static volatile uint32_t encoder_counts[CHANNELS];
static volatile uint16_t illegal;
static uint8_t phases;
#define EDGES 0xCCCC /* rising and falling of four pins */

static uint8_t read_phases(void) { return AT(SIO + PINS_IN) >> FIRST & 15; }

static void on_edge(void) {
    AT(IO + 0xF0) = (uint32_t)EDGES << 4 * FIRST;
    uint8_t now = read_phases(), before = phases;
    phases = now;
    for (int i = 0; i < CHANNELS; i++, now >>= 2, before >>= 2) {
        int8_t step = quadrature[(before & 3) << 2 | (now & 3)];
        if (step == ILLEGAL) illegal++;
        else encoder_counts[i] += (uint32_t)(int32_t)step;
    }
}

uint32_t port_counts(uint8_t channel) { return encoder_counts[channel]; }
uint16_t port_illegal(void) { return illegal; }

/* The host. */

static volatile uint8_t received[256], received_to, received_from;

static void on_byte(void) {
    while (!(AT(UART + U_FLAGS) & U_EMPTY)) received[received_to++] = (uint8_t)AT(UART + U_DATA);
    AT(UART + U_CLEAR) = U_RECEIVED | U_PAUSED;
}

void port_send(const uint8_t *bytes, uint16_t n) {
    while (n--) {
        while (AT(UART + U_FLAGS) & U_FULL) {}
        AT(UART + U_DATA) = *bytes++;
    }
}

/* Time. */

static uint8_t reset_cause;
static volatile uint32_t tick;
static uint32_t due, boot;
static volatile bool ticking;

uint8_t port_reset_cause(void) { return reset_cause; }
uint32_t port_boot(void) { return boot; }

uint32_t port_lock(void) {
    uint32_t before;
    __asm__ volatile("mrs %0, primask\n cpsid i" : "=r"(before)::"memory");
    return before;
}

void port_unlock(uint32_t before) { __asm__ volatile("msr primask, %0" ::"r"(before) : "memory"); }

static void feed_watchdog(void) { AT(WATCHDOG + 4) = 2 * WATCHDOG_US; } /* counts two a microsecond: erratum E1 */

/* Of the lowest priority, so that encoders and the wire interrupt it; fed by ticks that come to their end. Of ticks that
 * came due meanwhile the core sees the gap. */
static void on_tick(void) {
    AT(TIMER + TIMER_RAISED) = 1;
    int32_t late = (int32_t)(AT(TIMER + TIMER_NOW) - due);
    for (; late >= PERIOD_US; late -= PERIOD_US) due += PERIOD_US, tick++;
    if (late < 0) late = 0;
    due += PERIOD_US;
    AT(TIMER + ALARM0) = due;
    rig_tick(++tick, (uint16_t)late);
    if ((int32_t)(AT(TIMER + TIMER_NOW) - due) >= 0) { /* it has passed while this one was at work */
        rig_overrun();
        AT(TIMER + ALARM0) = (due = AT(TIMER + TIMER_NOW) + PERIOD_US);
    }
    enum mode mode = rig_mode();
    if (mode == FAULT) {
        if (!(tick & (BLINK_TICKS - 1))) AT(SIO + PINS_TOGGLE) = 1UL << LED;
    } else AT(SIO + (mode == IDLE ? PINS_LOW : PINS_HIGH)) = 1UL << LED;
    feed_watchdog();
}

extern uint32_t data_start, data_end, data_load, bss_start, bss_end, stack_top;
int main(void);

static void reset(void) {
    for (uint32_t *from = &data_load, *to = &data_start; to < &data_end;) *to++ = *from++;
    for (uint32_t *to = &bss_start; to < &bss_end;) *to++ = 0;
    main();
}

static void fail(void) { /* until the watchdog */
    rest();
    port_enable(false);
    for (;;) {}
}

__attribute__((section(".vectors"), used)) static void (*const vectors[16 + 26])(void) = {
    (void (*)(void)) & stack_top, reset, fail, fail, 0, 0, 0, 0, 0, 0, 0, fail, 0, 0, fail, fail,
    [16 + IRQ_TIMER] = on_tick, [16 + IRQ_IO] = on_edge, [16 + IRQ_UART] = on_byte,
};

static void start_clocks(void) {
    AT(XOSC + 12) = 47; /* 1 ms until the crystal of 12 MHz is taken */
    AT(XOSC) = 0xFABAA0;
    while (!(AT(XOSC + 4) >> 31)) {}
    AT(CLOCKS + 0x30) = 2; /* reference: the crystal */
    while (!(AT(CLOCKS + 0x38) & 1 << 2)) {}
    AT(PLL + 0) = 1;
    AT(PLL + 8) = 125; /* 12 MHz * 125 / 6 / 2 */
    AT(PLL + 4 + CLEARING) = 1 << 5 | 1;
    while (!(AT(PLL) >> 31)) {}
    AT(PLL + 12) = 6UL << 16 | 2UL << 12;
    AT(PLL + 4 + CLEARING) = 1 << 3;
    AT(CLOCKS + 0x3C) = 0; /* processor: the reference while its other source is chosen, then that */
    AT(CLOCKS + 0x3C) = 1;
    while (!(AT(CLOCKS + 0x44) & 1 << 1)) {}
    AT(CLOCKS + 0x48) = 1 << 11; /* peripherals: as the processor */
    AT(WATCHDOG + 0x2C) = 1 << 9 | 12; /* a microsecond of timer and watchdog */
}

static void wake(uint32_t parts) {
    AT(RESETS + CLEARING) = parts;
    while ((AT(RESET_DONE) & parts) != parts) {}
}

int main(void) {
    wake(R_IO | R_PADS);
    AT(SIO + PINS_LOW) = 1UL << POWER_STAGE | 1UL << LED | OTHERS;
    for (int i = 0; i < BRIDGE_PINS; i++) AT(SIO + PINS_LOW) = 1UL << bridge[i], AT(SIO + PINS_OUT) = 1UL << bridge[i];
    AT(SIO + PINS_OUT) = 1UL << POWER_STAGE | 1UL << LED | OTHERS;
    rest();
    hand_to(POWER_STAGE, BY_PROGRAM);
    hand_to(LED, BY_PROGRAM);
#if DRIVE == DRIVE_SIGN
    hand_to(SIDE_A, BY_PROGRAM);
    hand_to(SIDE_B, BY_PROGRAM);
#endif
    reset_cause = (uint8_t)AT(WATCHDOG + 8);
    wake(R_PLL);
    start_clocks();
    wake(R_PWM | R_TIMER | R_UART);
    for (int i = 0; i < 32; i++) boot = boot << 1 | (AT(0x4006001C) & 1); /* random bits of the ring oscillator */
    boot ^= AT(TIMER + TIMER_NOW);
    for (int pin = FIRST; pin < FIRST + 4; pin++) {
        AT(PADS + 4 + 4 * pin) = PAD_INPUT | PAD_UP | PAD_SCHMITT;
        hand_to(pin, BY_PROGRAM);
    }
    phases = read_phases();
    AT(IO + 0x100) = (uint32_t)EDGES << 4 * FIRST;
    AT(SLICE + SLICE_DIVIDER) = 1 << 4;
    AT(SLICE + SLICE_TOP) = PWM_STEPS - 1;
    AT(SLICE + SLICE_CONTROL) = 1;
    hand_to(HOST_TX, BY_UART);
    hand_to(HOST_RX, BY_UART);
    AT(UART + U_WHOLE) = 7; /* 125 MHz / 16 / (7 + 52/64) */
    AT(UART + U_PART) = 52;
    AT(UART + U_LINE) = 3 << 5 | 1 << 4;
    AT(UART + U_CONTROL) = 0x301;
    AT(UART + U_INTERRUPTS) = U_RECEIVED | U_PAUSED;
    rig_reset();
    AT(NVIC_PRIORITIES) = 0xC0; /* the tick is the least */
    AT(RESET_BY_WATCHDOG) = ALL_BUT_OSCILLATORS;
    feed_watchdog();
    AT(WATCHDOG) = 1UL << 30;
    due = AT(TIMER + TIMER_NOW) + PERIOD_US;
    AT(TIMER + TIMER_INTERRUPTS) = 1;
    AT(TIMER + ALARM0) = due;
    AT(NVIC_ENABLE) = 1UL << IRQ_TIMER | 1UL << IRQ_IO | 1UL << IRQ_UART;
    for (;;) {
        uint32_t seen = tick;
        while (received_from != received_to) rig_receive(received[received_from++]);
        rig_poll();
        uint32_t before = port_lock(); /* what comes from here on wakes it */
        if (seen == tick && received_from == received_to) __asm__ volatile("wfi");
        port_unlock(before);
    }
}

/* Cortex-M3 as QEMU's mps2-an385 has it: that the core builds, starts and answers there. A port to a real board begins
 * here: encoders, converter and enable line are numbers in memory, the host is UART 0, the tick is SysTick.
 *
 *     qemu-system-arm -M mps2-an385 -nographic -monitor none -serial pty -kernel build/cortexm.elf */
#include "port.h"
#include "rig.h"

#define CLOCK 25000000UL
#define PERIOD_US 1000

const char port_name[] = "upright firmware, Cortex-M3";
bool port_virtual = false;
const uint16_t port_period = PERIOD_US;
const uint16_t port_steps = 32768;

typedef volatile uint32_t register_t;
#define UART ((register_t *)0x40004000)
enum { DATA, STATE, CONTROL, INTERRUPTS, DIVIDER }; /* registers of CMSDK's UART */
enum { TX_FULL = 1, RX_FULL = 2, TX_ENABLE = 1, RX_ENABLE = 2, RX_INTERRUPT = 8 };
#define SYSTICK ((register_t *)0xE000E010)
#define NVIC_ENABLE (*(register_t *)0xE000E100)

volatile uint32_t encoder_counts[CHANNELS];
volatile int16_t converter;
volatile bool power;
static volatile uint8_t received[256], received_to, received_from;
static uint32_t tick;

extern uint32_t data_start, data_end, data_load, bss_start, bss_end, stack_top;
int main(void);

static void reset(void) {
    for (uint32_t *from = &data_load, *to = &data_start; to < &data_end;) *to++ = *from++;
    for (uint32_t *to = &bss_start; to < &bss_end;) *to++ = 0;
    main();
}

static void fail(void) {
    power = false;
    for (;;) {}
}

static void on_byte(void) {
    UART[INTERRUPTS] = RX_FULL;
    while (UART[STATE] & RX_FULL) received[received_to++] = (uint8_t)UART[DATA];
}

static void on_tick(void) { rig_tick(++tick, 0); }

__attribute__((section(".vectors"), used)) static void (*const vectors[])(void) = {
    (void (*)(void)) & stack_top, reset, fail, fail, fail, fail, fail, 0, 0, 0, 0, fail, fail, 0, fail, on_tick,
    on_byte,
};

uint32_t port_counts(uint8_t channel) { return encoder_counts[channel]; }
uint16_t port_illegal(void) { return 0; }
void port_command(int16_t steps) { converter = steps; }
bool port_settled(void) { return true; }
void port_enable(bool on) { power = on; }
uint8_t port_reset_cause(void) { return 0; }
uint32_t port_boot(void) { return 0; }

void port_send(const uint8_t *bytes, uint16_t n) {
    while (n--) {
        while (UART[STATE] & TX_FULL) {}
        UART[DATA] = *bytes++;
    }
}

uint32_t port_lock(void) {
    uint32_t before;
    __asm__ volatile("mrs %0, primask\n cpsid i" : "=r"(before)::"memory");
    return before;
}

void port_unlock(uint32_t before) { __asm__ volatile("msr primask, %0" ::"r"(before) : "memory"); }

int main(void) {
    UART[DIVIDER] = 25;
    UART[CONTROL] = TX_ENABLE | RX_ENABLE | RX_INTERRUPT;
    rig_reset();
    NVIC_ENABLE = 1;
    SYSTICK[1] = CLOCK / (1000000UL / PERIOD_US) - 1;
    SYSTICK[2] = 0;
    SYSTICK[0] = 7; /* processor's clock, interrupt, on */
    for (;;) {
        while (received_from != received_to) rig_receive(received[received_from++]);
        rig_poll();
        __asm__ volatile("wfi");
    }
}

/* Arduino Mega 2560 at 16 MHz: a tick of 1 kHz, two encoders, the host at 1 Mbaud; drive_analog.c or drive_pwm.c puts
 * the command out. pins_atmega2560.h has the wires.
 *
 * The power stage's line needs a resistor to ground: pins float during a reset. docs/tutorials/own_rig.md has the wiring. */
#ifndef __AVR_ATmega2560__
#error "An Uno-class board (ATmega328P, 32U4) has 2 kB of memory, of which frames and limits alone take most, pin-change \
interrupts on ports that Arduino spreads, and no third timer for PWM: take a Mega 2560 or a Pico."
#endif
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "drive.h"
#include "pins_atmega2560.h"
#include "port.h"
#include "rig.h"

#define BAUD 1000000UL
#define PERIOD_US 1000
#define TIMER_DIVIDER 8
#define BLINK_TICKS 256 /* a power of two */

const char port_name[] = "upright firmware, ATmega2560, " DRIVE_NAME;
bool port_virtual = false;
const uint16_t port_period = PERIOD_US;

/* Encoders: x4 decoding in one interrupt for both. */

#define ENCODER_PINS 0xF0
_Static_assert(BIT(ENCODER_1_A) == 4 && BIT(ENCODER_1_B) == 5 && BIT(ENCODER_2_A) == 6 && BIT(ENCODER_2_B) == 7,
               "one interrupt reads the upper half of a port");
static uint8_t read_phases(void) { return PINB >> 4; }
enum { ILLEGAL = 2 };
static const int8_t quadrature[16] = {0, 1, -1, ILLEGAL, -1, 0, ILLEGAL, 1, 1, ILLEGAL, 0, -1, ILLEGAL, -1, 1, 0};
volatile uint32_t encoder_counts[CHANNELS]; /* found by name by simrig.c */
static volatile uint16_t illegal;
static uint8_t phases;

ISR(PCINT0_vect) {
    uint8_t now = read_phases(), before = phases;
    phases = now;
    if ((now ^ before) & 3) {
        int8_t step = quadrature[(before & 3) << 2 | (now & 3)];
        if (step == ILLEGAL) illegal++;
        else if (step > 0) encoder_counts[0]++;
        else encoder_counts[0]--;
    }
    if ((now ^ before) & 12) {
        int8_t step = quadrature[(before & 12) | now >> 2];
        if (step == ILLEGAL) illegal++;
        else if (step > 0) encoder_counts[1]++;
        else encoder_counts[1]--;
    }
}

uint32_t port_counts(uint8_t channel) {
    uint32_t before = port_lock(), counts = encoder_counts[channel];
    port_unlock(before);
    return counts;
}

uint16_t port_illegal(void) {
    uint32_t before = port_lock();
    uint16_t so_far = illegal;
    port_unlock(before);
    return so_far;
}

/* The power stage; in FAULT and IDLE it is switched off again at every tick. */

void port_enable(bool on) {
    if (on) HIGH(POWER_STAGE);
    else LOW(POWER_STAGE);
}

static void show(uint32_t tick) {
    static enum mode shown = FAULT;
    enum mode mode = rig_mode();
    if (mode == FAULT) {
        if (!(tick & (BLINK_TICKS - 1))) TOGGLE(LED);
    } else if (mode != shown) {
        if (mode == IDLE) LOW(LED);
        else HIGH(LED);
    }
    shown = mode;
}

/* The host. */

#define RING 256 /* indices are bytes and run over by themselves */
static volatile uint8_t received[RING], received_to, to_send[RING], send_to;
static volatile uint8_t received_from, send_from;

ISR(USART0_RX_vect) {
    received[received_to] = UDR0;
    received_to++; /* a host that sends faster than frames are read loses one, by its CRC */
}

ISR(USART0_UDRE_vect) {
    if (send_from == send_to) UCSR0B &= (uint8_t)~_BV(UDRIE0);
    else UDR0 = to_send[send_from++];
}

void port_send(const uint8_t *bytes, uint16_t n) {
    while (n--) {
        uint8_t next = (uint8_t)(send_to + 1);
        while (next == send_from) {}
        to_send[send_to] = *bytes++;
        send_to = next;
        UCSR0B |= _BV(UDRIE0);
    }
}

/* Time. */

static uint8_t reset_cause;
static uint32_t boot __attribute__((section(".noinit")));
static uint32_t tick;
static volatile bool ticking;

uint32_t port_lock(void) {
    uint8_t before = SREG;
    cli();
    return before;
}

void port_unlock(uint32_t before) {
    __asm__ volatile("" ::: "memory");
    SREG = (uint8_t)before;
}

uint8_t port_reset_cause(void) { return reset_cause; }
uint32_t port_boot(void) { return boot; }

/* The tick lets encoders and the wire interrupt it; what it may not do is to interrupt itself. The watchdog is fed by
 * ticks that come to their end. */
ISR(TIMER1_COMPA_vect) {
    tick++;
    if (ticking) {
        rig_overrun();
        return;
    }
    ticking = true;
    uint16_t late = TCNT1 / (F_CPU / 1000000UL / TIMER_DIVIDER);
    sei();
    rig_tick(tick, late);
    cli();
    show(tick);
    wdt_reset();
    ticking = false;
}

/* Before main: a watchdog that has just reset the processor still runs. */
static uint8_t cause_at_reset __attribute__((section(".noinit")));
void before_main(void) __attribute__((naked, used, section(".init3")));
void before_main(void) {
    OUTPUT(POWER_STAGE); /* low, as every output is by now */
    cause_at_reset = MCUSR;
    MCUSR = 0;
    wdt_disable();
    /* what memory holds before it is cleared: noise of its cells when power comes, the last run's numbers otherwise; in
     * 1 ms, as two sums of every fourth word */
    uint16_t sum = (uint16_t)boot + 1, sums = (uint16_t)(boot >> 16);
    for (const uint16_t *at = (const uint16_t *)RAMSTART; at < (const uint16_t *)(RAMEND - 1); at += 4) {
        sum += *at;
        sums += sum;
    }
    boot = (uint32_t)sums << 16 | sum;
}

int main(void) {
    reset_cause = cause_at_reset;
    OUTPUT(LED);
    drive_prepare();
    UCSR0A = _BV(U2X0);
    UBRR0 = F_CPU / 8 / BAUD - 1;
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
    PCMSK0 = ENCODER_PINS;
    PCICR = _BV(PCIE0);
    phases = read_phases();
    rig_reset();
    TCCR1B = _BV(WGM12) | _BV(CS11);
    OCR1A = F_CPU / TIMER_DIVIDER / (1000000UL / PERIOD_US) - 1;
    TIMSK1 = _BV(OCIE1A);
    wdt_enable(WDTO_15MS);
    sei();
    for (;;) {
        while (received_from != received_to) {
            uint8_t byte = received[received_from];
            received_from++;
            rig_receive(byte);
        }
        rig_poll();
    }
}

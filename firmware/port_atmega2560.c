/* Arduino Mega 2560 at 16 MHz: a tick of 1 kHz, two encoders, a 16-bit converter of +-10 V, the host at 1 Mbaud.
 *
 *     PB4, PB5 (10, 11)   encoder 1, A and B      PB1, PB2 (52, 51)   SCLK, SDI of an AD5761R
 *     PB6, PB7 (12, 13)   encoder 2, A and B      PB0 (53)            its SYNC
 *     PG5 (4)             power stage, high on    PE0, PE1 (0, 1)     host, through the board's USB
 *     PH3 (6)             LED: on while the power stage is, blinking in FAULT
 *
 * The power stage's line needs a resistor to ground: pins float during a reset. docs/firmware.md has the wiring. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "port.h"
#include "rig.h"

#define BAUD 1000000UL
#define PERIOD_US 1000
#define TIMER_DIVIDER 8
#define BLINK_TICKS 256 /* a power of two */

const char port_name[] = "upright firmware, ATmega2560";
bool port_virtual = false;
const uint16_t port_period = PERIOD_US;
const uint16_t port_steps = 32768;

/* Encoders: x4 decoding in one interrupt for both. */

#define ENCODER_PINS 0xF0
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

/* The converter: frames of 24 bits, of which the first byte is the register. */

#define WRITE_AND_UPDATE 0x03
#define WRITE_CONTROL 0x04
/* +-10 V, two's complement, internal reference, thermal shutdown on, middle of the range at power-up and CLEAR. */
#define CONTROL 0x02E8

/* One byte an interrupt, so that encoders are heard meanwhile; of commands that come during one the last one counts. */
static volatile int16_t wanted, sending;
static volatile uint8_t bytes_left;
static volatile bool newer;

static void send_command(void) {
    newer = false;
    sending = wanted;
    bytes_left = 3;
    PORTB &= (uint8_t)~_BV(PB0);
    SPDR = WRITE_AND_UPDATE;
}

ISR(SPI_STC_vect) {
    switch (--bytes_left) {
    case 2: SPDR = (uint8_t)((uint16_t)sending >> 8); break;
    case 1: SPDR = (uint8_t)sending; break;
    default:
        PORTB |= _BV(PB0);
        if (newer) send_command();
    }
}

void port_command(int16_t steps) {
    uint32_t before = port_lock();
    wanted = steps;
    if (bytes_left) newer = true;
    else send_command();
    port_unlock(before);
}

static void prepare_converter(void) {
    static const uint8_t bytes[] = {WRITE_CONTROL, CONTROL >> 8, CONTROL & 0xFF};
    SPCR = _BV(SPE) | _BV(MSTR) | _BV(CPHA); /* the converter reads on the falling edge */
    SPSR = _BV(SPI2X);
    PORTB &= (uint8_t)~_BV(PB0);
    for (uint8_t i = 0; i < sizeof bytes; i++) {
        SPDR = bytes[i];
        while (!(SPSR & _BV(SPIF))) {}
    }
    PORTB |= _BV(PB0);
    (void)SPDR; /* clears the flag */
    SPCR |= _BV(SPIE);
}

void port_enable(bool on) {
    if (on) {
        PORTG |= _BV(PG5);
        PORTH |= _BV(PH3);
    } else {
        PORTG &= (uint8_t)~_BV(PG5);
        PORTH &= (uint8_t)~_BV(PH3);
    }
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
    if (rig_mode() == FAULT && !(tick & (BLINK_TICKS - 1))) PINH = _BV(PH3); /* toggles it */
    wdt_reset();
    ticking = false;
}

/* Before main: a watchdog that has just reset the processor still runs. */
static uint8_t cause_at_reset __attribute__((section(".noinit")));
void before_main(void) __attribute__((naked, used, section(".init3")));
void before_main(void) {
    cause_at_reset = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

int main(void) {
    reset_cause = cause_at_reset;
    DDRG |= _BV(PG5);
    DDRH |= _BV(PH3);
    PORTB |= _BV(PB0);
    DDRB |= _BV(PB0) | _BV(PB1) | _BV(PB2);
    prepare_converter();
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

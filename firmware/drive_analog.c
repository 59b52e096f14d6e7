/* An AD5761R on the ATmega2560's SPI: frames of 24 bits, of which the first byte is the register. */
#include "drive.h"
#if DRIVE == DRIVE_ANALOG
#include <avr/interrupt.h>
#include <avr/io.h>

#include "pins_atmega2560.h"
#include "port.h"

#define WRITE_AND_UPDATE 0x03
#define WRITE_CONTROL 0x04
/* +-10 V, two's complement, internal reference, thermal shutdown on, middle of the range at power-up and CLEAR. */
#define CONTROL 0x02E8

const uint16_t port_steps = 32768;

/* One byte an interrupt, so that encoders are heard meanwhile; of commands that come during one the last one counts. */
static volatile int16_t wanted, sending;
static volatile uint8_t bytes_left;
static volatile bool newer;

static void send_command(void) {
    newer = false;
    sending = wanted;
    bytes_left = 3;
    LOW(SYNC);
    SPDR = WRITE_AND_UPDATE;
}

ISR(SPI_STC_vect) {
    switch (--bytes_left) {
    case 2: SPDR = (uint8_t)((uint16_t)sending >> 8); break;
    case 1: SPDR = (uint8_t)sending; break;
    default:
        HIGH(SYNC);
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

bool port_settled(void) { return !bytes_left; }

void drive_prepare(void) {
    static const uint8_t bytes[] = {WRITE_CONTROL, CONTROL >> 8, CONTROL & 0xFF};
    HIGH(SYNC);
    OUTPUT(SYNC);
    OUTPUT(SCLK);
    OUTPUT(SDI);
    SPCR = _BV(SPE) | _BV(MSTR) | _BV(CPHA); /* the converter reads on the falling edge */
    SPSR = _BV(SPI2X);
    LOW(SYNC);
    for (uint8_t i = 0; i < sizeof bytes; i++) {
        SPDR = bytes[i];
        while (!(SPSR & _BV(SPIF))) {}
    }
    HIGH(SYNC);
    (void)SPDR; /* clears the flag */
    SPCR |= _BV(SPIE);
}
#endif

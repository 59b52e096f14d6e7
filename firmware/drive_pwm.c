/* An H-bridge on the ATmega2560's timer 4: 20 kHz, above what is heard, in 800 steps either way. Sign and magnitude: the
 * bridge pushes one way for a part of each period and rests for what is left of it.
 *
 * At zero no timer holds the pins, they are low: whatever the timer does then, the motor gets nothing. */
#include "drive.h"
#if DRIVE == DRIVE_PAIR || DRIVE == DRIVE_SIGN
#include <avr/io.h>

#include "pins_atmega2560.h"
#include "port.h"

#define STEPS 800 /* of 1/16 us */

const uint16_t port_steps = STEPS;

#define FORWARD_ON _BV(COM4B1)  /* OC4B high until its compare match */
#define REVERSE_ON _BV(COM4C1)

void port_command(int16_t steps) {
    uint32_t before = port_lock();
    uint16_t size = (uint16_t)(steps < 0 ? -steps : steps);
    static int8_t side; /* to which it pushes */
    int8_t now = steps > 0 ? 1 : steps < 0 ? -1 : 0;
    if (size > STEPS) size = STEPS;
    if (now != side) TCCR4A = _BV(WGM41); /* off at once, before the other side is on */
    if (size) {
#if DRIVE == DRIVE_PAIR
        if (now > 0) OCR4B = size - 1;
        else OCR4C = size - 1;
        TCCR4A = _BV(WGM41) | (now > 0 ? FORWARD_ON : REVERSE_ON);
#else
        if (now != side) {
            if (now > 0) LOW(SIDE_B), HIGH(SIDE_A);
            else LOW(SIDE_A), HIGH(SIDE_B);
        }
        OCR4B = size - 1;
        TCCR4A = _BV(WGM41) | FORWARD_ON;
#endif
    }
#if DRIVE == DRIVE_SIGN
    else LOW(SIDE_A), LOW(SIDE_B);
#endif
    side = now;
    port_unlock(before);
}

bool port_settled(void) { return true; } /* pins are low before the call ends */

void drive_prepare(void) {
#if DRIVE == DRIVE_PAIR
    LOW(FORWARD), LOW(REVERSE);
    OUTPUT(FORWARD), OUTPUT(REVERSE);
#else
    LOW(PWM), LOW(SIDE_A), LOW(SIDE_B);
    OUTPUT(PWM), OUTPUT(SIDE_A), OUTPUT(SIDE_B);
#endif
    ICR4 = STEPS - 1;
    TCCR4A = _BV(WGM41);
    TCCR4B = _BV(WGM43) | _BV(WGM42) | _BV(CS40); /* fast PWM up to ICR4, no divider */
}
#endif

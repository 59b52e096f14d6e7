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

#define FORWARD_ON _BV(COM4B1) /* OC4B high until its compare match */
#define REVERSE_ON _BV(COM4C1)
#if DRIVE == DRIVE_PAIR
#define ALL_LOW() (LOW(FORWARD), LOW(REVERSE))
_Static_assert(BIT(FORWARD) == 4 && BIT(REVERSE) == 5, "OC4B and OC4C");
#else
#define ALL_LOW() (LOW(PWM), LOW(SIDE_A), LOW(SIDE_B))
_Static_assert(BIT(PWM) == 4, "OC4B");
#endif

void port_command(int16_t steps) {
    static int16_t last;
    if (steps > STEPS) steps = STEPS;
    if (steps < -STEPS) steps = -STEPS;
    uint32_t before = port_lock();
    if (steps != last || !steps) {
        bool turns = !steps || (steps > 0) != (last > 0) || (steps < 0) != (last < 0);
        uint16_t high = (uint16_t)(steps < 0 ? -steps : steps) - 1; /* until its compare match, from the next period on */
        if (turns) { /* off at once, before the other side is on; pins that no timer holds show their low output */
            TCCR4A = _BV(WGM41);
            ALL_LOW();
        }
#if DRIVE == DRIVE_PAIR
        if (steps > 0) OCR4B = high, TCCR4A = _BV(WGM41) | FORWARD_ON;
        if (steps < 0) OCR4C = high, TCCR4A = _BV(WGM41) | REVERSE_ON;
#else
        if (turns && steps > 0) HIGH(SIDE_A);
        if (turns && steps < 0) HIGH(SIDE_B);
        if (steps) OCR4B = high, TCCR4A = _BV(WGM41) | FORWARD_ON;
#endif
        last = steps;
    }
    port_unlock(before);
}

bool port_settled(void) { return true; } /* pins are low before the call ends */

void drive_prepare(void) {
    ALL_LOW();
#if DRIVE == DRIVE_PAIR
    OUTPUT(FORWARD), OUTPUT(REVERSE);
#else
    OUTPUT(PWM), OUTPUT(SIDE_A), OUTPUT(SIDE_B);
#endif
    ICR4 = STEPS - 1;
    TCCR4A = _BV(WGM41);
    TCCR4B = _BV(WGM43) | _BV(WGM42) | _BV(CS40); /* fast PWM up to ICR4, no divider */
}
#endif

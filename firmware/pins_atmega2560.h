/* Wires of an Arduino Mega 2560: port, bit, number on the board. The program is compiled with this table, and
 * `upright firmware pins` and the drawing in docs/tutorials/own_rig.md are made from it. */
#ifndef PINS_H
#define PINS_H

#define ENCODER_1_A B, 4, 10 /* encoder 1, of what is driven: A */
#define ENCODER_1_B B, 5, 11 /* encoder 1, of what is driven: B */
#define ENCODER_2_A B, 6, 12 /* encoder 2, of the pendulum: A */
#define ENCODER_2_B B, 7, 13 /* encoder 2, of the pendulum: B */
#define POWER_STAGE G, 5, 4  /* power stage: enable, high on; 10 kOhm to ground */
#define LED H, 3, 6          /* LED, 330 Ohm to ground: on while the drive may move, blinking in FAULT */
#define HOST_RX E, 0, 0      /* host: through the board's USB */
#define HOST_TX E, 1, 1      /* host: through the board's USB */

#if DRIVE == DRIVE_ANALOG
#define SCLK B, 1, 52 /* converter AD5761R: SCLK */
#define SDI B, 2, 51  /* converter AD5761R: SDI */
#define SYNC B, 0, 53 /* converter AD5761R: SYNC */
#elif DRIVE == DRIVE_PAIR
#define FORWARD H, 4, 7 /* H-bridge: RPWM (BTS7960), IN1 (DRV8871), PWM forward */
#define REVERSE H, 5, 8 /* H-bridge: LPWM (BTS7960), IN2 (DRV8871), PWM backward */
#elif DRIVE == DRIVE_SIGN
#define PWM H, 4, 7   /* H-bridge: PWM (VNH5019), ENA (L298N) */
#define SIDE_A H, 5, 8 /* H-bridge: INA (VNH5019), IN1 (L298N), high forward */
#define SIDE_B H, 6, 9 /* H-bridge: INB (VNH5019), IN2 (L298N), high backward */
#endif

/* A pin of the table: its output high or low, its direction. */
#define HIGH(pin) HIGH_(pin)
#define HIGH_(port, bit, number) (PORT##port |= _BV(bit))
#define LOW(pin) LOW_(pin)
#define LOW_(port, bit, number) (PORT##port &= (uint8_t)~_BV(bit))
#define TOGGLE(pin) TOGGLE_(pin)
#define TOGGLE_(port, bit, number) (PIN##port = _BV(bit))
#define OUTPUT(pin) OUTPUT_(pin)
#define OUTPUT_(port, bit, number) (DDR##port |= _BV(bit))
#define BIT(pin) BIT_(pin)
#define BIT_(port, bit, number) bit
#endif

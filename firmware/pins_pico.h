/* Wires of a Raspberry Pi Pico: numbers GPn of the board. The program is compiled with this table, and
 * `upright firmware pins` and the drawing in docs/tutorials/own_rig.md are made from it. Its pins stand 3.3 V and no more. */
#ifndef PINS_H
#define PINS_H

#define ENCODER_1_A 2  /* encoder 1, of what is driven: A, at 3.3 V */
#define ENCODER_1_B 3  /* encoder 1, of what is driven: B, at 3.3 V */
#define ENCODER_2_A 4  /* encoder 2, of the pendulum: A, at 3.3 V */
#define ENCODER_2_B 5  /* encoder 2, of the pendulum: B, at 3.3 V */
#define POWER_STAGE 18 /* power stage: enable, high on; 10 kOhm to ground */
#define LED 25         /* LED of the board: on while the drive may move, blinking in FAULT */
#define HOST_TX 0      /* host, a USB serial adapter of 3.3 V: its RX */
#define HOST_RX 1      /* host, a USB serial adapter of 3.3 V: its TX */

#if DRIVE == DRIVE_PAIR
#define FORWARD 16 /* H-bridge: RPWM (BTS7960), IN1 (DRV8871), PWM forward */
#define REVERSE 17 /* H-bridge: LPWM (BTS7960), IN2 (DRV8871), PWM backward */
#elif DRIVE == DRIVE_SIGN
#define PWM 16    /* H-bridge: PWM (VNH5019), ENA (L298N) */
#define SIDE_A 20 /* H-bridge: INA (VNH5019), IN1 (L298N), high forward */
#define SIDE_B 21 /* H-bridge: INB (VNH5019), IN2 (L298N), high backward */
#endif
#endif

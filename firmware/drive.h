/* What puts the command out: a converter into an amplifier, or an H-bridge in one of two ways of wiring it. */
#ifndef DRIVE_H
#define DRIVE_H
#define DRIVE_ANALOG 1 /* +-10 V of an AD5761R */
#define DRIVE_PAIR 2   /* two PWM inputs, one for each way: BTS7960, DRV8871 */
#define DRIVE_SIGN 3   /* one PWM input and the way on two lines: VNH5019, L298N; on one: Cytron, Pololu */
#ifndef DRIVE
#define DRIVE DRIVE_ANALOG
#endif

/* A BTS7960 that is enabled with both inputs low shorts the motor, which brakes itself, and a loose wire is low as well.
 * Where one input low does not short it (L298N, VNH5019, DRV8871), or an amplifier holds the torque at zero, there is
 * nothing to brake by. */
#include "ceilings.h"
#if CEILING_BRAKE && DRIVE != DRIVE_PAIR
#error "CEILING_BRAKE is for two PWM lines, and a bridge that shorts the motor while both are low: a BTS7960."
#endif

#if DRIVE == DRIVE_ANALOG
#define DRIVE_NAME "analog"
#elif DRIVE == DRIVE_PAIR
#define DRIVE_NAME "two PWM lines"
#else
#define DRIVE_NAME "PWM and sign"
#endif

void drive_prepare(void); /* at zero, before anything else */
#endif

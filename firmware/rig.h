/* The rig's core, the same on every board: modes, limits, latched faults, the loop on the MCU.
 *
 *     IDLE -> ARMED -> HOST | MCU -> IDLE        any of them -> FAULT -> (CLEAR) -> IDLE
 *
 * In IDLE and FAULT the command is zero and the power stage is off, at the latest CEILING_BRAKE ticks after a stop.
 * A reset and a new host's HELLO end in FAULT:
 * nothing moves before the host has cleared it and said limits, none of them wider than ceilings.h. The numbers of modes and faults are those of src/upright/rigs/protocol.py, frames those of
 * src/upright/rigs/wire.py; docs/reference/firmware.md has both as tables.
 *
 * This is supervision in software, not a rated safety function; a rig needs a stop in hardware besides. */
#ifndef RIG_H
#define RIG_H
#include <stdbool.h>
#include <stdint.h>

#define PROTOCOL 2

enum mode { IDLE, ARMED, HOST, MCU, FAULT };

enum fault {
    F_WATCHDOG = 1,
    F_OVERTRAVEL = 2,
    F_OVERSPEED = 4,
    F_GAINS = 8,
    F_STOP = 16,
    F_OVERRUN = 32,
    F_ENCODER = 64,
    F_SATURATION = 128,
    F_START = 256,
    F_RESET = 512,
    F_TWIST = 1024,
    F_STALE = 4096,
};

/* Replies carry the number of what they answer, and the highest bit. */
enum request {
    HELLO = 1,
    CONFIGURE,
    ZERO,
    SELF_TEST,
    ARM,
    START,
    EXCHANGE,
    STOP,
    ESTOP,
    CLEAR,
    LAW,
    SNAPSHOT,
    REPLY = 0x80,
};

enum result { DONE, WRONG_LENGTH, WRONG_MODE, WRONG_VALUE, NOT_CONFIGURED, FAULTED, OFF_START, UNKNOWN, WRONG_SESSION };

#define SPEED_WINDOW 8       /* ticks over which a speed is measured; a power of two */
#define LONGEST_PULSE 300000 /* of a self-test [us] */

void rig_reset(void);
void rig_receive(uint8_t byte); /* from the wire, outside of the tick */
void rig_poll(void);            /* sends the sample that an exchange waits for, outside of the tick */
bool rig_waiting(void);         /* an exchange waits for the next tick */

/* The control tick: its number by the board's clock, and how late it began [us]. */
void rig_tick(uint32_t tick, uint16_t late);
void rig_overrun(void); /* instead of a tick that came due while the one before was still at work */
enum mode rig_mode(void);
#endif

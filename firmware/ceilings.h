/* The farthest that any host may let this rig go. A host narrows these and cannot widen them: what it asks for beyond
 * them is held to them, and it reads them back. Set them for your rig, here or by -DCEILING_...;
 * `upright firmware build --rig RIG.toml` takes them from its [limits]. In counts from where the encoders were zeroed,
 * and in ticks of 1 ms. */
#ifndef CEILINGS_H
#define CEILINGS_H

#ifndef CEILING_COMMAND
#define CEILING_COMMAND 80 /* largest command [% of full scale] */
#endif
#ifndef CEILING_TRAVEL_1
#define CEILING_TRAVEL_1 40000 /* encoder 1, of what is driven: 2.5 turns of 16,000 counts */
#endif
#ifndef CEILING_TRAVEL_2
#define CEILING_TRAVEL_2 0x7FFFFFFF /* encoder 2: a pendulum turns over as often as it likes */
#endif
#ifndef CEILING_SPEED_1
#define CEILING_SPEED_1 1024 /* counts in 8 ticks: 50 rad/s of 16,000 counts per turn */
#endif
#ifndef CEILING_SPEED_2
#define CEILING_SPEED_2 1024
#endif
#ifndef CEILING_SATURATION
#define CEILING_SATURATION 5000 /* without a break at the largest command */
#endif
#ifndef CEILING_WATCHDOG
#define CEILING_WATCHDOG 5000 /* between two commands */
#endif
#ifndef CEILING_PATIENCE
#define CEILING_PATIENCE 1000 /* that an armed rig at zero command waits for its host */
#endif
#ifndef CEILING_BRAKE
#define CEILING_BRAKE 0 /* that a stop leaves the power stage on at zero command, 1000 at most; see drive.h */
#endif
_Static_assert(CEILING_BRAKE >= 0 && CEILING_BRAKE <= 1000, "a brake lasts 1 s at most");
#endif

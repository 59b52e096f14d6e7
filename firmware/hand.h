/* A hand beside a simulated rig: it lifts the pendulum and lets go, by what a person sees of the drive, in the rig's own
 * time. */
#ifndef HAND_H
#define HAND_H
#include <stdbool.h>

#include "furuta.h"

typedef struct {
    bool called;   /* until it has let go */
    double angle;  /* to lift theta to [rad] */
    bool seen, on; /* the drive: since the hand was called, and at the last look */
    double silent; /* for how long the drive, since it was seen [s] */
    double still;  /* for how long they are held there [s] */
} hand_t;

/* Once the drive was on and is silent for a second, by then off or on, theta is brought there and psi to 0, and both are
 * held; let go when the drive comes on, or after a second where it was on all along. */
void hand_lifts(hand_t *hand, double angle);
/* Before each step of the rig. */
void hand_moves(hand_t *hand, furuta_t *rig, bool on, int command, double dt);
#endif

#include "hand.h"

#include <math.h>

#define PAUSE 1.0 /* of the drive before it counts as silent, and of a hand that holds still [s] */
#define SPEED 2.0 /* of a hand that lifts [rad/s] */

void hand_lifts(hand_t *hand, double angle) { *hand = (hand_t){.called = true, .angle = angle}; }

static bool brought(double *q, double to, double step) {
    double left = to - *q;
    if (fabs(left) > step) return *q += copysign(step, left), false;
    return *q = to, true;
}

void hand_moves(hand_t *hand, furuta_t *rig, bool on, int command, double dt) {
    if (!hand->called) return;
    bool comes_on = on && !hand->on;
    hand->on = on;
    hand->seen |= on;
    if (hand->silent < PAUSE) {
        hand->silent = hand->seen && !(on && command) ? hand->silent + dt : 0;
        return;
    }
    rig->held = true;
    rig->x[1] = rig->x[3] = 0;
    bool there = brought(&rig->x[0], 0, SPEED * dt) & brought(&rig->x[2], hand->angle, SPEED * dt);
    if (!there) return;
    hand->still += dt;
    if (comes_on || (on && hand->still > PAUSE)) rig->held = hand->called = false;
}

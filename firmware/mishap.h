/* What can go wrong between a simulated rig and the firmware, asked for in lines of text. */
#ifndef MISHAP_H
#define MISHAP_H
#include <stdbool.h>
#include <stdint.h>

#include "furuta.h"
#include "hand.h"

typedef struct {
    double scale; /* counts shown per true count: -1 for swapped wires, 2 or 4 for a decoder that counts other edges */
    bool dead;
    long shown, seen;
    double rest;
} encoder_t;

typedef struct {
    encoder_t encoder[2];
    double corruption; /* probability that a byte on the wire comes with a flipped bit */
    uint64_t random;
    bool cut; /* nothing comes from the host any more */
    double motor; /* what the motor gets of its drive: 0.5 of a weak supply, -1 by swapped leads, 0 without an enable line */
    hand_t hand;
} mishaps_t;

void mishaps_prepare(mishaps_t *now, const furuta_t *rig);
/* Counts that an encoder shows when the true ones are these. */
long encoder_shows(encoder_t *encoder, long counts);
uint8_t over_the_wire(mishaps_t *now, uint8_t byte);

/*     dead CHANNEL            alive CHANNEL          flip CHANNEL           scale CHANNEL FACTOR
 *     lose CHANNEL COUNTS     corrupt CHANCE SEED    cut                    join
 *     kick SPEED [rad/s]      hold                   release                motor FACTOR
 *     put PSI PSI' THETA THETA'                     lift THETA (hand.h)
 * false for a line that is none of them. */
bool mishaps_line(mishaps_t *now, furuta_t *rig, const char *line);
/* A step of the rig with a hand at it, the drive on or off at a command in steps of its converter. */
void mishaps_move(mishaps_t *now, furuta_t *rig, bool on, double command, double dt);
#endif

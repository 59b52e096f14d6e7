#include "mishap.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void mishaps_prepare(mishaps_t *now, const furuta_t *rig) {
    memset(now, 0, sizeof *now);
    now->motor = 1;
    for (int i = 0; i < 2; i++) {
        now->encoder[i].scale = 1;
        now->encoder[i].seen = furuta_counts(rig, i);
    }
}

long encoder_shows(encoder_t *encoder, long counts) {
    double step = encoder->dead ? 0 : encoder->scale * (double)(counts - encoder->seen) + encoder->rest;
    encoder->seen = counts;
    encoder->rest = encoder->dead ? 0 : step - trunc(step);
    encoder->shown += (long)trunc(step);
    return encoder->shown;
}

static uint64_t next_random(mishaps_t *now) { /* xorshift64 */
    now->random ^= now->random << 13;
    now->random ^= now->random >> 7;
    return now->random ^= now->random << 17;
}

uint8_t over_the_wire(mishaps_t *now, uint8_t byte) {
    if (now->corruption <= 0) return byte;
    double chance = (double)(next_random(now) >> 11) / 9007199254740992.0; /* 2^53 */
    return chance < now->corruption ? byte ^ (uint8_t)(1u << (next_random(now) >> 61)) : byte;
}

void mishaps_move(mishaps_t *now, furuta_t *rig, bool on, double command, double dt) {
    if (!rig->running) return;
    hand_moves(&now->hand, rig, on, command != 0, dt);
    double size = fabs(rig->step * command) - rig->dead; /* beyond what the drive swallows */
    double pushes = on && size > 0 ? now->motor * rig->gain * copysign(size, command) : 0;
    furuta_move(rig, on ? pushes - rig->emf * rig->x[1] : 0, dt);
}

bool mishaps_line(mishaps_t *now, furuta_t *rig, const char *line) {
    int channel = 0;
    double value, x[4];
    unsigned long long seed;
    if (!strcmp(line, "cut")) return now->cut = true;
    if (!strcmp(line, "join")) return now->cut = false, true;
    if (!strcmp(line, "hold")) return rig->held = true;
    if (!strcmp(line, "release")) return now->hand.called = rig->held = false, rig->running = true;
    if (sscanf(line, "lift %lf", &value) == 1) return hand_lifts(&now->hand, value), true;
    if (sscanf(line, "motor %lf", &value) == 1) return now->motor = value, true;
    if (sscanf(line, "kick %lf", &value) == 1) return rig->x[3] += value, true;
    if (sscanf(line, "put %lf %lf %lf %lf", x, x + 1, x + 2, x + 3) == 4) return memcpy(rig->x, x, sizeof x), true;
    if (sscanf(line, "corrupt %lf %llu", &value, &seed) == 2)
        return now->corruption = value, now->random = 2 * seed + 1, true;
    char what[8];
    if (sscanf(line, "%7s %d %lf", what, &channel, &value) < 2 || channel < 0 || channel > 1) return false;
    encoder_t *encoder = &now->encoder[channel];
    if (!strcmp(what, "dead")) return encoder->dead = true;
    if (!strcmp(what, "alive")) return encoder->dead = false, true;
    if (!strcmp(what, "flip")) return encoder->scale *= -1, true;
    if (sscanf(line, "%*s %*d %lf", &value) != 1) return false;
    if (!strcmp(what, "scale")) return encoder->scale = value, true;
    if (!strcmp(what, "lose")) return encoder->shown -= (long)value, true;
    return false;
}

/* The project's sampled linear law in float32 (src/upright/laws/linear.py):
 *     z[k+1] = A z[k] + B w[k],  u[k] = C z[k] + D w[k],  w = [q - target, reference]
 * with readings q in counts, the command u in steps of the converter and the reference in rad or m. */
#ifndef LAW_H
#define LAW_H
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#define MEMORIES 4
#define READINGS 2
#define INPUTS (MEMORIES + READINGS + 1) /* memories, readings, one reference */
#define OUTPUTS (MEMORIES + 1)           /* memories, the command */
#define COMMAND_ROW MEMORIES
#define STEP_SAMPLES 100     /* for which one count is held */
#define GROWTH_SQUARINGS 9   /* 512 samples, */
#define GROWTH_MOST 64       /* in which each of the law's modes may grow by that much: by e in 123 samples */

/* Whether a number is one, and below 2^30 in size; by its bits, which costs a small processor far less than a float's
 * comparison. */
static inline bool sane(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return (bits & 0x7FFFFFFFUL) < 0x4E800000UL;
}

static inline bool nothing(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return !(bits << 1);
}

typedef struct {
    float matrix[OUTPUTS][INPUTS]; /* [[A, B], [C, D]] */
    float target[READINGS];
    float initial[MEMORIES];       /* memory at the first sample, and what the first readings less their targets add */
    float begin[MEMORIES][READINGS];
    int16_t limit;                 /* largest command [steps] */
    uint8_t held_sums;             /* bit i: memory i stands still while the command is beyond its limit */
    uint8_t every;                 /* ticks from one sample to the next */
} law_t;

#define LAW_BYTES (4 * (OUTPUTS * INPUTS + READINGS + MEMORIES + MEMORIES * READINGS) + 4)

/* Reads what came over the wire; false, and nothing taken over, when a number is not one or is absurd: a gain by which
 * one count moves the command by all that it may be, in one sample or held for STEP_SAMPLES of them, at once or through
 * the memories; or memories that grow by themselves (GROWTH_SAMPLES). src/upright/rigs/law.py says the same. */
bool law_take(law_t *law, const uint8_t body[LAW_BYTES], int16_t most);
void law_give(const law_t *law, uint8_t body[LAW_BYTES]);

void law_start(void);
/* Command of one sample, limited by the law; false when it is no number or an absurd one. Sums stand still beyond the
 * law's limit and the rig's. */
bool law_step(const law_t *law, const int32_t q[READINGS], float reference, int16_t rig_limit, int16_t *command);
#endif

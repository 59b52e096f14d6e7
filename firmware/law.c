#include "law.h"

#include <math.h>

#include "bytes.h"

/* Entries that are not zero, row by row, so that a tick costs what the law needs and not what it could need. */
typedef struct {
    float entry;
    uint8_t column;
    bool one;
} term_t;
static term_t terms[OUTPUTS * INPUTS];
static uint8_t terms_in[OUTPUTS];
static float memory[MEMORIES];
static bool begun;

/* Whether one count of a reading moves the command by less than all that it may be, at once or through the memories,
 * which are at zero before or begun by that count. With n memories a count reaches the command within n samples or
 * never: A^n is a sum of lower powers (Cayley and Hamilton), so that C A^k B is zero for every k if it is for k < n.
 * A count that is held shows what memories add up. */
static bool moderate(const law_t *law, uint8_t reading, bool begins, bool held, int16_t most) {
    float z[MEMORIES], out[OUTPUTS];
    for (uint8_t i = 0; i < MEMORIES; i++) z[i] = begins ? law->begin[i][reading] : 0;
    for (uint8_t k = 0; k <= (held ? STEP_SAMPLES : MEMORIES); k++) {
        for (uint8_t row = 0; row < OUTPUTS; row++) {
            out[row] = k && !held ? 0 : law->matrix[row][MEMORIES + reading];
            for (uint8_t i = 0; i < MEMORIES; i++)
                if (!nothing(law->matrix[row][i])) out[row] += law->matrix[row][i] * z[i];
        }
        if (!(fabsf(out[COMMAND_ROW]) < most)) return false; /* nor what is no number */
        memcpy(z, out, sizeof z);
    }
    return true;
}

/* Whether the memories stand still or decay when nothing comes in. The trace of a power of A is the sum of the powers of
 * its eigenvalues, whatever units the memories have; of a pair of them that the last power shows as cos = 0, the power
 * before shows cos = +-1/sqrt(2). */
static bool settles(const law_t *law) {
    float power[MEMORIES][MEMORIES], square[MEMORIES][MEMORIES];
    for (uint8_t i = 0; i < MEMORIES; i++) memcpy(power[i], law->matrix[i], sizeof power[i]);
    for (uint8_t n = 1; n <= GROWTH_SQUARINGS; n++) {
        float trace = 0;
        for (uint8_t i = 0; i < MEMORIES; i++) {
            for (uint8_t j = 0; j < MEMORIES; j++) {
                square[i][j] = 0;
                for (uint8_t k = 0; k < MEMORIES; k++)
                    if (!nothing(power[i][k]) && !nothing(power[k][j])) square[i][j] += power[i][k] * power[k][j];
            }
            trace += square[i][i];
        }
        if (!(fabsf(trace) <= MEMORIES * GROWTH_MOST)) return false; /* nor what is no number */
        memcpy(power, square, sizeof power);
    }
    return true;
}

bool law_take(law_t *law, const uint8_t body[LAW_BYTES], int16_t most) {
    law_t offered;
    float *numbers[] = {&offered.matrix[0][0], offered.target, offered.initial, &offered.begin[0][0]};
    const uint8_t sizes[] = {OUTPUTS * INPUTS, READINGS, MEMORIES, MEMORIES * READINGS};
    for (uint8_t part = 0; part < sizeof sizes; part++)
        for (uint8_t i = 0; i < sizes[part]; i++, body += 4) {
            numbers[part][i] = get_float(body);
            if (!sane(numbers[part][i])) return false;
        }
    offered.limit = (int16_t)get_u16(body);
    offered.held_sums = body[2];
    offered.every = body[3];
    if (offered.every == 0 || offered.limit <= 0) return false;
    for (uint8_t i = 0; i < READINGS; i++)
        if (!moderate(&offered, i, false, false, most) || !moderate(&offered, i, true, false, most) ||
            !moderate(&offered, i, false, true, most))
            return false;
    if (!settles(&offered)) return false;

    *law = offered;
    uint8_t count = 0;
    for (uint8_t row = 0; row < OUTPUTS; row++) {
        uint8_t before = count;
        for (uint8_t column = 0; column < INPUTS; column++) {
            float entry = law->matrix[row][column];
            if (entry == 0) continue;
            terms[count].entry = entry;
            terms[count].column = column;
            terms[count++].one = entry == 1;
        }
        terms_in[row] = count - before;
    }
    return true;
}

void law_give(const law_t *law, uint8_t body[LAW_BYTES]) {
    const float *numbers[] = {&law->matrix[0][0], law->target, law->initial, &law->begin[0][0]};
    const uint8_t sizes[] = {OUTPUTS * INPUTS, READINGS, MEMORIES, MEMORIES * READINGS};
    for (uint8_t part = 0; part < sizeof sizes; part++)
        for (uint8_t i = 0; i < sizes[part]; i++, body += 4) put_float(body, numbers[part][i]);
    put_u16(body, (uint16_t)law->limit);
    body[2] = law->held_sums;
    body[3] = law->every;
}

void law_start(void) { begun = false; }

bool law_step(const law_t *law, const int32_t q[READINGS], float reference, int16_t rig_limit, int16_t *command) {
    float in[INPUTS], out[OUTPUTS];
    float *w = in + MEMORIES;
    for (uint8_t i = 0; i < READINGS; i++) w[i] = (float)q[i] - law->target[i];
    w[READINGS] = reference;
    if (!begun) {
        for (uint8_t i = 0; i < MEMORIES; i++) {
            memory[i] = law->initial[i];
            for (uint8_t j = 0; j < READINGS; j++) memory[i] += law->begin[i][j] * w[j];
        }
        begun = true;
    }
    memcpy(in, memory, sizeof memory);
    const term_t *term = terms;
    for (uint8_t row = 0; row < OUTPUTS; row++) {
        float sum = 0;
        for (uint8_t left = terms_in[row]; left; left--, term++) {
            float value = in[term->column];
            sum += term->one ? value : term->entry * value;
        }
        if (!sane(sum)) return false;
        out[row] = sum;
    }
    int32_t asked = (int32_t)floorf(out[COMMAND_ROW] + 0.5f);
    int16_t limit = law->limit < rig_limit ? law->limit : rig_limit;
    bool beyond = asked > limit || asked < -limit;
    for (uint8_t i = 0; i < MEMORIES; i++)
        if (!(beyond && law->held_sums >> i & 1)) memory[i] = out[i];
    *command = asked > law->limit ? law->limit : asked < -law->limit ? -law->limit : (int16_t)asked;
    return true;
}

#include "law.h"

#include <math.h>
#include <string.h>

#include "bytes.h"

/* Entries that are not zero, row by row, so that a tick costs what the law needs and not what it could need. */
static struct {
    uint8_t row, column;
    float entry;
} terms[OUTPUTS * INPUTS];
static uint8_t term_count;
static float memory[MEMORIES];
static bool begun;

static float number(const uint8_t **at) {
    float value = get_float(*at);
    *at += 4;
    return value;
}

static bool sane(const float *values, uint8_t n, float most) {
    for (uint8_t i = 0; i < n; i++)
        if (!(fabsf(values[i]) <= most)) return false; /* NaN fails every comparison */
    return true;
}

bool law_take(law_t *law, const uint8_t body[LAW_BYTES], int16_t most) {
    law_t offered;
    const uint8_t *at = body;
    float *numbers[] = {&offered.matrix[0][0], offered.target, offered.initial, &offered.begin[0][0], &offered.limit};
    const uint8_t sizes[] = {OUTPUTS * INPUTS, READINGS, MEMORIES, MEMORIES * READINGS, 1};
    for (uint8_t part = 0; part < sizeof sizes; part++) {
        for (uint8_t i = 0; i < sizes[part]; i++) numbers[part][i] = number(&at);
        if (!sane(numbers[part], sizes[part], ABSURD)) return false;
    }
    offered.held_sums = at[0];
    offered.every = at[1];
    if (offered.every == 0 || !(offered.limit > 0 && offered.limit <= 32767)) return false;
    for (uint8_t i = 0; i < READINGS; i++)
        if (!(fabsf(offered.matrix[COMMAND_ROW][MEMORIES + i]) < most)) return false;

    *law = offered;
    term_count = 0;
    for (uint8_t row = 0; row < OUTPUTS; row++)
        for (uint8_t column = 0; column < INPUTS; column++)
            if (law->matrix[row][column] != 0) {
                terms[term_count].row = row;
                terms[term_count].column = column;
                terms[term_count++].entry = law->matrix[row][column];
            }
    return true;
}

void law_give(const law_t *law, uint8_t body[LAW_BYTES]) {
    const float *numbers[] = {&law->matrix[0][0], law->target, law->initial, &law->begin[0][0], &law->limit};
    const uint8_t sizes[] = {OUTPUTS * INPUTS, READINGS, MEMORIES, MEMORIES * READINGS, 1};
    for (uint8_t part = 0; part < sizeof sizes; part++)
        for (uint8_t i = 0; i < sizes[part]; i++, body += 4) put_float(body, numbers[part][i]);
    body[0] = law->held_sums;
    body[1] = law->every;
}

void law_start(void) { begun = false; }

bool law_step(const law_t *law, const int32_t q[READINGS], float reference, float rig_limit, float *command) {
    float in[INPUTS], out[OUTPUTS] = {0};
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
    for (uint8_t i = 0; i < term_count; i++) {
        float value = in[terms[i].column];
        out[terms[i].row] += terms[i].entry == 1 ? value : terms[i].entry * value;
    }
    float u = out[COMMAND_ROW], limit = law->limit < rig_limit ? law->limit : rig_limit;
    bool beyond = fabsf(floorf(u + 0.5f)) > limit;
    for (uint8_t i = 0; i < MEMORIES; i++)
        if (!(beyond && law->held_sums >> i & 1)) memory[i] = out[i];
    *command = u > law->limit ? law->limit : u < -law->limit ? -law->limit : u;
    return sane(&u, 1, ABSURD) && sane(memory, MEMORIES, ABSURD * 1e3f);
}

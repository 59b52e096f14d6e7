#include "furuta.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "furuta_equations.h"

static const struct {
    const char *name;
    size_t at;
    bool needed;
} fields[] = {
    {"m_p", offsetof(furuta_t, m_p), true},
    {"l_cg", offsetof(furuta_t, l_cg), true},
    {"r", offsetof(furuta_t, r), true},
    {"J_d", offsetof(furuta_t, J_d), true},
    {"J_p", offsetof(furuta_t, J_p), true},
    {"J_a", offsetof(furuta_t, J_a), true},
    {"b_1", offsetof(furuta_t, b_1), true},
    {"b_2", offsetof(furuta_t, b_2), true},
    {"g", offsetof(furuta_t, g), true},
    {"k_psi", offsetof(furuta_t, k_psi), false},
    {"gain", offsetof(furuta_t, gain), true},
    {"step", offsetof(furuta_t, step), true},
    {"dead", offsetof(furuta_t, dead), false},
    {"emf", offsetof(furuta_t, emf), false},
    {"counts_psi", offsetof(furuta_t, counts[0]), true},
    {"counts_theta", offsetof(furuta_t, counts[1]), true},
    {"psi", offsetof(furuta_t, x[0]), false},
    {"psi_dot", offsetof(furuta_t, x[1]), false},
    {"theta", offsetof(furuta_t, x[2]), false},
    {"theta_dot", offsetof(furuta_t, x[3]), false},
};
enum { FIELDS = sizeof fields / sizeof fields[0] };

static double *field(furuta_t *rig, int i) { return (double *)((char *)rig + fields[i].at); }

void furuta_prepare(furuta_t *rig) {
    memset(rig, 0, sizeof *rig);
    for (int i = 0; i < FIELDS; i++)
        if (fields[i].needed) *field(rig, i) = NAN;
}

bool furuta_set(furuta_t *rig, const char *assignment) {
    for (int i = 0; i < FIELDS; i++) {
        size_t n = strlen(fields[i].name);
        if (strncmp(assignment, fields[i].name, n) || assignment[n] != '=') continue;
        char *end;
        *field(rig, i) = strtod(assignment + n + 1, &end);
        return !*end;
    }
    return false;
}

const char *furuta_missing(const furuta_t *rig) {
    for (int i = 0; i < FIELDS; i++)
        if (isnan(*field((furuta_t *)rig, i))) return fields[i].name;
    return NULL;
}

static void speeds(const furuta_t *p, const double x[4], double T, double x_dot[4]) {
    double M[2][2], f[2];
    furuta_equations(p, x, T, M, f);
    double D = M[0][0] * M[1][1] - M[0][1] * M[1][0];
    x_dot[0] = x[1];
    x_dot[1] = (M[1][1] * f[0] - M[0][1] * f[1]) / D;
    x_dot[2] = x[3];
    x_dot[3] = (M[0][0] * f[1] - M[1][0] * f[0]) / D;
}

void furuta_move(furuta_t *rig, double torque, double dt) {
    if (rig->held) return;
    static const double at[4] = {0, 0.5, 0.5, 1}, weight[4] = {1, 2, 2, 1};
    double slope[4] = {0}, sum[4] = {0}, x[4];
    for (int stage = 0; stage < 4; stage++) {
        for (int i = 0; i < 4; i++) x[i] = rig->x[i] + at[stage] * dt * slope[i];
        speeds(rig, x, torque, slope);
        for (int i = 0; i < 4; i++) sum[i] += weight[stage] * slope[i];
    }
    for (int i = 0; i < 4; i++) rig->x[i] += dt / 6 * sum[i];
}

long furuta_counts(const furuta_t *rig, int channel) {
    return (long)floor(rig->x[2 * channel] * rig->counts[channel] + 0.5);
}

#include "furuta.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

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
    {"gain", offsetof(furuta_t, gain), true},
    {"step", offsetof(furuta_t, step), true},
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
    double psi_dot = x[1], theta_dot = x[3], s = sin(x[2]), c = cos(x[2]);
    double J_A = p->J_p + p->m_p * p->l_cg * p->l_cg, k = p->m_p * p->r * p->l_cg;
    double M11 = p->J_d + p->m_p * p->r * p->r + J_A * s * s + p->J_a * c * c, M12 = -k * c;
    double f1 = T - 2 * theta_dot * psi_dot * s * c * (J_A - p->J_a) - k * s * theta_dot * theta_dot - p->b_1 * psi_dot;
    double f2 = -p->m_p * p->g * p->l_cg * s + s * c * psi_dot * psi_dot * (J_A - p->J_a) - p->b_2 * theta_dot;
    double D = M11 * J_A - M12 * M12;
    x_dot[0] = psi_dot;
    x_dot[1] = (J_A * f1 - M12 * f2) / D;
    x_dot[2] = theta_dot;
    x_dot[3] = (M11 * f2 - M12 * f1) / D;
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

/* Furuta pendulum on a drive, to test firmware on: eq. (3) of ASEE 2006-1008 with viscous friction, theta = 0 hanging.
 * Every number comes from whoever starts it; none is assumed, but that nothing anchors the arm and that the drive has no
 * dead zone. */
#ifndef FURUTA_H
#define FURUTA_H
#include <stdbool.h>

typedef struct {
    double m_p, l_cg, r, J_d, J_p, J_a, b_1, b_2, g; /* as in src/upright/physics/furuta.py */
    double k_psi;     /* anchors the arm to ground; 0 when nobody says */
    double gain;      /* torque per unit of command */
    double step;      /* command of one step of the converter */
    double emf;       /* damping by the motor's own voltage while its bridge is on [N m s/rad]; 0 when nobody says */
    double dead;      /* command that the drive swallows to either side; 0 when nobody says */
    double counts[2]; /* per rad */
    double x[4];      /* psi, psi', theta, theta' */
    bool running;     /* until the first run the rig is held where it is */
    bool held;        /* fast by a hand, whatever drives it */
} furuta_t;

/* One `name=value` of the command line; false for a name that it does not have. */
bool furuta_set(furuta_t *rig, const char *assignment);
/* A name that was left out, or NULL. */
const char *furuta_missing(const furuta_t *rig);
void furuta_prepare(furuta_t *rig);

void furuta_move(furuta_t *rig, double torque, double dt); /* one step of RK4 */
long furuta_counts(const furuta_t *rig, int channel);      /* as an ideal encoder shows them */
#endif

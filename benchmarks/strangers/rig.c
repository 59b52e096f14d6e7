/* A pendulum on an arm or a cart, for the benchmark `strangers`; shares nothing with upright but the wire.

   Lagrange's equations of a rigid pendulum (mass m, centre of gravity at l, transverse inertia J about it) whose hinge
   is carried by an arm of radius r, or by a cart, are written out here by hand. Dry friction is set-valued: per step of
   H seconds the impulse that stops a joint, within plus or minus its level, by Gauss and Seidel (Moreau 1988). The drive
   rounds its command to a converter of 12 bits, limits it, is late, and lags; encoders count. What no model of upright
   asks unless told: a cable as a spring on the arm, an axis out of plumb (a rail out of level), friction that is larger
   at rest.

   cc -O2 rig.c -lm            ./a.out RIG < commands   > log      a command per sample; time, counts, commands
   cc -O2 -DLOOP -I DIR rig.c DIR/law.c -lm   ./a.out RIG TILT SECONDS   prints held or the time it fell, and the effort */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef LOOP
#include "law.h"
#endif

#define H 2e-5
#define PI 3.14159265358979323846

static struct {
    double cart, carried, m, l, J, r, b1, b2, dry1, dry2, rest, spring, tilt_x, tilt_y, volt, delay, lag, limit;
    double counts1, counts2, period, travel;
} p;

static const struct { const char *name; double *value; } NAMES[] = {
    {"cart", &p.cart}, {"carried", &p.carried}, {"m", &p.m}, {"l", &p.l}, {"J", &p.J}, {"r", &p.r}, {"b1", &p.b1},
    {"b2", &p.b2}, {"dry1", &p.dry1}, {"dry2", &p.dry2}, {"rest", &p.rest}, {"spring", &p.spring},
    {"tilt_x", &p.tilt_x}, {"tilt_y", &p.tilt_y}, {"volt", &p.volt}, {"delay", &p.delay}, {"lag", &p.lag},
    {"limit", &p.limit}, {"counts1", &p.counts1}, {"counts2", &p.counts2}, {"period", &p.period}, {"travel", &p.travel},
};

static void load(const char *path)
{
    char name[64];
    double value;
    unsigned i;
    FILE *f = fopen(path, "r");
    if (!f)
        exit(2);
    while (fscanf(f, "%63s %lf", name, &value) == 2)
        for (i = 0; i < sizeof NAMES / sizeof *NAMES; i++)
            if (!strcmp(name, NAMES[i].name))
                *NAMES[i].value = value;
    fclose(f);
}

static double q[2], v[2], force;

/* One step of H under a force on the driven body. */
static void step(double push)
{
    const double g = 9.81, s = sin(q[1]), c = cos(q[1]), A = p.J + p.m * p.l * p.l, ml = p.m * p.l;
    double a, b, d, f0, f1, det, u0, u1, p0 = 0, p1 = 0, most0, most1;
    int k;
    d = A;
    if (p.cart) {
        a = p.carried + p.m;
        b = ml * c;
        f0 = push + ml * s * v[1] * v[1] - a * g * p.tilt_x;
        f1 = -ml * g * (s + p.tilt_x * c);
    } else {
        const double S = sin(q[0]), C = cos(q[0]);
        a = p.carried + p.m * p.r * p.r + A * s * s;
        b = -ml * p.r * c;
        f0 = push - 2 * A * s * c * v[0] * v[1] - ml * p.r * s * v[1] * v[1] - p.spring * q[0]
             - p.m * g * (p.tilt_x * (-p.r * S + p.l * s * C) + p.tilt_y * (p.r * C + p.l * s * S));
        f1 = A * s * c * v[0] * v[0] - ml * g * s - ml * g * c * (p.tilt_x * S - p.tilt_y * C);
    }
    f0 -= p.b1 * v[0];
    f1 -= p.b2 * v[1];
    det = a * d - b * b;
    u0 = v[0] + H * (d * f0 - b * f1) / det;
    u1 = v[1] + H * (a * f1 - b * f0) / det;
    most0 = H * p.dry1 * (fabs(v[0]) < 1e-3 ? p.rest : 1);
    most1 = H * p.dry2 * (fabs(v[1]) < 1e-3 ? p.rest : 1);
    for (k = 0; k < 30; k++) { /* impulses that stop each joint, given the other's */
        double w0 = u0 + (d * p0 - b * p1) / det, w1;
        p0 = fmax(-most0, fmin(most0, p0 - w0 * det / d));
        w1 = u1 + (a * p1 - b * p0) / det;
        p1 = fmax(-most1, fmin(most1, p1 - w1 * det / a));
    }
    v[0] = u0 + (d * p0 - b * p1) / det;
    v[1] = u1 + (a * p1 - b * p0) / det;
    q[0] += H * v[0];
    q[1] += H * v[1];
}

static double late[4096];
static long now;

/* A sample: the command goes out, and the rig moves for a period. */
static double sample(double u)
{
    const double bit = 10.0 / 2048;
    const long steps = lround(p.period / H), behind = lround(p.delay / H);
    long i;
    u = bit * floor(fmax(-p.limit, fmin(p.limit, u)) / bit + 0.5);
    late[now % 4096] = u;
    for (i = 0; i < steps; i++) {
        const long at = now * steps + i - behind;
        const double seen = at < 0 ? 0 : late[at / steps % 4096];
        force += p.lag > 0 ? (seen - force) * (1 - exp(-H / p.lag)) : seen - force;
        step(p.volt * force);
    }
    now++;
    return u;
}

static double counted(double x, double counts, int turn)
{
    return floor(x * counts / (turn ? 2 * PI : 1));
}

int main(int argc, char **argv)
{
    if (argc < 2)
        return 2;
    load(argv[1]);
#ifdef LOOP
    {
        const double tilt = atof(argv[2]), seconds = atof(argv[3]);
        const long samples = lround(seconds / p.period);
        double square = 0, most = 0, y[2], u[1];
        long k, full = 0;
        law_state s;
        law_start(&s);
        q[1] = PI + tilt;
        for (k = 0; k < samples; k++) {
            /* zeroed where it hung */
            y[0] = counted(q[0], p.counts1, !p.cart) * (p.cart ? 1 : 2 * PI) / p.counts1;
            y[1] = counted(q[1], p.counts2, 1) * 2 * PI / p.counts2;
            law_step(&s, y, 0, u);
            u[0] = sample(u[0]);
            square += u[0] * u[0];
            most = fmax(most, fabs(u[0]));
            full += fabs(u[0]) > 0.99 * p.limit;
            if (!(fabs(q[1] - PI) < PI / 6) || fabs(q[0]) > p.travel) {
                printf("%.4f %.4f %.4f %.4f\n", k * p.period, sqrt(square / (k + 1)), most, (double)full / (k + 1));
                return 0;
            }
        }
        printf("inf %.4f %.4f %.4f\n", sqrt(square / samples), most, (double)full / samples);
    }
#else
    {
        double u;
        long k = 0;
        while (scanf("%lf", &u) == 1) {
            const double y0 = counted(q[0], p.counts1, !p.cart), y1 = counted(q[1], p.counts2, 1);
            printf("%.6f %.0f %.0f %.6f\n", k++ * p.period, y0, y1, sample(u));
        }
    }
#endif
    return 0;
}

/* How fast can one core go at all? The Furuta pendulum of eq. (3), written by hand.
 *
 * Compiled twice by benchmarks/baseline/__init__.py: plainly, with the C library's sin and cos (the
 * scalar yardstick), and with -DLANES=16, where LANES rigs run side by side in vector registers and
 * sin, cos, tanh are polynomials the compiler can vectorize (the practical limit).
 *
 * friction = 0: viscous only; friction = 1: Coulomb smoothed to tanh(v / 0.05), for reference.
 * Parameters, in order: m_p r l_cg J_p J_d b_1 b_2 b_1c b_2c g; states: psi theta psi_dot theta_dot.
 */
#include <math.h>
#include <stddef.h>

#define INLINE static inline __attribute__((always_inline))
#define PI 3.14159265358979323846

#ifdef LANES
/* Cody-Waite reduction by pi/2 in two parts, then the minimax polynomials of Cephes. */
INLINE void sin_cos(double x, double *s, double *c) {
  double n = __builtin_floor(x * 0.63661977236758134308 + 0.5);
  double r = (x - n * 1.57079632673412561417e+00) - n * 6.07710050650619224932e-11;
  double z = r * r;
  double sine = r + r * z * (((((1.58962301576546568060E-10 * z - 2.50507477628578072866E-8) * z
      + 2.75573136213857245213E-6) * z - 1.98412698295895385996E-4) * z
      + 8.33333333332211858878E-3) * z - 1.66666666666666307295E-1);
  double cosine = 1 - 0.5 * z + z * z * (((((-1.13585365213876817300E-11 * z + 2.08757008419747316778E-9) * z
      - 2.75573141792967388112E-7) * z + 2.48015872888517045348E-5) * z
      - 1.38888888888730564116E-3) * z + 4.16666666666665929218E-2);
  double half = n * 0.5 - __builtin_floor(n * 0.5);         /* 0 or 1/2: is the quadrant odd? */
  double quarter = n * 0.25 - __builtin_floor(n * 0.25);    /* 0, 1/4, 1/2, 3/4: which quadrant? */
  double a = half > 0.25 ? cosine : sine, b = half > 0.25 ? sine : cosine;
  *s = quarter >= 0.5 ? -a : a;
  *c = quarter > 0.125 && quarter < 0.625 ? -b : b;
}
/* exp(-2|x|) by Cephes' rational function, one division in all. */
INLINE double smooth_sign(double x) {
  double y = __builtin_fabs(x);
  y = -2 * (y > 20 ? 20 : y);
  double n = __builtin_floor(y * 1.4426950408889634 + 0.5);
  double r = (y - n * 6.93145751953125E-1) - n * 1.42860682030941723212E-6, z = r * r;
  double p = r * ((1.26177193074810590878E-4 * z + 3.02994407707441961300E-2) * z + 9.99999999999999999910E-1);
  double q = ((3.00198505138664455042E-6 * z + 2.52448340349684104192E-3) * z + 2.27265548208155028766E-1) * z + 2;
  union { double d; long long i; } two_n;
  two_n.i = ((long long)(1023 + (int)n)) << 52;
  double a = q - p, b = (q + p) * two_n.d;
  return __builtin_copysign((a - b) / (a + b), x);
}
#else
INLINE void sin_cos(double x, double *s, double *c) { *s = sin(x); *c = cos(x); }
INLINE double smooth_sign(double x) { return tanh(x); }
#endif

typedef struct { double arm, swing, coupling, weight, b_1, b_2, b_1c, b_2c; } Lumps;
typedef struct { double psi, theta, psi_dot, theta_dot; } State;
typedef struct { double k_psi, k_theta, k_psi_dot, k_theta_dot, quantum, keep, limit, period; } Loop;
typedef struct { double psi, theta, psi_dot, theta_dot; } Seen; /* what the controller remembers */

INLINE Lumps lump(const double *p, size_t stride) {
  double m_p = p[0], r = p[stride], l_cg = p[2 * stride], g = p[9 * stride];
  return (Lumps){ m_p * r * r + p[4 * stride], m_p * l_cg * l_cg + p[3 * stride], m_p * r * l_cg, m_p * g * l_cg,
                  p[5 * stride], p[6 * stride], p[7 * stride], p[8 * stride] };
}

INLINE void acceleration(double theta, double v, double w, double torque, Lumps k, int friction, double *dv, double *dw) {
  double s, c;
  sin_cos(theta, &s, &c);
  double m_11 = k.arm + k.swing * s * s, m_12 = -k.coupling * c, spin = k.swing * s * c * v;
  double f_1 = torque - 2 * spin * w - k.coupling * s * w * w - k.b_1 * v;
  double f_2 = -k.weight * s + spin * v - k.b_2 * w;
  if (friction) { f_1 -= k.b_1c * smooth_sign(v * 20); f_2 -= k.b_2c * smooth_sign(w * 20); }
  double scale = 1 / (m_11 * k.swing - m_12 * m_12);
  *dv = (k.swing * f_1 - m_12 * f_2) * scale;
  *dw = (m_11 * f_2 - m_12 * f_1) * scale;
}

INLINE State rk4(State x, double torque, double h, Lumps k, int friction) {
  double v1, w1, v2, w2, v3, w3, v4, w4, half = h * 0.5, sixth = h / 6;
  acceleration(x.theta, x.psi_dot, x.theta_dot, torque, k, friction, &v1, &w1);
  double va = x.psi_dot + half * v1, wa = x.theta_dot + half * w1;
  acceleration(x.theta + half * x.theta_dot, va, wa, torque, k, friction, &v2, &w2);
  double vb = x.psi_dot + half * v2, wb = x.theta_dot + half * w2;
  acceleration(x.theta + half * wa, vb, wb, torque, k, friction, &v3, &w3);
  double vc = x.psi_dot + h * v3, wc = x.theta_dot + h * w3;
  acceleration(x.theta + h * wb, vc, wc, torque, k, friction, &v4, &w4);
  return (State){ x.psi + sixth * (x.psi_dot + 2 * va + 2 * vb + vc), x.theta + sixth * (x.theta_dot + 2 * wa + 2 * wb + wc),
                  x.psi_dot + sixth * (v1 + 2 * v2 + 2 * v3 + v4), x.theta_dot + sixth * (w1 + 2 * w2 + 2 * w3 + w4) };
}

INLINE double counted(double angle, double quantum) { return __builtin_floor(angle / quantum + 0.5) * quantum; }

/* Encoder, filtered difference, state feedback about upright, saturation. */
INLINE double control(State x, Seen *m, Loop c) {
  double psi = counted(x.psi, c.quantum), theta = counted(x.theta, c.quantum);
  m->psi_dot = c.keep * m->psi_dot + (1 - c.keep) * (psi - m->psi) / c.period;
  m->theta_dot = c.keep * m->theta_dot + (1 - c.keep) * (theta - m->theta) / c.period;
  m->psi = psi;
  m->theta = theta;
  double u = -(c.k_psi * psi + c.k_theta * (theta - PI) + c.k_psi_dot * m->psi_dot + c.k_theta_dot * m->theta_dot);
  u = u < c.limit ? u : c.limit;
  return u > -c.limit ? u : -c.limit;
}

/* One run; torque (steps) is held over each step, or NULL for a free swing. */
INLINE void swing(const double *p, const double *x0, const double *torque, double h, int steps, int friction, double *out) {
  Lumps k = lump(p, 1);
  State x = { x0[0], x0[1], x0[2], x0[3] };
  out[0] = x.psi; out[1] = x.theta; out[2] = x.psi_dot; out[3] = x.theta_dot;
  for (int i = 0; i < steps; i++) {
    x = rk4(x, torque ? torque[i] : 0, h, k, friction);
    out += 4;
    out[0] = x.psi; out[1] = x.theta; out[2] = x.psi_dot; out[3] = x.theta_dot;
  }
}
void trajectory(const double *p, const double *x0, const double *torque, double h, int steps, int friction, double *out) {
  if (friction) swing(p, x0, torque, h, steps, 1, out); else swing(p, x0, torque, h, steps, 0, out);
}

/* n closed loops; p is (parameters, n), x0 (4, n), last (4, n): the states after `samples` periods. */
#ifdef LANES
INLINE void loops(const double *p, const double *x0, Loop c, int samples, int n, int friction, double *last) {
  for (int first = 0; first < n; first += LANES) {
    double x[4][LANES], m[4][LANES], k[8][LANES];
    for (int i = 0; i < LANES; i++) {
      size_t lane = first + i < n ? first + i : n - 1;
      Lumps l = lump(p + lane, n);
      k[0][i] = l.arm; k[1][i] = l.swing; k[2][i] = l.coupling; k[3][i] = l.weight;
      k[4][i] = l.b_1; k[5][i] = l.b_2; k[6][i] = l.b_1c; k[7][i] = l.b_2c;
      for (int j = 0; j < 4; j++) x[j][i] = x0[j * (size_t)n + lane];
      m[0][i] = counted(x[0][i], c.quantum); m[1][i] = counted(x[1][i], c.quantum); m[2][i] = m[3][i] = 0;
    }
    for (int t = 0; t < samples; t++) {
      #pragma omp simd simdlen(LANES)
      for (int i = 0; i < LANES; i++) {
        Lumps l = { k[0][i], k[1][i], k[2][i], k[3][i], k[4][i], k[5][i], k[6][i], k[7][i] };
        State y = { x[0][i], x[1][i], x[2][i], x[3][i] };
        Seen s = { m[0][i], m[1][i], m[2][i], m[3][i] };
        double u = control(y, &s, c);
        y = rk4(rk4(y, u, c.period / 2, l, friction), u, c.period / 2, l, friction);
        x[0][i] = y.psi; x[1][i] = y.theta; x[2][i] = y.psi_dot; x[3][i] = y.theta_dot;
        m[0][i] = s.psi; m[1][i] = s.theta; m[2][i] = s.psi_dot; m[3][i] = s.theta_dot;
      }
    }
    for (int i = 0; i < LANES && first + i < n; i++)
      for (int j = 0; j < 4; j++) last[j * (size_t)n + first + i] = x[j][i];
  }
}
#else
INLINE void loops(const double *p, const double *x0, Loop c, int samples, int n, int friction, double *last) {
  for (size_t lane = 0; lane < (size_t)n; lane++) {
    Lumps k = lump(p + lane, n);
    State x = { x0[lane], x0[n + lane], x0[2 * (size_t)n + lane], x0[3 * (size_t)n + lane] };
    Seen m = { counted(x.psi, c.quantum), counted(x.theta, c.quantum), 0, 0 };
    for (int t = 0; t < samples; t++) {
      double u = control(x, &m, c);
      x = rk4(rk4(x, u, c.period / 2, k, friction), u, c.period / 2, k, friction);
    }
    last[lane] = x.psi; last[n + lane] = x.theta;
    last[2 * (size_t)n + lane] = x.psi_dot; last[3 * (size_t)n + lane] = x.theta_dot;
  }
}
#endif
void ensemble(const double *p, const double *x0, const double *c, int samples, int n, int friction, double *last) {
  Loop loop = { c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7] };
  if (friction) loops(p, x0, loop, samples, n, 1, last); else loops(p, x0, loop, samples, n, 0, last);
}

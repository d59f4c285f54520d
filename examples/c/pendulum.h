/* The double pendulum of Upswing in plain C: its equations of motion, and Runge-Kutta steps of 5 ms.
 *
 * q1, q2: joint angles, rad; 0 hanging, q2 relative to link 1. w1, w2: their velocities, rad/s. The
 * motor's torque acts at joint 1. Links are capsules of 1 kg, 0.5 m long between their ends' centres,
 * with a radius of 0.04 m; both joints have damping and a rotor's inertia. */
#ifndef PENDULUM_H
#define PENDULUM_H

#include <math.h>

#define PENDULUM_PI 3.14159265358979323846
#define PENDULUM_MASS 1.0        /* kg, of either link */
#define PENDULUM_LENGTH 0.5      /* m */
#define PENDULUM_RADIUS 0.04     /* m */
#define PENDULUM_DAMPING 0.2     /* N m s/rad */
#define PENDULUM_ARMATURE 0.01   /* kg m2, of either joint's rotor */
#define PENDULUM_GRAVITY 9.81    /* m/s2 */
#define PENDULUM_TIMESTEP 0.005  /* s */

typedef struct {
  double q1, q2, w1, w2;
} pendulum;

/* Moment of inertia of a link about its centre, across its axis: a cylinder and two half spheres. */
static inline double pendulum_inertia(void)
{
  const double r = PENDULUM_RADIUS, l = PENDULUM_LENGTH;
  const double share = l / (l + 4.0 / 3.0 * r); /* of the cylinder in the mass */
  return PENDULUM_MASS * (share * (3 * r * r + l * l) / 12 +
                          (1 - share) * (2 * r * r / 5 + l * l / 4 + 3 * l * r / 8));
}

/* The derivative of the state by time, under a torque: M(q) q'' = f. */
static inline pendulum pendulum_derivative(const pendulum *s, double torque)
{
  const double m = PENDULUM_MASS, l = PENDULUM_LENGTH, c = l / 2, I = pendulum_inertia();
  const double J1 = I + m * c * c + m * l * l + PENDULUM_ARMATURE; /* about joint 1 */
  const double J2 = I + m * c * c;                                 /* of link 2 about joint 2 */
  const double b = m * l * c;                                      /* coupling of the links */
  const double G1 = (m * c + m * l) * PENDULUM_GRAVITY, G2 = m * c * PENDULUM_GRAVITY;
  const double bc = b * cos(s->q2), bs = b * sin(s->q2);
  const double M11 = J1 + J2 + 2 * bc, M12 = J2 + bc, M22 = J2 + PENDULUM_ARMATURE;
  const double g2 = G2 * sin(s->q1 + s->q2);
  const double f1 = torque + bs * (2 * s->w1 + s->w2) * s->w2 - G1 * sin(s->q1) - g2 -
                    PENDULUM_DAMPING * s->w1;
  const double f2 = -bs * s->w1 * s->w1 - g2 - PENDULUM_DAMPING * s->w2;
  const double det = M11 * M22 - M12 * M12;
  const pendulum d = {s->w1, s->w2, (M22 * f1 - M12 * f2) / det, (M11 * f2 - M12 * f1) / det};
  return d;
}

/* a + h b */
static inline pendulum pendulum_sum(const pendulum *a, double h, const pendulum *b)
{
  const pendulum sum = {a->q1 + h * b->q1, a->q2 + h * b->q2,
                        a->w1 + h * b->w1, a->w2 + h * b->w2};
  return sum;
}

/* Holds a torque for some seconds: classical Runge-Kutta steps. */
static inline void pendulum_advance(pendulum *s, double torque, double seconds)
{
  const double h = PENDULUM_TIMESTEP;
  int steps = (int)(seconds / h + 0.5);
  for (; steps > 0; steps--) {
    pendulum k1, k2, k3, k4, at;
    k1 = pendulum_derivative(s, torque);
    at = pendulum_sum(s, h / 2, &k1);
    k2 = pendulum_derivative(&at, torque);
    at = pendulum_sum(s, h / 2, &k2);
    k3 = pendulum_derivative(&at, torque);
    at = pendulum_sum(s, h, &k3);
    k4 = pendulum_derivative(&at, torque);
    *s = pendulum_sum(s, h / 6, &k1);
    *s = pendulum_sum(s, h / 3, &k2);
    *s = pendulum_sum(s, h / 3, &k3);
    *s = pendulum_sum(s, h / 6, &k4);
  }
}

/* Whether both links are within 30 degrees of straight up. */
static inline int pendulum_is_inverted(const pendulum *s)
{
  const double limit = cos(PENDULUM_PI / 6);
  return -cos(s->q1) >= limit && -cos(s->q1 + s->q2) >= limit;
}

#endif

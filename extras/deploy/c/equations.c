/* The equations of motion about upright (pendulum/dynamics.inc): M(q) q'' = torques - h. */
#include "regulator.c"

/* Entries of policy_plant (pendulum/equations.h): inertias, coupling, moments of gravity, dampings,
 * armature of joint 2. */
enum {
  POLICY_J1,
  POLICY_J2,
  POLICY_B,
  POLICY_G1,
  POLICY_G2,
  POLICY_D1,
  POLICY_D2,
  POLICY_A
};

typedef struct {
  float m11, m12, m22, det; /* kg m^2; kg^2 m^4 */
  float h1, h2;             /* velocity terms, gravity and damping, N m */
} policy_equations;

/* d (4): deviation from upright. */
static inline policy_equations policy_equations_at(const float *d) {
  const float *p = policy_plant;
  const float bc = p[POLICY_B] * cosf(d[1]), bs = p[POLICY_B] * sinf(d[1]);
  const float g1 = p[POLICY_G1] * sinf(d[0]), g2 = p[POLICY_G2] * sinf(d[0] + d[1]);
  policy_equations e;
  e.m11 = p[POLICY_J1] + p[POLICY_J2] + 2.0f * bc;
  e.m12 = p[POLICY_J2] + bc;
  e.m22 = p[POLICY_J2] + p[POLICY_A];
  e.det = p[POLICY_J1] * p[POLICY_J2] + p[POLICY_A] * (p[POLICY_J1] + p[POLICY_J2]) +
          bc * (2.0f * p[POLICY_A] - bc);
  e.h1 = p[POLICY_D1] * d[2] - bs * (2.0f * d[2] + d[3]) * d[3] - g1 - g2;
  e.h2 = p[POLICY_D2] * d[3] + bs * d[2] * d[2] - g2;
  return e;
}

/* The equations of motion about upright (pendulum/dynamics.inc): M(q) q'' = torques - h. */
#include "regulator.c"

typedef struct {
  float m11, m12, m22, det; /* kg m^2; kg^2 m^4 */
  float h1, h2;             /* velocity terms, gravity and damping, N m */
} policy_equations;

/* d (4): deviation from upright. */
static inline policy_equations policy_equations_at(const float *d) {
  const float *c = policy_plant; /* J1, J2, coupling, moments of gravity, dampings, armature */
  const float bc = c[2] * cosf(d[1]), bs = c[2] * sinf(d[1]);
  const float g2 = c[4] * sinf(d[0] + d[1]);
  policy_equations e;
  e.m11 = c[0] + c[1] + 2.0f * bc;
  e.m12 = c[1] + bc;
  e.m22 = c[1] + c[7];
  e.det = c[0] * c[1] + c[7] * (c[0] + c[1]) + bc * (2.0f * c[7] - bc);
  e.h1 = c[5] * d[2] - bs * (2.0f * d[2] + d[3]) * d[3] - c[3] * sinf(d[0]) - g2;
  e.h2 = c[6] * d[3] + bs * d[2] * d[2] - g2;
  return e;
}

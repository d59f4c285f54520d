/* Whether the regulator catches, by simulation (LqrCatch in control/lqr_catch.h). */
#include "equations.c"

/* d' P d; p (10): the upper triangle of P, row by row. */
static inline float policy_cost(const float *p, const float *d) {
  return p[0] * d[0] * d[0] + p[4] * d[1] * d[1] + p[7] * d[2] * d[2] + p[9] * d[3] * d[3] +
         2.0f * (d[0] * (p[1] * d[1] + p[2] * d[2] + p[3] * d[3]) +
                 d[1] * (p[5] * d[2] + p[6] * d[3]) + p[8] * d[2] * d[3]);
}

/* The derivative of a deviation by time, under a torque. */
static inline void policy_derivative(const float *d, float torque, float *rate) {
  const policy_equations e = policy_equations_at(d);
  const float r1 = (POLICY_ACTUATED_JOINT == 1 ? torque : 0.0f) - e.h1;
  const float r2 = (POLICY_ACTUATED_JOINT == 2 ? torque : 0.0f) - e.h2;
  rate[0] = d[2];
  rate[1] = d[3];
  rate[2] = (e.m22 * r1 - e.m12 * r2) / e.det;
  rate[3] = (e.m11 * r2 - e.m12 * r1) / e.det;
}

/* One control period with the torque held: POLICY_PHYSICS_STEPS Runge-Kutta steps. */
static inline void policy_advance(float *d, float torque) {
  const float h = POLICY_PERIOD / (float)POLICY_PHYSICS_STEPS;
  int step, i;
  for (step = 0; step < POLICY_PHYSICS_STEPS; step++) {
    float k1[4], k2[4], k3[4], k4[4], at[4];
    policy_derivative(d, torque, k1);
    for (i = 0; i < 4; i++) at[i] = d[i] + h / 2.0f * k1[i];
    policy_derivative(at, torque, k2);
    for (i = 0; i < 4; i++) at[i] = d[i] + h / 2.0f * k2[i];
    policy_derivative(at, torque, k3);
    for (i = 0; i < 4; i++) at[i] = d[i] + h * k3[i];
    policy_derivative(at, torque, k4);
    for (i = 0; i < 4; i++) d[i] += h / 6.0f * (k1[i] + 2.0f * (k2[i] + k3[i]) + k4[i]);
  }
}

/* Whether the regulator, from this deviation on, comes to where it is known to hold, within
 * POLICY_LOOK_AHEAD periods and with no link leaning further than 60 degrees: by simulating that.
 */
static inline int policy_catches(const float *deviation) {
  const float lean = 1.0471976f;
  float d[4];
  int i;
  for (i = 0; i < 4; i++) d[i] = deviation[i];
  for (i = 0; i < POLICY_LOOK_AHEAD; i++) {
    if (!(fabsf(d[0]) <= lean) || !(fabsf(d[0] + d[1]) <= lean)) return 0;
    if (policy_cost(policy_upright_cost, d) <= policy_region[0]) return 1;
    policy_advance(d, policy_limited(policy_regulator(d)));
  }
  return 0;
}

/* The equations of motion about upright (pendulum/dynamics.inc): M(q) q'' = torques - h. The
 * constants p of a plant are in the order of policy_plant. */

/* Entries of policy_plant (pendulum/equations.h): inertias, coupling, moments of gravity, dampings,
 * armature of joint 2, dry friction. */
enum {
  POLICY_J1,
  POLICY_J2,
  POLICY_B,
  POLICY_G1,
  POLICY_G2,
  POLICY_D1,
  POLICY_D2,
  POLICY_A,
  POLICY_F1,
  POLICY_F2,
  POLICY_PLANT_SIZE
};

typedef struct {
  float m11, m12, m22, det; /* kg m^2; kg^2 m^4 */
  float h1, h2;             /* velocity terms, gravity, damping and friction, N m */
} policy_equations;

/* d (4): deviation from upright. */
static inline policy_equations policy_equations_at(const float *p, const float *d) {
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
#ifdef POLICY_FRICTION_SLOPE
  e.h1 += p[POLICY_F1] * atanf(POLICY_FRICTION_SLOPE * d[2]);
  e.h2 += p[POLICY_F2] * atanf(POLICY_FRICTION_SLOPE * d[3]);
#endif
  return e;
}

/* The derivative of a deviation by time, under a torque. */
static inline void policy_derivative(const float *p, const float *d, float torque, float *rate) {
  const policy_equations e = policy_equations_at(p, d);
  const float r1 = (POLICY_ACTUATED_JOINT == 1 ? torque : 0.0f) - e.h1;
  const float r2 = (POLICY_ACTUATED_JOINT == 2 ? torque : 0.0f) - e.h2;
  rate[0] = d[2];
  rate[1] = d[3];
  rate[2] = (e.m22 * r1 - e.m12 * r2) / e.det;
  rate[3] = (e.m11 * r2 - e.m12 * r1) / e.det;
}

/* One control period with the torque held: POLICY_PHYSICS_STEPS Runge-Kutta steps. */
static inline void policy_advance(const float *p, float *d, float torque) {
  const float h = POLICY_PERIOD / (float)POLICY_PHYSICS_STEPS;
  int step, i;
  for (step = 0; step < POLICY_PHYSICS_STEPS; step++) {
    float k1[4], k2[4], k3[4], k4[4], at[4];
    policy_derivative(p, d, torque, k1);
    for (i = 0; i < 4; i++) at[i] = d[i] + h / 2.0f * k1[i];
    policy_derivative(p, at, torque, k2);
    for (i = 0; i < 4; i++) at[i] = d[i] + h / 2.0f * k2[i];
    policy_derivative(p, at, torque, k3);
    for (i = 0; i < 4; i++) at[i] = d[i] + h * k3[i];
    policy_derivative(p, at, torque, k4);
    for (i = 0; i < 4; i++) d[i] += h / 6.0f * (k1[i] + 2.0f * (k2[i] + k3[i]) + k4[i]);
  }
}

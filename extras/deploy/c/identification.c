/* Identification of the plant while it moves (pendulum/identification.h): a Kalman filter of seven
 * constants, relative to their nominal values, the first entries of policy_plant. */

typedef struct {
  float relative[7];    /* the estimates */
  float covariance[28]; /* of the estimates: the upper triangle, row by row */
  float last[4];        /* deviation from upright in the last call */
} policy_identifier;

/* Begins in a state, with the nominal plant. */
static inline void policy_begin(policy_identifier *id, const float *d) {
  int i;
  for (i = 0; i < 7; i++) id->relative[i] = 1.0f;
  for (i = 0; i < 28; i++) id->covariance[i] = policy_prior[i];
  for (i = 0; i < 4; i++) id->last[i] = d[i];
}

/* The place of entry (i, j) in the upper triangle. */
static inline int policy_place(int i, int j) {
  return i <= j ? 7 * i - i * (i - 1) / 2 + j - i : 7 * j - j * (j - 1) / 2 + i - j;
}

/* The constants of the estimated plant. */
static inline void policy_estimate(const policy_identifier *id, float *p) {
  int i;
  for (i = 0; i < POLICY_PLANT_SIZE; i++) p[i] = policy_plant[i] * (i < 7 ? id->relative[i] : 1.0f);
}

/* How much the relative constants lower the changes of w1 and w2 in a control period from one
 * deviation to another, by the equations of motion in its middle. */
static inline void policy_effects(const float *p, const float *from, const float *to, float *h1,
                                  float *h2) {
  const float w1 = (from[2] + to[2]) / 2.0f, w2 = (from[3] + to[3]) / 2.0f;
  const float a1 = (to[2] - from[2]) / POLICY_PERIOD, a2 = (to[3] - from[3]) / POLICY_PERIOD;
  float d[4], f1[7], f2[7], c2, s2;
  policy_equations e;
  int i;
  d[0] = from[0] + POLICY_PERIOD / 2.0f * w1;
  d[1] = from[1] + POLICY_PERIOD / 2.0f * w2;
  d[2] = w1;
  d[3] = w2;
  e = policy_equations_at(p, d);
  c2 = cosf(d[1]);
  s2 = sinf(d[1]);
  /* The torque at each joint for a constant of 1 (pendulum/regressor.h). */
  for (i = 0; i < 7; i++) f1[i] = f2[i] = 0.0f;
  f1[POLICY_J1] = a1;
  f1[POLICY_J2] = f2[POLICY_J2] = a1 + a2;
  f1[POLICY_B] = c2 * (2.0f * a1 + a2) - s2 * (2.0f * w1 + w2) * w2;
  f2[POLICY_B] = c2 * a1 + s2 * w1 * w1;
  f1[POLICY_G1] = -sinf(d[0]);
  f1[POLICY_G2] = f2[POLICY_G2] = -sinf(d[0] + d[1]);
  f1[POLICY_D1] = w1;
  f2[POLICY_D2] = w2;
  for (i = 0; i < 7; i++) {
    const float scale = -POLICY_PERIOD / e.det * policy_plant[i];
    h1[i] = scale * (e.m22 * f1[i] - e.m12 * f2[i]);
    h2[i] = scale * (e.m11 * f2[i] - e.m12 * f1[i]);
  }
}

/* The filter's update: a velocity changed by `surprise` more than was predicted. */
static inline void policy_correct(policy_identifier *id, const float *h, float surprise) {
  const float share = 0.3f * surprise; /* that counts as noise, too */
  float ph[7], spread = 0.0f;
  int i, j;
  for (i = 0; i < 7; i++) {
    ph[i] = 0.0f;
    for (j = 0; j < 7; j++) ph[i] += id->covariance[policy_place(i, j)] * h[j];
    spread += h[i] * ph[i];
  }
  if (spread < 0.0f) spread = 0.0f; /* by rounding */
  spread += POLICY_IDENTIFIED_NOISE * POLICY_IDENTIFIED_NOISE + share * share;
  for (i = 0; i < 7; i++) {
    id->relative[i] += ph[i] / spread * surprise;
    for (j = i; j < 7; j++) id->covariance[policy_place(i, j)] -= ph[i] * (ph[j] / spread);
  }
}

/* Keeps the estimates those of a pendulum. */
static inline void policy_bound(policy_identifier *id) {
  float p[POLICY_PLANT_SIZE], most;
  int i;
  for (i = 0; i < 7; i++) {
    if (id->relative[i] < 0.25f) id->relative[i] = 0.25f;
    if (id->relative[i] > 4.0f) id->relative[i] = 4.0f;
  }
  policy_estimate(id, p);
  most = sqrtf(0.9f * p[POLICY_J1] * p[POLICY_J2]) / policy_plant[POLICY_B];
  if (id->relative[POLICY_B] > most) id->relative[POLICY_B] = most;
}

/* Updates the estimates after a control period, from the torque that acted in it. */
static inline void policy_identify(policy_identifier *id, float torque, const float *d) {
  float p[POLICY_PLANT_SIZE], at[4], h1[7], h2[7], before[7], surprise;
  int i;
  policy_estimate(id, p);
  for (i = 0; i < 4; i++) at[i] = id->last[i];
  policy_advance(p, at, torque);
  policy_effects(p, id->last, d, h1, h2);
  for (i = 0; i < 4; i++) id->last[i] = d[i];
  for (i = 0; i < 7; i++) {
    before[i] = id->relative[i];
    /* They drift, which keeps the filter learning. */
    if (policy_plant[i] > 0.0f) id->covariance[policy_place(i, i)] += 1e-6f;
  }
  policy_correct(id, h1, d[2] - at[2]);
  surprise = d[3] - at[3];
  for (i = 0; i < 7; i++) surprise -= h2[i] * (id->relative[i] - before[i]);
  policy_correct(id, h2, surprise);
  policy_bound(id);
  /* Beyond the range of float it begins again. */
  if (!policy_all_finite(id->relative, 7) || !policy_all_finite(id->covariance, 28)) {
    policy_begin(id, d);
  }
}

/* The root at or below x, where the polynomial falls towards it, by Newton's method. */
static inline float policy_root(float x, float c4, float c3, float c2, float c1, float c0) {
  int i;
  for (i = 0; i < 50; i++) {
    const float value = (((c4 * x + c3) * x + c2) * x + c1) * x + c0;
    const float slope = ((4.0f * c4 * x + 3.0f * c3) * x + 2.0f * c2) * x + c1;
    const float step = value / slope;
    x -= step;
    if (!(fabsf(step) > 1e-6f * x)) break;
  }
  return x;
}

/* (zero - pole) / (zero + pole) of the joint without a motor (pendulum/upright_modes.h). */
static inline float policy_delta(const float *p) {
  const float j2 = p[POLICY_J2], g2 = p[POLICY_G2];
#if POLICY_ACTUATED_JOINT == 2
  const float inertia = p[POLICY_J1] + j2 + 2.0f * p[POLICY_B], d1 = p[POLICY_D1];
  const float pole =
      (sqrtf(d1 * d1 + 4.0f * inertia * (p[POLICY_G1] + g2)) - d1) / (2.0f * inertia);
  const float zero = sqrtf(g2 / (j2 + p[POLICY_B]));
  return (zero - pole) / (zero + pole);
#else
  const float inertia = j2 + p[POLICY_A], d2 = p[POLICY_D2];
  const float pole = (sqrtf(d2 * d2 + 4.0f * inertia * g2) - d2) / (2.0f * inertia);
  const float n12 = p[POLICY_B] - p[POLICY_A];
  return (d2 - pole * n12) / (d2 + pole * n12);
#endif
}

/* How the pendulum falls from upright (Falling in pendulum/upright_modes.h): zeta of both modes,
 * the faster one first, and the torque that stops both falls, over the motor's limit. */
static inline void policy_falling(const float *p, const float *d, float *zeta, float *torque) {
  const float q1 = d[0], q2 = policy_wrapped(d[0] + d[1]) - d[0], w1 = d[2], w2 = d[3];
  const float g2 = p[POLICY_G2], g = p[POLICY_G1] + g2, d1 = p[POLICY_D1], d2 = p[POLICY_D2];
  const float upright[4] = {0.0f, 0.0f, 0.0f, 0.0f};
  const policy_equations e = policy_equations_at(p, upright);
  /* The rates are roots of k4 x^4 + ... + k0. Without damping, their squares are of a quadratic. */
  const float k4 = e.det, k3 = e.m11 * d2 + e.m22 * d1;
  const float undamped = 2.0f * e.m12 * g2 - e.m11 * g2 - e.m22 * g, k2 = d1 * d2 + undamped;
  const float k1 = -d1 * g2 - d2 * g, k0 = p[POLICY_G1] * g2;
  float rates[2], c2, c1;
  int i;
  rates[0] = sqrtf((sqrtf(undamped * undamped - 4.0f * k4 * k0) - undamped) / (2.0f * k4));
  rates[0] = policy_root(rates[0], k4, k3, k2, k1, k0);
  c2 = k3 + rates[0] * k4;
  c1 = k2 + rates[0] * c2;
  rates[1] = policy_root(rates[0], 0.0f, k4, c2, c1, k1 + rates[0] * c1);
  for (i = 0; i < 2; i++) {
    const float r = rates[i];
    const float m1 = e.m11 * r + d1, m12 = e.m12 * r, m2 = e.m22 * r + d2;
    const float k11 = m1 * r - g, k12 = m12 * r - g2, k22 = m2 * r - g2;
    const int first = fabsf(k11) > fabsf(k22);
    const float y1 = first ? -k12 : k22, y2 = first ? k11 : -k12;
    const float z = y1 * (e.m11 * w1 + e.m12 * w2 + m1 * q1 + m12 * q2) +
                    y2 * (e.m12 * w1 + e.m22 * w2 + m12 * q1 + m2 * q2);
    zeta[i] = r * z / ((POLICY_ACTUATED_JOINT == 1 ? y1 : y2) * POLICY_MOTOR_LIMIT);
  }
  *torque = -2.0f * (rates[0] + rates[1]) / (rates[0] - rates[1]) * (zeta[0] - zeta[1]);
}

static inline float policy_within_one(float x) {
  if (x > 1.0f) return 1.0f;
  if (x < -1.0f) return -1.0f;
  return x;
}

/* The numbers (POLICY_IDENTIFIED_SIZE) that identification adds to the observation. */
static inline void policy_identified(const policy_identifier *id, const float *d, float *numbers) {
  float p[POLICY_PLANT_SIZE], zeta[2], torque, delta;
  policy_equations e;
  int i;
  policy_estimate(id, p);
  for (i = 0; i < 7; i++) numbers[i] = (id->relative[i] - 1.0f) / POLICY_IDENTIFIED_SCALE;
  delta = policy_delta(p);
  numbers[7] = policy_within_one(delta);
  numbers[8] = tanhf(0.1f / delta);
  /* The energy is 1 at rest upright, and 0 hanging. */
  e = policy_equations_at(p, d);
  numbers[9] =
      1.0f + ((e.m11 * d[2] * d[2] + 2.0f * e.m12 * d[2] * d[3] + e.m22 * d[3] * d[3]) / 2.0f -
              p[POLICY_G1] * (1.0f - cosf(d[0])) - p[POLICY_G2] * (1.0f - cosf(d[0] + d[1]))) /
                 (2.0f * (p[POLICY_G1] + p[POLICY_G2]));
  policy_falling(p, d, zeta, &torque);
  for (i = 0; i < 2; i++) numbers[10 + i] = zeta[i] / (1.0f + fabsf(zeta[i]));
  numbers[12] = policy_within_one(torque);
  /* Where the motor reaches no mode, they are infinite. */
  for (i = 7; i < POLICY_IDENTIFIED_SIZE; i++) {
    if (!policy_is_finite(numbers[i])) numbers[i] = 0.0f;
  }
}

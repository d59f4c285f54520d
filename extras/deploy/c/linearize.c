/* The derivatives of a control period of motion, along its Runge-Kutta steps. */

/* The derivative of a deviation by time, and those of both accelerations by the deviation (4) and
 * by the torque. */
static inline void policy_partials(const float *d, float torque, float *rate, float j[2][5]) {
  const float *p = policy_plant;
  const policy_equations e = policy_equations_at(p, d);
  const float c2 = cosf(d[1]), s2 = sinf(d[1]), bc = p[POLICY_B] * c2, bs = p[POLICY_B] * s2;
  const float w1 = d[2], w2 = d[3];
  const float g2 = p[POLICY_G2] * cosf(d[0] + d[1]), g1 = p[POLICY_G1] * cosf(d[0]) + g2;
  const float r1 = (POLICY_ACTUATED_JOINT == 1 ? torque : 0.0f) - e.h1;
  const float r2 = (POLICY_ACTUATED_JOINT == 2 ? torque : 0.0f) - e.h2;
  const float a1 = (e.m22 * r1 - e.m12 * r2) / e.det, a2 = (e.m11 * r2 - e.m12 * r1) / e.det;
  /* M da = d(torque - h) - dM a: its right side at each joint. */
  float side1[5], side2[5];
  int i;
  rate[0] = w1;
  rate[1] = w2;
  rate[2] = a1;
  rate[3] = a2;
  side1[0] = g1;
  side2[0] = g2;
  side1[1] = g2 + bc * (2.0f * w1 + w2) * w2 + bs * (2.0f * a1 + a2);
  side2[1] = g2 - bc * w1 * w1 + bs * a1;
  side1[2] = 2.0f * bs * w2 - p[POLICY_D1];
  side2[2] = -2.0f * bs * w1;
  side1[3] = 2.0f * bs * (w1 + w2);
  side2[3] = -p[POLICY_D2];
  side1[4] = POLICY_ACTUATED_JOINT == 1 ? 1.0f : 0.0f;
  side2[4] = POLICY_ACTUATED_JOINT == 2 ? 1.0f : 0.0f;
#ifdef POLICY_FRICTION_SLOPE
  {
    const float v1 = POLICY_FRICTION_SLOPE * w1, v2 = POLICY_FRICTION_SLOPE * w2;
    side1[2] -= p[POLICY_F1] * POLICY_FRICTION_SLOPE / (1.0f + v1 * v1);
    side2[3] -= p[POLICY_F2] * POLICY_FRICTION_SLOPE / (1.0f + v2 * v2);
  }
#endif
  for (i = 0; i < 5; i++) {
    j[0][i] = (e.m22 * side1[i] - e.m12 * side2[i]) / e.det;
    j[1][i] = (e.m11 * side2[i] - e.m12 * side1[i]) / e.det;
  }
}

/* A (4 x 4), the derivative of the deviation after a control period by that before it, and B (4),
 * that by the torque, as the columns of ab. */
static inline void policy_linearize(const float *x, float torque, float ab[4][5]) {
  const float h = POLICY_PERIOD / (float)POLICY_PHYSICS_STEPS;
  const float shares[4] = {0.0f, h / 2.0f, h / 2.0f, h}, weights[4] = {1.0f, 2.0f, 2.0f, 1.0f};
  float d[4];
  int step, stage, i, k;
  for (i = 0; i < 4; i++) {
    d[i] = x[i];
    for (k = 0; k < 5; k++) ab[i][k] = i == k ? 1.0f : 0.0f;
  }
  for (step = 0; step < POLICY_PHYSICS_STEPS; step++) {
    /* A stage's slope, and the sum of the slopes; those of the deviation and of its derivatives. */
    float slope[4], sum[4], slopes[4][5], sums[4][5];
    for (i = 0; i < 4; i++) {
      slope[i] = sum[i] = 0.0f;
      for (k = 0; k < 5; k++) slopes[i][k] = sums[i][k] = 0.0f;
    }
    for (stage = 0; stage < 4; stage++) {
      float at[4], ats[4][5], j[2][5];
      for (i = 0; i < 4; i++) {
        at[i] = d[i] + shares[stage] * slope[i];
        for (k = 0; k < 5; k++) ats[i][k] = ab[i][k] + shares[stage] * slopes[i][k];
      }
      policy_partials(at, torque, slope, j);
      for (k = 0; k < 5; k++) {
        slopes[0][k] = ats[2][k];
        slopes[1][k] = ats[3][k];
        for (i = 0; i < 2; i++) {
          slopes[2 + i][k] = j[i][0] * ats[0][k] + j[i][1] * ats[1][k] + j[i][2] * ats[2][k] +
                             j[i][3] * ats[3][k] + (k == 4 ? j[i][4] : 0.0f);
        }
      }
      for (i = 0; i < 4; i++) {
        sum[i] += weights[stage] * slope[i];
        for (k = 0; k < 5; k++) sums[i][k] += weights[stage] * slopes[i][k];
      }
    }
    for (i = 0; i < 4; i++) {
      d[i] += h / 6.0f * sum[i];
      for (k = 0; k < 5; k++) ab[i][k] += h / 6.0f * sums[i][k];
    }
  }
}

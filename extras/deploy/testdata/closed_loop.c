/* Episodes of an exported policy in a closed loop, for tests: reads rows of double from standard input,
 *
 *     J1 J2 b a G1 G2 d1 d2   constants of the plant (pendulum/equations.h)
 *     q1 q2 w1 w2             start of the episode
 *     up1 up2                 goal, 1 or 0 for each link
 *
 * and writes for each, as double, 1 if both links are within 30 degrees of the goal throughout the last
 * 10 of 20 s and 0 otherwise; then the time from which they are; then the number of calls that failed. */
#include <stdio.h>

#include "policy.h"

#define STEPS 1000 /* of 0.02 s */
#define PI 3.14159265358979323846
#ifdef POLICY_ACTUATED_JOINT
#define JOINT POLICY_ACTUATED_JOINT
#else
#define JOINT 1
#endif

enum { J1, J2, B, A, G1, G2, D1, D2, Q1, Q2, W1, W2, UP1, UP2, WIDTH };

static void rate_of(const double *p, const double *s, double torque, double *rate)
{
  const double bc = p[B] * cos(s[1]), bs = p[B] * sin(s[1]), g2 = p[G2] * sin(s[0] + s[1]);
  const double m11 = p[J1] + p[J2] + 2 * bc, m12 = p[J2] + bc, m22 = p[J2] + p[A];
  const double r1 = torque * (JOINT == 1) + bs * (2 * s[2] + s[3]) * s[3] - p[G1] * sin(s[0]) - g2 -
                    p[D1] * s[2];
  const double r2 = torque * (JOINT == 2) - bs * s[2] * s[2] - g2 - p[D2] * s[3];
  const double det = m11 * m22 - m12 * m12;
  rate[0] = s[2];
  rate[1] = s[3];
  rate[2] = (m22 * r1 - m12 * r2) / det;
  rate[3] = (m11 * r2 - m12 * r1) / det;
}

/* A control period of 0.02 s in Runge-Kutta steps of 0.005 s. */
static void advance(const double *p, double *s, double torque)
{
  const double h = 0.005;
  int step, i;
  for (step = 0; step < 4; step++) {
    double k1[4], k2[4], k3[4], k4[4], at[4];
    rate_of(p, s, torque, k1);
    for (i = 0; i < 4; i++) at[i] = s[i] + h / 2 * k1[i];
    rate_of(p, at, torque, k2);
    for (i = 0; i < 4; i++) at[i] = s[i] + h / 2 * k2[i];
    rate_of(p, at, torque, k3);
    for (i = 0; i < 4; i++) at[i] = s[i] + h * k3[i];
    rate_of(p, at, torque, k4);
    for (i = 0; i < 4; i++) s[i] += h / 6 * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]);
  }
}

/* Whether both links are within 30 degrees of the goal. */
static int is_there(const double *row, const double *s)
{
  const double turn1 = row[UP1] > 0 ? PI : 0.0, turn2 = row[UP2] > 0 ? PI : 0.0;
  return cos(s[0] - turn1) > sqrt(0.75) && cos(s[0] + s[1] - turn2) > sqrt(0.75);
}

int main(void)
{
  static policy_state state;
  double row[WIDTH];
  if (policy_selftest() != POLICY_OK) return 1;
  while (fread(row, sizeof(row), 1, stdin) == 1) {
    double s[4], result[3] = {0, 0, 0};
    int step, i, since = 0;
    for (i = 0; i < 4; i++) s[i] = row[Q1 + i];
    policy_init(&state);
#ifdef POLICY_GOAL_SIZE
    policy_goal(&state, row[UP1] > 0, row[UP2] > 0);
#endif
    for (step = 0; step < STEPS; step++) {
      float torque;
      if (policy_control(&state, (float)s[0], (float)s[1], (float)s[2], (float)s[3], &torque) !=
          POLICY_OK)
        result[2]++;
      advance(row, s, (double)torque);
      if (!is_there(row, s)) since = step + 1;
    }
    result[0] = since <= STEPS / 2;
    result[1] = since * 0.02;
    fwrite(result, sizeof(result), 1, stdout);
  }
  return 0;
}

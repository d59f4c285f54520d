/* The swing-ups by energy shaping and by partial feedback linearisation (control/swing_up.h). */
#include "catch.c"

/* Entries of policy_law_gains: of the angle, the velocity and the energy. */
enum { POLICY_KP, POLICY_KD, POLICY_KE };

/* The law of the swing-up. */
static inline float policy_law(const float *d) {
  const float kp = policy_law_gains[POLICY_KP], kd = policy_law_gains[POLICY_KD],
              ke = policy_law_gains[POLICY_KE];
  const float w1 = d[2], w2 = d[3];
  const policy_equations e = policy_equations_at(policy_plant, d);
  /* Above that of rest upright. */
  const float energy = 0.5f * (e.m11 * w1 * w1 + 2.0f * e.m12 * w1 * w2 + e.m22 * w2 * w2) -
                       policy_plant[POLICY_G1] * (1.0f - cosf(d[0])) -
                       policy_plant[POLICY_G2] * (1.0f - cosf(d[0] + d[1]));
#if POLICY_LAW == 'e'
  return -(kd * (e.m12 * e.h2 - e.m22 * e.h1) + e.det * (w1 + kp * d[0])) /
         (e.det * ke * energy + kd * e.m22);
#else
  const float acceleration = -kp * d[0] - kd * w1 - ke * energy * w1;
  return e.det / e.m22 * acceleration + e.h1 - e.m12 / e.m22 * e.h2;
#endif
}

static inline float policy_choose(policy_state *state, const float *d) {
  (void)state;
  return policy_catches(d) ? policy_regulator(d) : policy_law(d);
}

#include "controller.c"
#include "controller_test.c"

/* The swing-ups by energy shaping and by partial feedback linearisation (control/swing_up.h). */
#include "catch.c"

/* The law of the swing-up. */
static inline float policy_law(const float *d) {
  const float *c = policy_plant, *k = policy_law_gains;
  const float w1 = d[2], w2 = d[3];
  const float bc = c[2] * cosf(d[1]), bs = c[2] * sinf(d[1]);
  const float m11 = c[0] + c[1] + 2.0f * bc, m12 = c[1] + bc, m22 = c[1] + c[7];
  const float g2 = c[4] * sinf(d[0] + d[1]);
  const float h1 = -bs * (2.0f * w1 + w2) * w2 - c[3] * sinf(d[0]) - g2 + c[5] * w1;
  const float h2 = bs * w1 * w1 - g2 + c[6] * w2;
  /* Above that of rest upright. */
  const float energy = 0.5f * (m11 * w1 * w1 + 2.0f * m12 * w1 * w2 + m22 * w2 * w2) -
                       c[3] * (1.0f - cosf(d[0])) - c[4] * (1.0f - cosf(d[0] + d[1]));
#if POLICY_LAW == 'e'
  const float det = m11 * m22 - m12 * m12;
  return -(k[1] * (m12 * h2 - m22 * h1) + det * (w1 + k[0] * d[0])) /
         (det * k[2] * energy + k[1] * m22);
#else
  const float acceleration = -k[0] * d[0] - k[1] * w1 - k[2] * energy * w1;
  return (m11 - m12 * m12 / m22) * acceleration + h1 - m12 / m22 * h2;
#endif
}

static inline float policy_choose(policy_state *state, const float *d) {
  (void)state;
  return policy_catches(d) ? policy_regulator(d) : policy_law(d);
}

#include "controller.c"

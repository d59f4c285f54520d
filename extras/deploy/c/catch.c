/* Whether the regulator catches, by simulation (LqrCatch in control/lqr_catch.h). */
#include "regulator.c"
#include "equations.c"

/* d' P d; p (10): the upper triangle of P, row by row. */
static inline float policy_cost(const float *p, const float *d) {
  return p[0] * d[0] * d[0] + p[4] * d[1] * d[1] + p[7] * d[2] * d[2] + p[9] * d[3] * d[3] +
         2.0f * (d[0] * (p[1] * d[1] + p[2] * d[2] + p[3] * d[3]) +
                 d[1] * (p[5] * d[2] + p[6] * d[3]) + p[8] * d[2] * d[3]);
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
    policy_advance(policy_plant, d, policy_limited(policy_regulator(d)));
  }
  return 0;
}

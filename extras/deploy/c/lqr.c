/* The linear-quadratic regulator. */
#include "regulator.c"

static inline float policy_choose(policy_state *state, const float *d) {
  (void)state;
  return policy_regulator(d);
}

#include "controller.c"
#include "controller_test.c"

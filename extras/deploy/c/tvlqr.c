/* The tracking of a planned swing-up (TvlqrPolicy in control/tvlqr.h). */
#include "catch.c"

/* From that place of the plan (sign -1: of its mirror image) to a deviation from upright. */
static inline void policy_off_plan(const float *d, int step, float sign, float *off) {
  int i;
  for (i = 0; i < 4; i++) off[i] = d[i] - sign * policy_plan[4 * step + i];
  for (i = 0; i < 2; i++) off[i] = policy_wrapped(off[i]);
}

static inline float policy_cost_of_place(const float *d, int step, float sign) {
  float off[4];
  policy_off_plan(d, step, sign, off);
  return policy_cost(policy_plan_cost + 10 * step, off);
}

/* The next place of the plan, or where it costs least to be off it, if that is less than a quarter.
 * Of the mirror image the first place, hanging, is left out: it is the plan's own. */
static inline float policy_follow(policy_state *state, const float *d) {
  const float *k;
  float off[4], now = -1.0f, least = -1.0f, sign = 1.0f;
  int step = 0, i, mirrored;
  if (state->step >= 0) state->step++;
  if (state->step >= 0 && state->step < POLICY_PLAN_STEPS) {
    now = policy_cost_of_place(d, state->step, state->sign);
  }
  for (mirrored = 0; mirrored < 2; mirrored++) {
    for (i = mirrored; i < POLICY_PLAN_STEPS; i++) {
      const float there = policy_cost_of_place(d, i, mirrored ? -1.0f : 1.0f);
      if (least >= 0.0f && there >= least) continue;
      least = there;
      step = i;
      sign = mirrored ? -1.0f : 1.0f;
    }
  }
  if (now < 0.0f || least < 0.25f * now) {
    state->step = step;
    state->sign = sign;
  }
  policy_off_plan(d, state->step, state->sign, off);
  k = policy_plan_gain + 4 * state->step;
  return state->sign * policy_plan_torque[state->step] -
         (k[0] * off[0] + k[1] * off[1] + k[2] * off[2] + k[3] * off[3]);
}

static inline float policy_choose(policy_state *state, const float *d) {
  if (!policy_catches(d)) return policy_follow(state, d);
  state->step = POLICY_PLAN_STEPS;
  state->sign = 1.0f;
  return policy_regulator(d);
}

#include "controller.c"
#include "controller_test.c"

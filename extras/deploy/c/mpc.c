/* Model predictive control (control/mpc.h): each call improves the plan of the call before it. */
#include "regulator.c"
#include "equations.c"
#include "linearize.c"
#include "trajectory.c"

/* Makes the plan from the start under its torques, without feedback. */
static inline void policy_plain(policy_state *s, const float *start) {
  int t, i;
  for (t = 0; t < POLICY_HORIZON; t++) {
    s->change[t] = 0.0f;
    for (i = 0; i < 4; i++) s->x[t][i] = s->feedback[t][i] = 0.0f;
  }
  policy_follow(s, start, 0.0f, POLICY_NO_COST, 1);
}

/* The first plan of an episode, before its improvement: the cheapest one that constant torques lead
 * to. */
static inline void policy_first_plan(policy_state *s, const float *start) {
  int t;
#if POLICY_GUESSES > 1
  float least = 0.0f;
  int guess;
  for (guess = 0; guess < POLICY_GUESSES; guess++) {
    const float share = 2.0f * (float)guess / (float)(POLICY_GUESSES - 1) - 1.0f;
    for (t = 0; t < POLICY_HORIZON; t++) s->u[t] = share * POLICY_TORQUE_LIMIT;
    policy_plain(s, start);
    policy_improve(s, 1e-6f, POLICY_FIRST_ITERATIONS);
    if (guess > 0 && !(s->cost < least)) continue;
    least = s->cost;
    for (t = 0; t < POLICY_HORIZON; t++) s->best[t] = s->u[t];
  }
  for (t = 0; t < POLICY_HORIZON; t++) s->u[t] = s->best[t];
#else
  for (t = 0; t < POLICY_HORIZON; t++) s->u[t] = 0.0f;
#endif
  policy_plain(s, start);
}

/* The plan one control period later, from there on; the regulator chooses its new last torque. */
static inline void policy_next_plan(policy_state *s, const float *start) {
  const int last = POLICY_HORIZON - 1;
  float d[4];
  int t, i;
  for (i = 0; i < 4; i++) {
    d[i] = s->x[POLICY_HORIZON][i];
    if (i < 2) d[i] = policy_turned(d[i]);
  }
  for (t = 0; t < last; t++) {
    s->u[t] = s->u[t + 1];
    for (i = 0; i < 4; i++) s->feedback[t][i] = s->feedback[t + 1][i];
  }
  for (t = 0; t <= last; t++) {
    for (i = 0; i < 4; i++) s->x[t][i] = s->x[t + 1][i];
  }
  s->u[last] = policy_regulator(d);
  for (i = 0; i < 4; i++) s->feedback[last][i] = -policy_gain[i];
  policy_follow(s, start, 0.0f, POLICY_NO_COST, 1);
}

/* The torque of the improved plan; d (4): deviation from upright. */
static inline float policy_choose(policy_state *s, const float *d) {
  const int first = !s->planned;
  float start[4], u;
  int i;
  for (i = 0; i < 4; i++) start[i] = d[i];
  if (first) {
#ifdef POLICY_LARGEST_UPRIGHT1
    if (start[0] > 0.0f) start[0] -= 6.2831853f; /* full turns count from hanging */
#endif
    policy_first_plan(s, start);
  } else {
    /* Count full turns as the plan does. */
    for (i = 0; i < 2; i++) start[i] = s->x[1][i] + policy_turned(d[i] - s->x[1][i]);
    policy_next_plan(s, start);
  }
  if (policy_follow(s, start, POLICY_REGULATED, s->cost, 0) < s->cost) {
    policy_follow(s, start, POLICY_REGULATED, POLICY_NO_COST, 1);
  }
  policy_improve(s, first ? 1e-6f : 0.0f, first ? POLICY_FIRST_ITERATIONS : POLICY_ITERATIONS);
  s->planned = s->cost < POLICY_NO_COST;
  u = s->u[0];
#ifdef POLICY_BRAKE_VELOCITY
  {
    /* A fall may be faster than a few iterations can plan: brake the motor's joint. */
    const float w = POLICY_ACTUATED_JOINT == 1 ? d[2] : d[3];
    float share = 3.0f * (1.0f - fabsf(w) / POLICY_BRAKE_VELOCITY);
    if (share > 1.0f) share = 1.0f;
    if (share < -1.0f) share = -1.0f;
    if (u * w > 0.0f) u *= share;
  }
#endif
  return u;
}

#include "controller.c"

static inline int policy_near(float value, float expected, float tolerance) {
  return fabsf(value - expected) <= tolerance;
}

/* Whether a sample has the program's results: an iteration from no torque, a call after it, and the
 * regulator near upright. */
static inline int policy_fits(policy_state *s, int sample) {
  const float *x = policy_sample_states + 4 * sample;
  const float *costs = policy_sample_costs + 2 * sample;
  const float *torques = policy_sample_torques + 2 * sample;
  float d[4], result;
  int t, i;
  policy_deviation(x[0], x[1], x[2], x[3], d);
  for (t = 0; t < POLICY_HORIZON; t++) s->u[t] = 0.0f;
  policy_plain(s, d);
  policy_improve(s, 0.0f, 1);
  if (!policy_near(s->cost, costs[0], POLICY_COST_TOLERANCE * costs[0])) return 0;
  if (!policy_near(s->u[0], torques[0], POLICY_TORQUE_TOLERANCE)) return 0;
  s->planned = 1;
  result = policy_choose(s, policy_sample_next + 4 * sample);
  if (!policy_near(result, torques[1], POLICY_TORQUE_TOLERANCE)) return 0;
  for (i = 0; i < 4; i++) d[i] *= POLICY_HELD_SHARE;
  result = policy_follow(s, d, POLICY_REGULATED, POLICY_NO_COST, 1);
  return policy_near(result, costs[1], POLICY_COST_TOLERANCE * costs[1]);
}

/* Whether all constants are as they were written, and this machine computes what Upswing does. The
 * state is on the stack. */
static inline policy_status policy_selftest(void) {
  policy_state state;
  int sample, others = 0;
  if (policy_checksum_of_all() != POLICY_CHECKSUM) return POLICY_DAMAGED;
  for (sample = 0; sample < POLICY_SAMPLES; sample++) {
    if (!policy_fits(&state, sample)) others++;
  }
  /* Rounding may choose another step of the search in some; wrong arithmetic shows in all. */
  return others > POLICY_SAMPLES / 2 ? POLICY_DAMAGED : POLICY_OK;
}

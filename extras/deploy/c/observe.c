/* The observation of the double pendulum: pendulum/task.h and pendulum/observation.h in C. */

#ifdef POLICY_MEMORY_SIZE
/* What the past steps did, the latest first. */
static inline void policy_remember(policy_state *state, float w1, float w2) {
  int i;
  if (state->running) {
    for (i = POLICY_MEMORY_SIZE - 1; i >= 3; i--) state->memory[i] = state->memory[i - 3];
    state->memory[0] = (w1 - state->w1) / POLICY_MEMORY_VELOCITY;
    state->memory[1] = (w2 - state->w2) / POLICY_MEMORY_VELOCITY;
    state->memory[2] = state->torque / POLICY_MEMORY_TORQUE;
  }
  state->w1 = w1;
  state->w2 = w2;
}
#endif

/* The observation of these angles and velocities: the state, the identified plant, the goal, the
 * memory. */
static inline void policy_observe(policy_state *state, float q1, float q2, float w1, float w2,
                                  float *observation) {
  const float *k = policy_energy;
  const float c1 = cosf(q1), s1 = sinf(q1), c2 = cosf(q2), s2 = sinf(q2);
  const float c12 = c1 * c2 - s1 * s2; /* cos(q1 + q2) */
  const float w12 = w1 + w2;
#ifdef POLICY_MEMORY_SIZE
  int i;
#endif
  observation[0] = c1;
  observation[1] = s1;
  observation[2] = w1 / POLICY_MAX_VELOCITY1;
  observation[3] = c2;
  observation[4] = s2;
  observation[5] = w2 / POLICY_MAX_VELOCITY2;
  /* Kinetic and potential energy: 0 hanging at rest, 1 upright at rest. */
  observation[6] =
      0.5f + k[0] * w1 * w1 + k[1] * w12 * w12 + k[2] * c2 * w1 * w12 + k[3] * c1 + k[4] * c12;
  /* Height of the tip over the pivot, -1 to 1. */
  observation[7] = -k[5] * c1 - k[6] * c12;
#ifdef POLICY_IDENTIFIED_SIZE
  {
    float d[4];
    policy_deviation(q1, q2, w1, w2, d);
    if (state->running) policy_identify(&state->identifier, state->torque, d);
    if (!state->running) policy_begin(&state->identifier, d);
    policy_identified(&state->identifier, d, observation + 8);
  }
#endif
#ifdef POLICY_GOAL_SIZE
  observation[POLICY_GOAL_AT] = state->down1 ? -1.0f : 1.0f;
  observation[POLICY_GOAL_AT + 1] = state->down2 ? -1.0f : 1.0f;
#endif
#ifdef POLICY_MEMORY_SIZE
  policy_remember(state, w1, w2);
  for (i = 0; i < POLICY_MEMORY_SIZE; i++) observation[POLICY_MEMORY_AT + i] = state->memory[i];
#endif
#ifdef POLICY_HAS_PAST
  state->running = 1;
#endif
  (void)state;
}

/* Writes the observation of a sample, which follows the sample before it. Returns whether it is the
 * program's. */
static inline int policy_observe_sample(policy_state *state, int sample, float *observation) {
  const float *x = policy_sample_states + 4 * sample;
#ifdef POLICY_GOAL_SIZE
  policy_goal(state, sample % 4 < 2, sample % 2 == 0);
#endif
  policy_observe(state, x[0], x[1], x[2], x[3], observation);
#ifdef POLICY_IDENTIFIED_SIZE
  {
    /* The network then gets the program's numbers, so that its outputs test only the network. */
    const float *expected = policy_sample_identified + POLICY_IDENTIFIED_SIZE * sample;
    int i;
    for (i = 0; i < POLICY_IDENTIFIED_SIZE; i++) {
      const float error = observation[8 + i] - expected[i];
      if (!(fabsf(error) <= POLICY_IDENTIFIED_TOLERANCE)) return 0;
      observation[8 + i] = expected[i];
    }
  }
#endif
  return 1;
}

/* The torque for these angles and velocities, to be called every POLICY_PERIOD seconds. */
static inline policy_status policy_control(policy_state *state, float q1, float q2, float w1,
                                           float w2, float *torque) {
  float observation[POLICY_OBSERVATION_SIZE];
  policy_status status;
  if (!torque) return POLICY_NULL_POINTER;
  *torque = 0.0f;
  if (!state) return POLICY_NULL_POINTER;
  policy_observe(state, q1, q2, w1, w2, observation);
  status = policy_control_observation(observation, torque);
  state->torque = *torque;
  if (status != POLICY_OK) policy_forget(state);
  return status;
}

#include "network_test.c"

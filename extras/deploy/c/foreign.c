/* A network for the observations of an environment. */
#include "network.c"

/* A sample is an observation. */
static inline void policy_observe_sample(policy_state *state, const float *x, float *observation) {
  int i;
  for (i = 0; i < POLICY_STATE_SIZE; i++) observation[i] = x[i];
  (void)state;
}

/* The action for an observation (POLICY_OBSERVATION_SIZE), to be called in every step. */
static inline policy_status policy_control(policy_state *state, const float *observation,
                                           float *action) {
  policy_status status;
  if (!action) return POLICY_NULL_POINTER;
  *action = 0.0f;
  if (!state) return POLICY_NULL_POINTER;
  status = policy_control_observation(observation, action);
  state->torque = *action;
  if (status != POLICY_OK) policy_init(state);
  return status;
}

#include "network_test.c"

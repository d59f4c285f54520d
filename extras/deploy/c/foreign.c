/* A network for the observations of an environment. */
#include "numbers.c"
#include "network.c"

/* Writes the observation of a sample. Returns whether it is the program's: here it is the sample.
 */
static inline int policy_observe_sample(policy_state *state, int sample, float *observation) {
  int i;
  for (i = 0; i < POLICY_STATE_SIZE; i++) {
    observation[i] = policy_sample_states[POLICY_STATE_SIZE * sample + i];
  }
  (void)state;
  return 1;
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
  if (status != POLICY_OK) policy_forget(state);
  return status;
}

#include "network_test.c"

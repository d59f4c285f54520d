/* A network for Gymnasium's Acrobot-v1. */
#include "network.c"

/* The observation of these angles and velocities. */
static inline void policy_observe(policy_state *state, float theta1, float theta2, float omega1,
                                  float omega2, float *observation) {
  observation[0] = cosf(theta1);
  observation[1] = sinf(theta1);
  observation[2] = cosf(theta2);
  observation[3] = sinf(theta2);
  observation[4] = omega1;
  observation[5] = omega2;
  (void)state;
}

static inline void policy_observe_sample(policy_state *state, const float *x, float *observation) {
  policy_observe(state, x[0], x[1], x[2], x[3], observation);
}

/* The torque for these angles and velocities, to be called every POLICY_PERIOD seconds. */
static inline policy_status policy_control(policy_state *state, float theta1, float theta2,
                                           float omega1, float omega2, float *torque) {
  float observation[POLICY_OBSERVATION_SIZE];
  policy_status status;
  if (!torque) return POLICY_NULL_POINTER;
  *torque = 0.0f;
  if (!state) return POLICY_NULL_POINTER;
  policy_observe(state, theta1, theta2, omega1, omega2, observation);
  status = policy_control_observation(observation, torque);
  state->torque = *torque;
  if (status != POLICY_OK) policy_init(state);
  return status;
}

#include "network_test.c"

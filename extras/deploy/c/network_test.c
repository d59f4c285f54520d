/* Ends the export of a network. */
/* Whether all constants are as they were written, and this machine computes what Upswing does. */
static inline policy_status policy_selftest(void) {
  policy_state state;
  int sample;
  if (policy_checksum_of_all() != POLICY_CHECKSUM) return POLICY_DAMAGED;
  policy_init(&state);
  for (sample = 0; sample < POLICY_SAMPLES; sample++) {
    const float *expected = policy_sample_outputs + POLICY_OUTPUT_SIZE * sample;
    float observation[POLICY_OBSERVATION_SIZE], outputs[POLICY_OUTPUT_SIZE];
    float error;
    int i;
    if (!policy_observe_sample(&state, sample, observation)) return POLICY_DAMAGED;
    policy_outputs(observation, outputs);
    if (!policy_all_finite(outputs, POLICY_OUTPUT_SIZE)) return POLICY_DAMAGED;
    for (i = 0; i < POLICY_OUTPUT_SIZE; i++) {
      error = outputs[i] - expected[i];
      if (fabsf(error) > POLICY_OUTPUT_TOLERANCE) return POLICY_DAMAGED;
    }
    error = policy_choose(outputs) - policy_sample_torques[sample];
    if (fabsf(error) > POLICY_TORQUE_TOLERANCE) return POLICY_DAMAGED;
    state.torque = policy_sample_torques[sample];
  }
  return POLICY_OK;
}

/* Ends the export of a controller whose torque follows from its state. */
/* Whether all constants are as they were written, and this machine computes what Upswing does. */
static inline policy_status policy_selftest(void) {
  int sample;
  if (policy_checksum_of_all() != POLICY_CHECKSUM) return POLICY_DAMAGED;
  for (sample = 0; sample < POLICY_SAMPLES; sample++) {
    const float *x = policy_sample_states + 4 * sample;
    policy_state state;
    float torque;
    policy_init(&state);
    if (policy_control(&state, x[0], x[1], x[2], x[3], &torque) != POLICY_OK) return POLICY_DAMAGED;
    torque -= policy_sample_torques[sample];
    if (!(fabsf(torque) <= POLICY_TORQUE_TOLERANCE)) return POLICY_DAMAGED;
#ifdef POLICY_LOOK_AHEAD
    /* In floats a step is off by up to 5e-7 rad and rad/s with the usual plant, and by 2e-5 with
     * links of unlike lengths. */
    {
      float d[4];
      int i;
      policy_deviation(x[0], x[1], x[2], x[3], d);
      policy_advance(policy_plant, d, policy_sample_torques[sample]);
      for (i = 0; i < 4; i++) {
        d[i] -= policy_sample_steps[4 * sample + i];
        if (!(fabsf(d[i]) <= 1e-4f)) return POLICY_DAMAGED;
      }
    }
#endif
  }
  return POLICY_OK;
}

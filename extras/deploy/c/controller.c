/* Ends the export of a controller. */
/* Forgets all: for the beginning, and after any pause. */
static inline void policy_init(policy_state *state) {
  if (!state) return;
  state->torque = 0.0f;
#ifdef POLICY_PLAN_STEPS
  state->step = -1;
  state->sign = 1.0f;
#endif
}

/* The torque for these angles and velocities, to be called every POLICY_PERIOD seconds. */
static inline policy_status policy_control(policy_state *state, float q1, float q2, float w1,
                                           float w2, float *torque) {
  float d[4], u;
  if (!torque) return POLICY_NULL_POINTER;
  *torque = 0.0f;
  if (!state) return POLICY_NULL_POINTER;
  policy_deviation(q1, q2, w1, w2, d);
  if (policy_all_finite(d, 4)) {
    u = policy_limited(policy_choose(state, d));
    if (policy_is_finite(u)) {
      *torque = u;
      state->torque = u;
      return POLICY_OK;
    }
  }
  policy_init(state);
  return POLICY_NOT_FINITE;
}

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

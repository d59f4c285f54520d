/* The call of a controller. */
/* Forgets all: for the beginning, and after any pause. */
static inline void policy_init(policy_state *state) {
  if (!state) return;
  state->torque = 0.0f;
#ifdef POLICY_PLAN_STEPS
  state->step = -1;
  state->sign = 1.0f;
#endif
#ifdef POLICY_HORIZON
  state->planned = 0;
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

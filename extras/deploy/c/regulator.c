/* Begins the export of a controller. */
#include "numbers.c"

typedef struct {
  float torque; /* N m, the last one */
#ifdef POLICY_PLAN_STEPS
  int step;   /* of the plan; -1: not begun */
  float sign; /* -1: on the plan's mirror image */
#endif
} policy_state;

static inline float policy_limited(float torque) {
  if (torque > POLICY_TORQUE_LIMIT) return POLICY_TORQUE_LIMIT;
  if (torque < -POLICY_TORQUE_LIMIT) return -POLICY_TORQUE_LIMIT;
  return torque;
}

/* d (4): deviation from upright at rest, the angles from -pi to pi. */
static inline void policy_deviation(float q1, float q2, float w1, float w2, float *d) {
  d[0] = atan2f(-sinf(q1), -cosf(q1));
  d[1] = atan2f(sinf(q2), cosf(q2));
  d[2] = w1;
  d[3] = w2;
}

/* The linear-quadratic regulator: -K d. */
static inline float policy_regulator(const float *d) {
  const float *k = policy_gain;
  return -(k[0] * d[0] + k[1] * d[1] + k[2] * d[2] + k[3] * d[3]);
}

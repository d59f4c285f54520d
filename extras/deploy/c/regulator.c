/* Begins the export of a controller. */
#include "numbers.c"
#include "deviation.c"

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

/* The linear-quadratic regulator: -K d. */
static inline float policy_regulator(const float *d) {
  const float *k = policy_gain;
  return -(k[0] * d[0] + k[1] * d[1] + k[2] * d[2] + k[3] * d[3]);
}

/* Begins the export of a controller. */
#include "numbers.c"
#include "deviation.c"

typedef struct {
  float torque; /* N m, the last one */
#ifdef POLICY_PLAN_STEPS
  int step;   /* of the plan; -1: not begun */
  float sign; /* -1: on the plan's mirror image */
#endif
#ifdef POLICY_HORIZON
  int planned;                       /* whether there is a plan, from the last call */
  float cost;                        /* of the plan */
  float x[POLICY_HORIZON + 1][4];    /* its deviations from upright; angles count full turns */
  float u[POLICY_HORIZON];           /* its torques, N m */
  float feedback[POLICY_HORIZON][4]; /* N m/rad, N m s/rad */
  float change[POLICY_HORIZON];      /* of the torques, by an iteration, N m */
#if POLICY_GUESSES > 1
  float best[POLICY_HORIZON]; /* torques of the cheapest first plan, N m */
#endif
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

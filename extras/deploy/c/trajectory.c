/* Trajectory optimisation with a limited torque (control/trajectory.h). It improves the plan in the
 * state. All states of a plan are deviations from upright, whose angles count full turns. */

/* A cost that no plan has. */
#define POLICY_NO_COST 3e38f

/* An angle without its full turns. */
static inline float policy_turned(float angle) {
  return angle - 6.2831853f * rintf(angle / 6.2831853f);
}

/* x (4) as a deviation from the upright that is its goal. */
static inline void policy_from_goal(const float *x, float *d) {
  int i;
  for (i = 0; i < 4; i++) d[i] = i < 2 ? policy_turned(x[i]) : x[i];
#ifdef POLICY_LARGEST_UPRIGHT1
  {
    const float most[2] = {POLICY_LARGEST_UPRIGHT1, POLICY_LARGEST_UPRIGHT2};
    for (i = 0; i < 2; i++) {
      const float upright = x[i] - d[i] + (i == 0 ? 3.1415927f : 0.0f);
      if (upright > most[i]) d[i] += upright - most[i];
      if (upright < -most[i]) d[i] += upright + most[i];
    }
  }
#endif
}

/* The cost of a control period, and that of the end: d' P d. */
static inline float policy_running_cost(const float *x, float u) {
  const float *q = policy_weights;
  float d[4];
  policy_from_goal(x, d);
  return q[0] * d[0] * d[0] + q[1] * d[1] * d[1] + q[2] * d[2] * d[2] + q[3] * d[3] * d[3] +
         q[4] * u * u;
}

static inline float policy_final_cost(const float *x) {
  float d[4], cost = 0.0f;
  int i, k;
  policy_from_goal(x, d);
  for (i = 0; i < 4; i++) {
    for (k = 0; k < 4; k++) cost += policy_end_cost[4 * i + k] * d[i] * d[k];
  }
  return cost;
}

/* The torque of a step: that of the plan with a share of its change and the feedback. */
static inline float policy_planned(const policy_state *s, int t, const float *x, float share) {
  float u = s->u[t] + share * s->change[t];
  int i;
  for (i = 0; i < 4; i++) u += s->feedback[t][i] * (x[i] - s->x[t][i]);
  return policy_limited(u);
}

/* The torque with which the regulator holds the upright nearest to the start. */
static inline float policy_held(const float *start, const float *x) {
  float d[4];
  int i;
  for (i = 0; i < 4; i++) d[i] = i < 2 ? x[i] - (start[i] - policy_turned(start[i])) : x[i];
  return policy_limited(policy_regulator(d));
}

/* In place of a share of the change: the regulator. */
#define POLICY_REGULATED -1.0f

/* The cost from a start, with a share of the plan's change or with the regulator. It stops where it
 * reaches a bound, which it then returns. With `keep` it becomes the plan, whatever it costs. */
static inline float policy_follow(policy_state *s, const float *start, float share, float bound,
                                  int keep) {
  float from[4], x[4], cost = 0.0f;
  int t, i;
  for (i = 0; i < 4; i++) from[i] = x[i] = start[i];
  for (t = 0; t < POLICY_HORIZON; t++) {
    const float u = share < 0.0f ? policy_held(from, x) : policy_planned(s, t, x, share);
    cost += policy_running_cost(x, u);
    if (!keep && !(cost < bound)) return bound;
    if (keep) {
      for (i = 0; i < 4; i++) s->x[t][i] = x[i];
      s->u[t] = u;
    }
    policy_advance(policy_plant, x, u);
  }
  cost += policy_final_cost(x);
  if (!policy_is_finite(cost)) cost = bound;
  if (keep) {
    for (i = 0; i < 4; i++) s->x[POLICY_HORIZON][i] = x[i];
    s->cost = cost;
  }
  return cost;
}

/* Brings the derivatives v (4) and second derivatives vv (4 x 4) of the cost over a step with the
 * derivatives ab. With F = A + B K:
 *   V <- lx + K' (lu + luu k) + F' (V + VV B k),  VV <- lxx + luu K' K + F' VV F */
static inline void policy_cost_before(const policy_state *s, int t, float ab[4][5], float *v,
                                      float vv[4][4]) {
  const float luu = 2.0f * policy_weights[4], lu = luu * s->u[t];
  const float *feedback = s->feedback[t];
  float d[4], before[4], vf[4][4];
  int i, k, n;
  policy_from_goal(s->x[t], d);
  for (i = 0; i < 4; i++) {
    for (n = 0; n < 4; n++) v[i] += vv[i][n] * ab[n][4] * s->change[t];
  }
  for (i = 0; i < 4; i++) {
    for (k = 0; k < 4; k++) ab[i][k] += ab[i][4] * feedback[k];
  }
  for (i = 0; i < 4; i++) {
    for (k = 0; k < 4; k++) {
      vf[i][k] = 0.0f;
      for (n = 0; n < 4; n++) vf[i][k] += vv[i][n] * ab[n][k];
    }
  }
  for (i = 0; i < 4; i++) {
    before[i] = 2.0f * policy_weights[i] * d[i] + feedback[i] * (lu + luu * s->change[t]);
    for (k = 0; k < 4; k++) before[i] += ab[k][i] * v[k];
    for (k = 0; k <= i; k++) {
      float sum = luu * feedback[i] * feedback[k];
      if (i == k) sum += 2.0f * policy_weights[i];
      for (n = 0; n < 4; n++) sum += ab[n][i] * vf[n][k];
      vv[i][k] = vv[k][i] = sum;
    }
  }
  for (i = 0; i < 4; i++) v[i] = before[i];
}

/* One step of the backward pass: the change and the feedback of a torque, then policy_cost_before.
 * Returns 0 if the cost curves down along the torque. */
static inline int policy_back(policy_state *s, int t, float regularization, float *v,
                              float vv[4][4]) {
  const float u = s->u[t], luu = 2.0f * policy_weights[4];
  const float low = -POLICY_TORQUE_LIMIT - u, high = POLICY_TORQUE_LIMIT - u;
  float ab[4][5], towards[4], qu = luu * u;
  float curvature = luu + regularization * policy_units[1];
  int i, k;
  policy_linearize(s->x[t], u, ab);
  /* Regularisation acts like a cost of changing the torque and the next state. */
  for (i = 0; i < 4; i++) {
    towards[i] = regularization * (i < 2 ? 1.0f : policy_units[0]) * ab[i][4];
    for (k = 0; k < 4; k++) towards[i] += vv[i][k] * ab[k][4];
    qu += ab[i][4] * v[i];
    curvature += ab[i][4] * towards[i];
  }
  if (!(curvature > 0.0f)) return 0;
  s->change[t] = -qu / curvature;
  if (s->change[t] <= low) {
    s->change[t] = low;
  } else if (s->change[t] >= high) {
    s->change[t] = high;
  } else {
    for (i = 0; i < 4; i++) {
      for (k = 0; k < 4; k++) s->feedback[t][i] -= towards[k] * ab[k][i] / curvature;
    }
  }
  policy_cost_before(s, t, ab, v, vv);
  return 1;
}

/* The backward pass: the changes and the feedback of the plan. */
static inline int policy_backward(policy_state *s, float regularization) {
  float d[4], v[4], vv[4][4];
  int t, i, k;
  for (t = 0; t < POLICY_HORIZON; t++) {
    s->change[t] = 0.0f;
    for (i = 0; i < 4; i++) s->feedback[t][i] = 0.0f;
  }
  policy_from_goal(s->x[POLICY_HORIZON], d);
  for (i = 0; i < 4; i++) {
    v[i] = 0.0f;
    for (k = 0; k < 4; k++) {
      vv[i][k] = 2.0f * policy_end_cost[4 * i + k];
      v[i] += vv[i][k] * d[k];
    }
  }
  for (t = POLICY_HORIZON - 1; t >= 0; t--) {
    if (!policy_back(s, t, regularization, v, vv)) return 0;
  }
  return 1;
}

/* The forward pass: replaces the plan by the cheapest of eight shares of the change if that costs
 * less, or else of the next eight. The 16 shares are 1.1^(-n^2). */
static inline int policy_forward(policy_state *s) {
  float share = 1.0f, ratio = 1.0f / 1.1f, least = s->cost, best = 0.0f;
  int trial;
  for (trial = 0; trial < 16; trial++) {
    const float cost = policy_follow(s, s->x[0], share, least, 0);
    if (cost < least) {
      least = cost;
      best = share;
    }
    if (trial % 8 == 7 && best > 0.0f) break;
    share *= ratio;
    ratio *= 1.0f / 1.21f;
  }
  if (!(best > 0.0f)) return 0;
  policy_follow(s, s->x[0], best, POLICY_NO_COST, 1);
  return 1;
}

/* Improves the plan. Stops when an iteration gains less than `tolerance` times the cost. */
static inline void policy_improve(policy_state *s, float tolerance, int iterations) {
  float regularization = 1e-3f;
  int i;
  for (i = 0; i < iterations && regularization < 1e10f; i++) {
    const float before = s->cost;
    if (policy_backward(s, regularization) && policy_forward(s)) {
      regularization = regularization > 4e-6f ? regularization / 4.0f : 1e-6f;
      if (before - s->cost < tolerance * before) return;
    } else {
      regularization *= 4.0f;
    }
  }
}

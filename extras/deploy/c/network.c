/* A network, from observation to torque. A file of this folder that includes it, after numbers.c,
 * observes a task. */

typedef struct {
  float torque; /* N m, the last one; if another one acted, write it here */
#ifdef POLICY_GOAL_SIZE
  int down1, down2; /* the goal: whether each link is to point down; policy_goal sets it */
#endif
#ifdef POLICY_HAS_PAST
  int running; /* whether there was a call before */
#endif
#ifdef POLICY_MEMORY_SIZE
  float w1, w2;                     /* rad/s, of the last call */
  float memory[POLICY_MEMORY_SIZE]; /* what the steps before it did, the latest first */
#endif
#ifdef POLICY_IDENTIFIED_SIZE
  policy_identifier identifier; /* the plant */
#endif
} policy_state;

/* y (out) = W x + b. The rows of W lie in blocks of eight, column by column, then one by one. */
static inline void policy_linear(const float *w, const float *b, int in, int out, const float *x,
                                 float *y) {
  const int in_blocks = out - out % 8;
  int o, i;
  for (o = 0; o < in_blocks; o += 8) {
    float y0 = b[o], y1 = b[o + 1], y2 = b[o + 2], y3 = b[o + 3];
    float y4 = b[o + 4], y5 = b[o + 5], y6 = b[o + 6], y7 = b[o + 7];
    for (i = 0; i < in; i++, w += 8) {
      const float xi = x[i];
      y0 += w[0] * xi;
      y1 += w[1] * xi;
      y2 += w[2] * xi;
      y3 += w[3] * xi;
      y4 += w[4] * xi;
      y5 += w[5] * xi;
      y6 += w[6] * xi;
      y7 += w[7] * xi;
    }
    y[o] = y0;
    y[o + 1] = y1;
    y[o + 2] = y2;
    y[o + 3] = y3;
    y[o + 4] = y4;
    y[o + 5] = y5;
    y[o + 6] = y6;
    y[o + 7] = y7;
  }
  for (o = in_blocks; o < out; o++) {
    float sum = b[o];
    for (i = 0; i < in; i++) sum += w[i] * x[i];
    w += in;
    y[o] = sum;
  }
}

/* x (size) = gain (x - mean) / sqrt(variance + 1e-5) + bias */
static inline void policy_layer_norm(const float *gain, const float *bias, int size, float *x) {
  float mean = 0.0f, square = 0.0f, scale;
  int i;
  for (i = 0; i < size; i++) mean += x[i];
  mean /= (float)size;
  for (i = 0; i < size; i++) {
    x[i] -= mean;
    square += x[i] * x[i];
  }
  scale = 1.0f / sqrtf(square / (float)size + 1e-5f);
  for (i = 0; i < size; i++) x[i] = x[i] * scale * gain[i] + bias[i];
}

/* What the network puts out (POLICY_OUTPUT_SIZE) for an observation. */
static inline void policy_outputs(const float *observation, float *outputs) {
  float a[POLICY_WIDEST_LAYER], b[POLICY_WIDEST_LAYER];
  const float *x = observation;
  int layer, i;
  for (layer = 0; layer < POLICY_LAYERS; layer++) {
    const int out = policy_layers[layer].out;
    float *y = layer == POLICY_LAYERS - 1 ? outputs : layer % 2 == 0 ? a : b;
    policy_linear(policy_layers[layer].weight, policy_layers[layer].bias, policy_layers[layer].in,
                  out, x, y);
    if (policy_layers[layer].norm_weight) {
      policy_layer_norm(policy_layers[layer].norm_weight, policy_layers[layer].norm_bias, out, y);
    }
    if (policy_layers[layer].activation == 'r') {
      for (i = 0; i < out; i++) {
        if (y[i] < 0.0f) y[i] = 0.0f;
      }
    } else if (policy_layers[layer].activation == 't') {
      for (i = 0; i < out; i++) y[i] = tanhf(y[i]);
    }
    x = y;
  }
}

#if POLICY_RULE == 'l'
/* The torque of the largest output, the first of equals. */
static inline float policy_choose(const float *outputs) {
  int best = 0, i;
  for (i = 1; i < POLICY_OUTPUT_SIZE; i++) {
    if (outputs[i] > outputs[best]) best = i;
  }
  return policy_torques[best];
}
#elif POLICY_RULE == 's'
/* The mean action, squashed into the limit. */
static inline float policy_choose(const float *outputs) {
  return POLICY_TORQUE_LIMIT * tanhf(outputs[0]);
}
#else
/* The mean action, cut off at the limit. */
static inline float policy_choose(const float *outputs) {
  if (outputs[0] > 1.0f) return POLICY_TORQUE_LIMIT;
  if (outputs[0] < -1.0f) return -POLICY_TORQUE_LIMIT;
  return POLICY_TORQUE_LIMIT * outputs[0];
}
#endif

/* The torque for an observation (POLICY_OBSERVATION_SIZE) that the caller has made. */
static inline policy_status policy_control_observation(const float *observation, float *torque) {
  float outputs[POLICY_OUTPUT_SIZE];
  if (!torque) return POLICY_NULL_POINTER;
  *torque = 0.0f;
  if (!observation) return POLICY_NULL_POINTER;
  if (!policy_all_finite(observation, POLICY_OBSERVATION_SIZE)) return POLICY_NOT_FINITE;
  policy_outputs(observation, outputs);
  if (!policy_all_finite(outputs, POLICY_OUTPUT_SIZE)) return POLICY_NOT_FINITE;
  *torque = policy_choose(outputs);
  return POLICY_OK;
}

/* Forgets the motion, but keeps the goal. */
static inline void policy_forget(policy_state *state) {
#ifdef POLICY_MEMORY_SIZE
  int i;
  state->w1 = 0.0f;
  state->w2 = 0.0f;
  for (i = 0; i < POLICY_MEMORY_SIZE; i++) state->memory[i] = 0.0f;
#endif
#ifdef POLICY_HAS_PAST
  state->running = 0;
#endif
  state->torque = 0.0f;
}

#ifdef POLICY_GOAL_SIZE
/* Chooses the pose to reach, at any time: for each link, whether it is to point up. */
static inline void policy_goal(policy_state *state, int up1, int up2) {
  if (!state) return;
  state->down1 = !up1;
  state->down2 = !up2;
}
#endif

/* Forgets all: for the beginning, and after any pause. */
static inline void policy_init(policy_state *state) {
  if (!state) return;
  policy_forget(state);
#ifdef POLICY_GOAL_SIZE
  policy_goal(state, 1, 1);
#endif
}

#pragma once

/// The parts of a policy's C header, from its beginning to its end. NAME_ stands for the prefix of
/// all its names, CAPS_ for that of its macros, @words@ for what differs from policy to policy.
namespace upswing::c_code {

inline constexpr const char* kHead = R"c(/* A policy that @goal@, as one C99 header.
 *
@origin@
 *
 *   static NAME_state state;
 *   float torque;
 *   if (NAME_selftest() != CAPS_OK) stop();
 *   NAME_init(&state);   before the first step, and after any pause
 *   for (;;) {   every @period@ s
 *     NAME_control(&state, @names@, &torque);
 *     set_motor(torque);
 *   }
 *
 * In, in this order; an angle may have made any number of turns:
@states@ * Out: the torque @motor@, N m, within +-@limit@, to be held for @period@ s. A positive one
 * pushes the joint's angle up. Which way round counts as positive does not matter, as long as it is
 * the same for all of these.
 *
@plant@ * What is not finite, and null pointers, the status tells: the torque is then 0, and what was
 * remembered is forgotten, as after NAME_init.
 *
@needs@
 *
 * All arithmetic is in float. Nothing is allocated, and nothing is static but constants. */
)c";

inline constexpr const char* kOpening = R"c(#ifndef UPSWING_CAPS_H
#define UPSWING_CAPS_H

#include <math.h>
#include <stdint.h>

#define CAPS_PERIOD @period@ /* s, between two calls */
#define CAPS_TORQUE_LIMIT @limit@ /* N m, no torque is beyond it */
#define CAPS_CONSTANT_BYTES @constant_bytes@L
)c";
inline constexpr const char* kSizes =
    R"c(#define CAPS_OBSERVATION_SIZE @inputs@
#define CAPS_OUTPUT_SIZE @outputs@ /* of the network */
@memory@#define CAPS_MULTIPLY_ADDS @multiply_adds@L /* of a call */
)c";
inline constexpr const char* kDeclarations = R"c(
typedef enum {
  CAPS_OK = 0,
  CAPS_NOT_FINITE = 1,   /* a number that came in, or that followed from it */
  CAPS_NULL_POINTER = 2, /* in place of an argument */
  CAPS_DAMAGED = 3       /* by the self test */
} NAME_status;

typedef struct {
  float torque; /* N m, the last one@acted@ */
@state@} NAME_state;
)c";
inline constexpr const char* kObservation = R"c(
/* The observation (CAPS_OBSERVATION_SIZE), which NAME_control computes:
@observation@*/
)c";
/// Of a policy whose observation remembers past steps.
inline constexpr const char* kMemoryState = R"c(  float w1, w2; /* rad/s, of the last call */
  int running;  /* whether there was one */
  float memory[CAPS_MEMORY_SIZE]; /* what the steps before it did, the latest first */
)c";

/// What an IEEE number is, by its bits: compilers that are told that there is no NaN would leave
/// out comparisons.
inline constexpr const char* kNumbers = R"c(
/* This needs numbers of 32 bits, as IEEE 754 has them. */
typedef char NAME_float_has_32_bits[sizeof(float) == 4 ? 1 : -1];

static inline uint32_t NAME_bits(float x)
{
  const unsigned char *from = (const unsigned char *)&x;
  uint32_t bits = 0;
  unsigned char *to = (unsigned char *)&bits;
  int i;
  for (i = 0; i < 4; i++) to[i] = from[i];
  return bits;
}

/* By its bits, which also holds where a compiler is told that there is no NaN (-ffast-math). */
static inline int NAME_is_finite(float x)
{
  return (NAME_bits(x) & 0x7f800000u) != 0x7f800000u;
}

static inline int NAME_all_finite(const float *x, int size)
{
  int i;
  for (i = 0; i < size; i++) {
    if (!NAME_is_finite(x[i])) return 0;
  }
  return 1;
}
)c";

inline constexpr const char* kLinear = R"c(
/* y (out) = W x + b. The rows of W lie in blocks of eight, column by column, then one by one. */
static inline void NAME_linear(const float *w, const float *b, int in, int out, const float *x,
                               float *y)
{
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
)c";

inline constexpr const char* kLayerNorm = R"c(
/* x (size) = gain (x - mean) / sqrt(variance + 1e-5) + bias */
static inline void NAME_layer_norm(const float *gain, const float *bias, int size, float *x)
{
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
)c";

inline constexpr const char* kRelu = R"c(
static inline void NAME_relu(float *x, int size)
{
  int i;
  for (i = 0; i < size; i++) {
    if (x[i] < 0.0f) x[i] = 0.0f;
  }
}
)c";

inline constexpr const char* kTanh = R"c(
static inline void NAME_tanh(float *x, int size)
{
  int i;
  for (i = 0; i < size; i++) x[i] = tanhf(x[i]);
}
)c";

inline constexpr const char* kOutputs = R"c(
/* What the network puts out (CAPS_OUTPUT_SIZE) for an observation. */
static inline void NAME_outputs(const float *observation, float *outputs)
{
  float @buffers@;
@layers@}
)c";

/// How the outputs become a torque.
inline constexpr const char* kChooseLargest = R"c(
/* The torque of the largest output, the first of equals. */
static inline float NAME_choose(const float *outputs)
{
  int best = 0, i;
  for (i = 1; i < CAPS_OUTPUT_SIZE; i++) {
    if (outputs[i] > outputs[best]) best = i;
  }
  return NAME_torques[best];
}
)c";
inline constexpr const char* kChooseSquashed = R"c(
/* The mean action, squashed into the limit. */
static inline float NAME_choose(const float *outputs)
{
  return CAPS_TORQUE_LIMIT * tanhf(outputs[0]);
}
)c";
inline constexpr const char* kChooseClipped = R"c(
/* The mean action, cut off at the limit. */
static inline float NAME_choose(const float *outputs)
{
  if (outputs[0] > 1.0f) return CAPS_TORQUE_LIMIT;
  if (outputs[0] < -1.0f) return -CAPS_TORQUE_LIMIT;
  return CAPS_TORQUE_LIMIT * outputs[0];
}
)c";

inline constexpr const char* kControlObservation = R"c(
/* The torque for an observation (CAPS_OBSERVATION_SIZE) that the caller has made. */
static inline NAME_status NAME_control_observation(const float *observation, float *torque)
{
  float outputs[CAPS_OUTPUT_SIZE];
  if (!torque) return CAPS_NULL_POINTER;
  *torque = 0.0f;
  if (!observation) return CAPS_NULL_POINTER;
  if (!NAME_all_finite(observation, CAPS_OBSERVATION_SIZE)) return CAPS_NOT_FINITE;
  NAME_outputs(observation, outputs);
  if (!NAME_all_finite(outputs, CAPS_OUTPUT_SIZE)) return CAPS_NOT_FINITE;
  *torque = NAME_choose(outputs);
  return CAPS_OK;
}
)c";

inline constexpr const char* kInit = R"c(
/* Forgets all: for the beginning, and after any pause. */
static inline void NAME_init(NAME_state *state)
{
@index@  if (!state) return;
  state->torque = 0.0f;
@forget@}
)c";
inline constexpr const char* kForgetMemory = R"c(  state->w1 = 0.0f;
  state->w2 = 0.0f;
  state->running = 0;
  for (i = 0; i < CAPS_MEMORY_SIZE; i++) state->memory[i] = 0.0f;
)c";

inline constexpr const char* kObserve = R"c(
/* The observation of these angles and velocities@and_memory@. */
static inline void NAME_observe(NAME_state *state, @parameters@,
                                float *observation)
{
@observe@}
)c";

inline constexpr const char* kControl = R"c(
/* The torque for these angles and velocities, to be called every CAPS_PERIOD seconds. */
static inline NAME_status NAME_control(NAME_state *state,
                                       @parameters@, float *torque)
{
  float observation[CAPS_OBSERVATION_SIZE];
  NAME_status status;
  if (!torque) return CAPS_NULL_POINTER;
  *torque = 0.0f;
  if (!state) return CAPS_NULL_POINTER;
  NAME_observe(state, @names@, observation);
  status = NAME_control_observation(observation, torque);
  state->torque = *torque;
  if (status != CAPS_OK) NAME_init(state);
  return status;
}
)c";

inline constexpr const char* kChecksum = R"c(
/* Samples: states, one after the other, and what Upswing makes of them. */
@tables@
/* Continues a checksum (FNV-1a over words) with the bits of some numbers. */
static inline uint32_t NAME_checksum(uint32_t sum, const float *values, long count)
{
  long i;
  for (i = 0; i < count; i++) sum = (sum ^ NAME_bits(values[i])) * 16777619u;
  return sum;
}

static inline uint32_t NAME_checksum_of_all(void)
{
  uint32_t sum = 2166136261u;
@sums@  return sum;
}
)c";
inline constexpr const char* kSelfTest = R"c(
/* Whether all constants are as they were written, and this machine computes what Upswing does. */
static inline NAME_status NAME_selftest(void)
{
  NAME_state state;
  int sample;
  if (NAME_checksum_of_all() != @checksum@) return CAPS_DAMAGED;
  NAME_init(&state);
  for (sample = 0; sample < @samples@; sample++) {
    const float *x = NAME_sample_states + @state_size@ * sample;
    const float *expected = NAME_sample_outputs + CAPS_OUTPUT_SIZE * sample;
    float observation[CAPS_OBSERVATION_SIZE], outputs[CAPS_OUTPUT_SIZE];
    float error;
    int i;
    NAME_observe(&state, @sample@, observation);
    NAME_outputs(observation, outputs);
    if (!NAME_all_finite(outputs, CAPS_OUTPUT_SIZE)) return CAPS_DAMAGED;
    for (i = 0; i < CAPS_OUTPUT_SIZE; i++) {
      error = outputs[i] - expected[i];
      if (fabsf(error) > @output_tolerance@) return CAPS_DAMAGED;
    }
    error = NAME_choose(outputs) - NAME_sample_torques[sample];
    if (fabsf(error) > @torque_tolerance@) return CAPS_DAMAGED;
    state.torque = NAME_sample_torques[sample];
  }
  return CAPS_OK;
}
)c";

}  // namespace upswing::c_code

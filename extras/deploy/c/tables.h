/* Stands for the tables that an export begins with, so that the C files of this folder compile. */
#include <math.h>
#include <stdint.h>

#define POLICY_PERIOD 0.02f
#define POLICY_TORQUE_LIMIT 5.0f
#define POLICY_OBSERVATION_SIZE 20
#define POLICY_OUTPUT_SIZE 1
#define POLICY_LAYERS 1
#define POLICY_WIDEST_LAYER 1
#ifndef POLICY_RULE
#define POLICY_RULE 'l' /* l: largest output, s: squashed mean, c: clipped mean */
#endif
#define POLICY_STATE_SIZE 4
#define POLICY_ACTUATED_JOINT 1
#ifndef POLICY_LAW
#define POLICY_LAW 'e' /* e: energy shaping, p: partial feedback linearisation */
#endif
#define POLICY_TABLES 1
#define POLICY_CHECKSUM 0u
#define POLICY_SAMPLES 1
#define POLICY_OUTPUT_TOLERANCE 1e-4f
#define POLICY_TORQUE_TOLERANCE 1e-3f

static const float policy_energy[7] = {0.0f}, policy_torques[1] = {0.0f};
static const float policy_weight[20] = {0.0f}, policy_bias[1] = {0.0f};
static const struct {
  const float *weight, *bias, *norm_weight, *norm_bias;
  int in, out;
  char activation; /* r: relu, t: tanh, n: none */
} policy_layers[POLICY_LAYERS] = {{policy_weight, policy_bias, 0, 0, 20, 1, 'n'}};
static const float policy_gain[4] = {0.0f}, policy_plant[8] = {0.0f};
static const float policy_upright_cost[10] = {0.0f}, policy_region[1] = {0.0f};
static const float policy_law_gains[3] = {0.0f};
static const float policy_plan[4] = {0.0f}, policy_plan_torque[1] = {0.0f};
static const float policy_plan_gain[4] = {0.0f}, policy_plan_cost[10] = {0.0f};
static const struct {
  const float *values;
  long count;
} policy_tables[POLICY_TABLES] = {{policy_bias, 1L}};
static const float policy_sample_states[4] = {0.0f}, policy_sample_outputs[1] = {0.0f};
static const float policy_sample_torques[1] = {0.0f}, policy_sample_steps[4] = {0.0f};

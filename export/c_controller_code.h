#pragma once

/// The parts of a controller's C header that those of networks (export/c_code.h) do not have. The
/// same words are replaced in them.
namespace upswing::c_code {

inline constexpr const char* kDeviation = R"c(
static inline float NAME_limited(float torque)
{
  if (torque > CAPS_TORQUE_LIMIT) return CAPS_TORQUE_LIMIT;
  if (torque < -CAPS_TORQUE_LIMIT) return -CAPS_TORQUE_LIMIT;
  return torque;
}

/* d (4): deviation from upright at rest, the angles from -pi to pi. */
static inline void NAME_deviation(float q1, float q2, float w1, float w2, float *d)
{
  d[0] = atan2f(-sinf(q1), -cosf(q1));
  d[1] = atan2f(sinf(q2), cosf(q2));
  d[2] = w1;
  d[3] = w2;
}

/* The linear-quadratic regulator: -K d. */
static inline float NAME_regulator(const float *d)
{
  const float *k = NAME_gain;
  return -(k[0] * d[0] + k[1] * d[1] + k[2] * d[2] + k[3] * d[3]);
}
)c";

/// d' P d of a symmetric P.
inline constexpr const char* kCost = R"c(
/* d' P d; p (10): the upper triangle of P, row by row. */
static inline float NAME_cost(const float *p, const float *d)
{
  return p[0] * d[0] * d[0] + p[4] * d[1] * d[1] + p[7] * d[2] * d[2] + p[9] * d[3] * d[3] +
         2.0f * (d[0] * (p[1] * d[1] + p[2] * d[2] + p[3] * d[3]) +
                 d[1] * (p[5] * d[2] + p[6] * d[3]) + p[8] * d[2] * d[3]);
}
)c";

/// Whether the regulator catches (LqrCatch::Holds).
inline constexpr const char* kCatch = R"c(
/* The derivative of a deviation by time, under a torque: M(q) q'' = f. */
static inline void NAME_derivative(const float *d, float torque, float *rate)
{
  const float *c = NAME_plant; /* J1, J2, coupling, moments of gravity, dampings, armature */
  const float bc = c[2] * cosf(d[1]), bs = c[2] * sinf(d[1]);
  const float m11 = c[0] + c[1] + 2.0f * bc, m12 = c[1] + bc, m22 = c[1] + c[7];
  const float g2 = c[4] * sinf(d[0] + d[1]);
  const float f1 = @torque1@bs * (2.0f * d[2] + d[3]) * d[3] + c[3] * sinf(d[0]) + g2 - c[5] * d[2];
  const float f2 = @torque2@g2 - bs * d[2] * d[2] - c[6] * d[3];
  const float det = m11 * m22 - m12 * m12;
  rate[0] = d[2];
  rate[1] = d[3];
  rate[2] = (m22 * f1 - m12 * f2) / det;
  rate[3] = (m11 * f2 - m12 * f1) / det;
}

/* One control period with the torque held: four Runge-Kutta steps. */
static inline void NAME_advance(float *d, float torque)
{
  const float h = CAPS_PERIOD / 4.0f;
  int step, i;
  for (step = 0; step < 4; step++) {
    float k1[4], k2[4], k3[4], k4[4], at[4];
    NAME_derivative(d, torque, k1);
    for (i = 0; i < 4; i++) at[i] = d[i] + h / 2.0f * k1[i];
    NAME_derivative(at, torque, k2);
    for (i = 0; i < 4; i++) at[i] = d[i] + h / 2.0f * k2[i];
    NAME_derivative(at, torque, k3);
    for (i = 0; i < 4; i++) at[i] = d[i] + h * k3[i];
    NAME_derivative(at, torque, k4);
    for (i = 0; i < 4; i++) d[i] += h / 6.0f * (k1[i] + 2.0f * (k2[i] + k3[i]) + k4[i]);
  }
}

/* Whether the regulator, from this deviation on, comes to where it is known to hold, within
 * CAPS_LOOK_AHEAD periods and with no link leaning further than 60 degrees: by simulating that. */
static inline int NAME_catches(const float *deviation)
{
  const float lean = 1.0471976f;
  float d[4];
  int i;
  for (i = 0; i < 4; i++) d[i] = deviation[i];
  for (i = 0; i < CAPS_LOOK_AHEAD; i++) {
    if (!(fabsf(d[0]) <= lean) || !(fabsf(d[0] + d[1]) <= lean)) return 0;
    if (NAME_cost(NAME_upright_cost, d) <= NAME_region[0]) return 1;
    NAME_advance(d, NAME_limited(NAME_regulator(d)));
  }
  return 0;
}
)c";

/// Terms of the equations of motion for a law (Manipulator::At).
inline constexpr const char* kTerms = R"c(
/* The law of the swing-up. */
static inline float NAME_law(const float *d)
{
  const float *c = NAME_plant, *k = NAME_law_gains;
  const float w1 = d[2], w2 = d[3];
  const float bc = c[2] * cosf(d[1]), bs = c[2] * sinf(d[1]);
  const float m11 = c[0] + c[1] + 2.0f * bc, m12 = c[1] + bc, m22 = c[1] + c[7];
  const float g2 = c[4] * sinf(d[0] + d[1]);
  const float h1 = -bs * (2.0f * w1 + w2) * w2 - c[3] * sinf(d[0]) - g2 + c[5] * w1;
  const float h2 = bs * w1 * w1 - g2 + c[6] * w2;
  /* Above that of rest upright. */
  const float energy = 0.5f * (m11 * w1 * w1 + 2.0f * m12 * w1 * w2 + m22 * w2 * w2) -
                       c[3] * (1.0f - cosf(d[0])) - c[4] * (1.0f - cosf(d[0] + d[1]));
@law@}
)c";
inline constexpr const char* kEnergyShaping = R"c(  const float det = m11 * m22 - m12 * m12;
  return -(k[1] * (m12 * h2 - m22 * h1) + det * (w1 + k[0] * d[0])) /
         (det * k[2] * energy + k[1] * m22);
)c";
inline constexpr const char* kPartialFeedback =
    R"c(  const float acceleration = -k[0] * d[0] - k[1] * w1 - k[2] * energy * w1;
  return (m11 - m12 * m12 / m22) * acceleration + h1 - m12 / m22 * h2;
)c";

/// Where on the plan (TvlqrPolicy::Torque).
inline constexpr const char* kPlan = R"c(
/* From that place of the plan (sign -1: of its mirror image) to a deviation from upright. */
static inline void NAME_off_plan(const float *d, int step, float sign, float *off)
{
  int i;
  for (i = 0; i < 4; i++) off[i] = d[i] - sign * NAME_plan[4 * step + i];
  for (i = 0; i < 2; i++) {
    if (off[i] > 3.1415927f) off[i] -= 6.2831853f;
    if (off[i] < -3.1415927f) off[i] += 6.2831853f;
  }
}

static inline float NAME_cost_of_place(const float *d, int step, float sign)
{
  float off[4];
  NAME_off_plan(d, step, sign, off);
  return NAME_cost(NAME_plan_cost + 10 * step, off);
}

/* The next place of the plan, or where it costs least to be off it, if that is less than a quarter.
 * Of the mirror image the first place, hanging, is left out: it is the plan's own. */
static inline float NAME_follow(NAME_state *state, const float *d)
{
  const float *k;
  float off[4], now = -1.0f, least = -1.0f, sign = 1.0f;
  int step = 0, i, mirrored;
  if (state->step >= 0) state->step++;
  if (state->step >= 0 && state->step < CAPS_PLAN_STEPS) {
    now = NAME_cost_of_place(d, state->step, state->sign);
  }
  for (mirrored = 0; mirrored < 2; mirrored++) {
    for (i = mirrored; i < CAPS_PLAN_STEPS; i++) {
      const float there = NAME_cost_of_place(d, i, mirrored ? -1.0f : 1.0f);
      if (least >= 0.0f && there >= least) continue;
      least = there;
      step = i;
      sign = mirrored ? -1.0f : 1.0f;
    }
  }
  if (now < 0.0f || least < 0.25f * now) {
    state->step = step;
    state->sign = sign;
  }
  NAME_off_plan(d, state->step, state->sign, off);
  k = NAME_plan_gain + 4 * state->step;
  return state->sign * NAME_plan_torque[state->step] -
         (k[0] * off[0] + k[1] * off[1] + k[2] * off[2] + k[3] * off[3]);
}
)c";

inline constexpr const char* kPlace = R"c(  int step;   /* of the plan; -1: not begun */
  float sign; /* -1: on the plan's mirror image */
)c";

inline constexpr const char* kControllerControl = R"c(
/* Forgets all: for the beginning, and after any pause. */
static inline void NAME_init(NAME_state *state)
{
  if (!state) return;
  state->torque = 0.0f;
@forget@}

/* The torque for these angles and velocities, to be called every CAPS_PERIOD seconds. */
static inline NAME_status NAME_control(NAME_state *state, float q1, float q2, float w1, float w2,
                                       float *torque)
{
  float d[4], u;
  if (!torque) return CAPS_NULL_POINTER;
  *torque = 0.0f;
  if (!state) return CAPS_NULL_POINTER;
  NAME_deviation(q1, q2, w1, w2, d);
  if (NAME_all_finite(d, 4)) {
@choose@    u = NAME_limited(u);
    if (NAME_is_finite(u)) {
      *torque = u;
      state->torque = u;
      return CAPS_OK;
    }
  }
  NAME_init(state);
  return CAPS_NOT_FINITE;
}
)c";

inline constexpr const char* kControllerSelfTest = R"c(
/* Whether all constants are as they were written, and this machine computes what Upswing does. */
static inline NAME_status NAME_selftest(void)
{
  int sample;
  if (NAME_checksum_of_all() != @checksum@) return CAPS_DAMAGED;
  for (sample = 0; sample < @samples@; sample++) {
    const float *x = NAME_sample_states + 4 * sample;
    NAME_state state;
    float torque;
    NAME_init(&state);
    if (NAME_control(&state, x[0], x[1], x[2], x[3], &torque) != CAPS_OK) return CAPS_DAMAGED;
    torque -= NAME_sample_torques[sample];
    if (!(fabsf(torque) <= @torque_tolerance@)) return CAPS_DAMAGED;
@step@  }
  return CAPS_OK;
}
)c";

/// Of the self test, where there is a simulation. In floats its step is off by up to 5e-7 rad and
/// rad/s in these samples with the usual plant, and by 2e-5 with links of unlike lengths.
inline constexpr const char* kStepTest = R"c(    {
      float d[4];
      int i;
      NAME_deviation(x[0], x[1], x[2], x[3], d);
      NAME_advance(d, NAME_sample_torques[sample]);
      for (i = 0; i < 4; i++) {
        d[i] -= NAME_sample_steps[4 * sample + i];
        if (!(fabsf(d[i]) <= 1e-4f)) return CAPS_DAMAGED;
      }
    }
)c";

}  // namespace upswing::c_code

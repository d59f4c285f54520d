#include "sim/pendulum_env.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

/// Gives every simulation of the batch a row of its own for a model field.
mjtNum* Expand(mjBatch* batch, const char* field, int env) {
  int size = 0;
  auto* rows = static_cast<mjtNum*>(mjb_expand(batch, field, &size, nullptr));
  if (rows == nullptr) throw Failure(Concat("MuJoCo cannot expand ", field));
  return rows + env * size;
}

ModelFields ExpandedFields(mjBatch* batch, int env) {
  return {Expand(batch, "body_mass", env),   Expand(batch, "body_inertia", env),
          Expand(batch, "body_ipos", env),   Expand(batch, "body_pos", env),
          Expand(batch, "geom_pos", env),    Expand(batch, "geom_size", env),
          Expand(batch, "dof_damping", env), Expand(batch, "actuator_ctrlrange", env),
          Expand(batch, "opt.gravity", env)};
}

}  // namespace

PendulumEnv::PendulumEnv(const PendulumEnvConfig& config) : config_(config) {
  // The model, with the one plant that all environments share or as the base of many.
  const ModelPtr model = config_.mjcf.empty() ? CompileModel(Mjcf(Plant()), "model")
                                              : LoadModel(config_.mjcf, "model");
  WritePlant(plant(0), FieldsOf(*model));
  const DataPtr data(mj_makeData(model.get()));
  mj_setConst(model.get(), data.get());

  // The batch. MuJoCo's results have the same bits whatever the number of threads.
  const auto n = static_cast<size_t>(config_.num_envs);
  std::array<char, 1000> message{};
  mjBatchConfig batch_config;
  mjb_defaultConfig(&batch_config);
  batch_config.nthread = std::clamp(config_.threads, 1, config_.num_envs);
  batch_.reset(
      mjb_makeBatch(model.get(), config_.num_envs, &batch_config, message.data(), message.size()));
  if (batch_ == nullptr) throw Failure(Concat("MuJoCo: ", message.data()));
  if (config_.plants.size() > 1) {
    for (int i = 0; i < config_.num_envs; ++i) {
      WritePlant(plant(i), ExpandedFields(batch_.get(), i));
    }
    mjb_setConst(batch_.get(), nullptr, 0);
  }
  mjb_reset(batch_.get(), nullptr, 0, nullptr, mjSTAGE_NONE);
  state_size_ = mjb_nstate(batch_.get());
  qpos_ = mjb_stateComponent(batch_.get(), mjSTATE_QPOS, nullptr);
  qvel_ = mjb_stateComponent(batch_.get(), mjSTATE_QVEL, nullptr);
  ctrl_ = mjb_stateComponent(batch_.get(), mjSTATE_CTRL, nullptr);

  substeps_ = static_cast<int>(std::round(kControlPeriod / model->opt.timestep));
  episode_steps_ = std::max<int64_t>(1, std::llround(config_.episode_seconds / kControlPeriod));
  step_counts_.resize(n);
  previous_q1_.resize(n);
  obs_.resize(n * kObservationSize);
  for (int i = 0; i < config_.num_envs; ++i) {
    rngs_.emplace_back(config_.seed, config_.stream, static_cast<uint64_t>(i));
    Reset(i);
  }
}

std::vector<std::string> PendulumEnv::reward_term_names() const {
  return {kRewardTermNames.begin(), kRewardTermNames.end()};
}

const Plant& PendulumEnv::plant(int env) const {
  return config_.plants[config_.plants.size() > 1 ? static_cast<size_t>(env) : 0];
}

Matrix<const float> PendulumEnv::obs() const {
  return {obs_.data(), config_.num_envs, kObservationSize};
}

PendulumState PendulumEnv::state(int env) const {
  const mjtNum* q = Component(qpos_, env);
  const mjtNum* w = Component(qvel_, env);
  return {q[0], q[1], w[0], w[1]};
}

void PendulumEnv::SetState(int env, const PendulumState& s) {
  // Reset by MuJoCo: time, control, warm start and warnings go back too.
  mjb_reset(batch_.get(), &env, 1, nullptr, mjSTAGE_NONE);
  std::copy_n(std::array{s.q1, s.q2}.data(), 2, Component(qpos_, env));
  std::copy_n(std::array{s.w1, s.w2}.data(), 2, Component(qvel_, env));
  step_counts_[static_cast<size_t>(env)] = 0;
  const auto first = static_cast<size_t>(env) * kObservationSize;
  ObserveInto(env, std::span(obs_).subspan(first, kObservationSize));
}

void PendulumEnv::ObserveInto(int env, std::span<float> obs) const {
  std::ranges::copy(Observe(plant(env), state(env)), obs.begin());
}

void PendulumEnv::Reset(int env) {
  constexpr double kPi = std::numbers::pi;
  Rng& rng = rngs_[static_cast<size_t>(env)];
  const StartStates& start = config_.start;
  PendulumState s;
  if (rng.Uniform() < start.random_share) {
    s = {rng.Uniform(-kPi, kPi), rng.Uniform(-kPi, kPi),
         rng.Uniform(-start.random_velocity, start.random_velocity),
         rng.Uniform(-start.random_velocity, start.random_velocity)};
  } else {
    s = {start.noise * rng.Normal(), start.noise * rng.Normal(), start.noise * rng.Normal(),
         start.noise * rng.Normal()};
  }
  SetState(env, s);
}

bool PendulumEnv::BlewUp(int env) const {
  const PendulumState s = state(env);
  const mjWarningStat* warnings = mjb_warning(batch_.get()) + env * mjNWARNING;
  return mjb_status(batch_.get())[env] != 0 || warnings[mjWARN_BADQPOS].number > 0 ||
         warnings[mjWARN_BADQVEL].number > 0 || warnings[mjWARN_BADQACC].number > 0 ||
         !std::isfinite(s.q1 + s.q2 + s.w1 + s.w2);
}

void PendulumEnv::Step(std::span<const double> torque, StepResult& result) {
  for (int i = 0; i < config_.num_envs; ++i) {
    previous_q1_[static_cast<size_t>(i)] = state(i).q1;
    Component(ctrl_, i)[0] = torque[static_cast<size_t>(i)];
  }
  mjb_step(batch_.get(), nullptr, 0, substeps_, mjSTAGE_NONE);

  for (int env = 0; env < config_.num_envs; ++env) {
    const auto i = static_cast<size_t>(env);
    const auto next_obs =
        std::span(result.next_obs).subspan(i * kObservationSize, kObservationSize);
    const auto terms = std::span(result.reward_terms).subspan(i * kRewardTerms, kRewardTerms);
    ++step_counts_[i];
    result.terminated[i] = BlewUp(env) ? 1 : 0;
    result.truncated[i] = step_counts_[i] >= episode_steps_ && !result.terminated[i] ? 1 : 0;
    result.reward[i] = 0;
    if (result.terminated[i]) {
      // There is no successor; the last state that had numbers stands in for it.
      std::copy_n(obs_.begin() + static_cast<ptrdiff_t>(i) * kObservationSize, kObservationSize,
                  next_obs.begin());
      std::ranges::fill(terms, 0.0);
      result.at_goal[i] = 0;
      result.torque[i] = 0;
      result.work[i] = 0;
    } else {
      const PendulumState s = state(env);
      const double limit = plant(env).torque_limit;
      const double tau = std::clamp(torque[i], -limit, limit);
      ObserveInto(env, next_obs);
      std::ranges::copy(RewardTerms(plant(env), s, tau), terms.begin());
      for (size_t k = 0; k < kRewardTerms; ++k) {
        terms[k] *= config_.weights.weight[k];
        result.reward[i] += terms[k];
      }
      result.at_goal[i] = Inverted(s) ? 1 : 0;
      result.torque[i] = tau;
      result.work[i] = std::abs(tau * (s.q1 - previous_q1_[i]));
    }
    if (result.done(i)) {
      Reset(env);
    } else {
      std::ranges::copy(next_obs, obs_.begin() + static_cast<ptrdiff_t>(i) * kObservationSize);
    }
  }
}

void PendulumEnv::State(const Archive& archive) {
  const auto n = static_cast<size_t>(config_.num_envs);
  archive.Array("state", std::span(mjb_state(batch_.get()), n * static_cast<size_t>(state_size_)));
  archive.Array("step_counts", std::span(step_counts_));
  archive.Array("obs", std::span(obs_));
  archive.Scalar("start_noise", config_.start.noise);
  for (size_t i = 0; i < n; ++i) rngs_[i].State(archive.In(Concat("rng.", i)));
}

}  // namespace upswing

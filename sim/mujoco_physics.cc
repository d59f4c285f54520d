#include "sim/mujoco_physics.h"

#include <algorithm>
#include <array>
#include <cmath>

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

MuJoCoPhysics::MuJoCoPhysics(const PhysicsConfig& config) : config_(config) {
  // The model, with the one plant that all environments share or as the base of many.
  const ModelPtr model = config_.mjcf.empty() ? CompileModel(Mjcf(Plant()), "model")
                                              : LoadModel(config_.mjcf, "model");
  WritePlant(config_.plant(0), FieldsOf(*model));
  const DataPtr data(mj_makeData(model.get()));
  mj_setConst(model.get(), data.get());

  // The batch. MuJoCo's results have the same bits whatever the number of threads.
  std::array<char, 1000> message{};
  mjBatchConfig batch_config;
  mjb_defaultConfig(&batch_config);
  batch_config.nthread = std::clamp(config_.threads, 1, config_.num_envs);
  batch_.reset(
      mjb_makeBatch(model.get(), config_.num_envs, &batch_config, message.data(), message.size()));
  if (batch_ == nullptr) throw Failure(Concat("MuJoCo: ", message.data()));
  if (config_.plants.size() > 1) {
    for (int i = 0; i < config_.num_envs; ++i) {
      WritePlant(config_.plant(i), ExpandedFields(batch_.get(), i));
    }
    mjb_setConst(batch_.get(), nullptr, 0);
  }
  mjb_reset(batch_.get(), nullptr, 0, nullptr, mjSTAGE_NONE);
  state_size_ = mjb_nstate(batch_.get());
  qpos_ = mjb_stateComponent(batch_.get(), mjSTATE_QPOS, nullptr);
  qvel_ = mjb_stateComponent(batch_.get(), mjSTATE_QVEL, nullptr);
  ctrl_ = mjb_stateComponent(batch_.get(), mjSTATE_CTRL, nullptr);

  substeps_ = static_cast<int>(std::round(kControlPeriod / model->opt.timestep));
  previous_q1_.resize(static_cast<size_t>(config_.num_envs));
}

PendulumState MuJoCoPhysics::state(int env) const {
  const mjtNum* q = Component(qpos_, env);
  const mjtNum* w = Component(qvel_, env);
  return {q[0], q[1], w[0], w[1]};
}

void MuJoCoPhysics::SetState(int env, const PendulumState& s) {
  // Reset by MuJoCo: time, control, warm start and warnings go back too.
  mjb_reset(batch_.get(), &env, 1, nullptr, mjSTAGE_NONE);
  std::copy_n(std::array{s.q1, s.q2}.data(), 2, Component(qpos_, env));
  std::copy_n(std::array{s.w1, s.w2}.data(), 2, Component(qvel_, env));
}

bool MuJoCoPhysics::BlewUp(int env) const {
  const PendulumState s = state(env);
  const mjWarningStat* warnings = mjb_warning(batch_.get()) + env * mjNWARNING;
  return mjb_status(batch_.get())[env] != 0 || warnings[mjWARN_BADQPOS].number > 0 ||
         warnings[mjWARN_BADQVEL].number > 0 || warnings[mjWARN_BADQACC].number > 0 ||
         !std::isfinite(s.q1 + s.q2 + s.w1 + s.w2);
}

void MuJoCoPhysics::Judge(int env, double torque, StepResult& result) const {
  const auto i = static_cast<size_t>(env);
  const PendulumState s = state(env);
  const Plant& plant = config_.plant(env);
  const double tau = std::clamp(torque, -plant.torque_limit, plant.torque_limit);
  std::ranges::copy(Observe(plant, s),
                    std::span(result.next_obs).subspan(i * kObservationSize).begin());
  const auto terms = std::span(result.reward_terms).subspan(i * kRewardTerms, kRewardTerms);
  std::ranges::copy(RewardTerms(plant, s, tau), terms.begin());
  result.reward[i] = 0;
  for (size_t k = 0; k < kRewardTerms; ++k) {
    terms[k] *= config_.weights.weight[k];
    result.reward[i] += terms[k];
  }
  result.at_goal[i] = Inverted(s) ? 1 : 0;
  result.torque[i] = tau;
  result.work[i] = std::abs(tau * (s.q1 - previous_q1_[i]));
}

void MuJoCoPhysics::Step(std::span<const double> torque, StepResult& result) {
  for (int env = 0; env < config_.num_envs; ++env) {
    previous_q1_[static_cast<size_t>(env)] = state(env).q1;
    Component(ctrl_, env)[0] = torque[static_cast<size_t>(env)];
  }
  mjb_step(batch_.get(), nullptr, 0, substeps_, mjSTAGE_NONE);
  for (int env = 0; env < config_.num_envs; ++env) {
    const auto i = static_cast<size_t>(env);
    result.terminated[i] = BlewUp(env) ? 1 : 0;
    if (!result.terminated[i]) Judge(env, torque[i], result);
  }
}

void MuJoCoPhysics::State(const Archive& archive) {
  const size_t size = static_cast<size_t>(config_.num_envs) * static_cast<size_t>(state_size_);
  archive.Array("state", std::span(mjb_state(batch_.get()), size));
}

}  // namespace upswing

#include "mujoco/engines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "mujoco/model.h"

namespace upswing {
namespace {

constexpr int kSmallestSlice = 4;  // environments; fewer are not worth a task
constexpr int kMostSlices = 20;

/// A plant whose MJCF has every element that any of these plants needs.
Plant Superset(const std::vector<Plant>& plants) {
  Plant superset;
  for (const Plant& plant : plants) {
    superset.rotor_inertia = std::max(superset.rotor_inertia, plant.rotor_inertia);
    superset.coulomb1 = std::max({superset.coulomb1, plant.coulomb1, plant.coulomb2});
  }
  return superset;
}

/// N double pendulums in MuJoCo's batch interface. Each slice of a few environments is a batch. Our
/// thread pool distributes the slices, so MuJoCo needs no pool of its own. A MuJoCo warning counts
/// as a blow-up, too.
class MuJoCoPhysics : public Physics {
 public:
  explicit MuJoCoPhysics(const PhysicsConfig& config);

  PendulumState state(int env) const override;
  void SetState(int env, const PendulumState& state) override;
  void SetPlant(int env, const Plant& plant) override;
  void Push(int env, const std::array<double, 2>& torque) override;
  void Step(std::span<const double> torque, StepResult& result) override;
  void State(const Archive& archive) override;

 private:
  /// Consecutive environments with their own MuJoCo batch, which one thread steps at a time.
  struct Slice {
    int first, count;
    BatchPtr batch;
    mjtNum *qpos, *qvel, *ctrl, *push;  // in row 0 of the state table
  };
  Slice MakeSlice(const mjModel& model, int first, int count) const;
  const Slice& SliceOf(int env) const { return slices_[env / slice_size_]; }
  /// The part of an environment's state that starts at `first` in row 0 of its slice.
  mjtNum* Component(mjtNum* first, int env) const {
    return first + env % slice_size_ * state_size_;
  }
  void StepSlice(const Slice& slice, std::span<const double> torque, StepResult& result);
  bool BlewUp(int env) const;
  void Judge(int env, double torque, StepResult& result) const;

  PhysicsConfig config_;
  int slice_size_;
  std::vector<Slice> slices_;
  int state_size_ = 0;                  // numbers in a state row
  std::vector<double> previous_angle_;  // (N) of the motor's joint before the step, rad
};

MuJoCoPhysics::MuJoCoPhysics(const PhysicsConfig& config)
    : config_(config),
      slice_size_(std::max(kSmallestSlice, (config.num_envs + kMostSlices - 1) / kMostSlices)) {
  // Compile the model with the common plant, or with the first of several.
  const ModelPtr model = CompileModel(Superset(config_.plants));
  WritePlant(config_.plant(0), FieldsOf(*model));
  model->opt.timestep = config_.timestep();
  // The model has no springs, sensors and islands. Disabled, MuJoCo skips the search.
  model->opt.disableflags |= mjDSBL_SPRING | mjDSBL_SENSOR | mjDSBL_ISLAND;
  const DataPtr data(mj_makeData(model.get()));
  mj_setConst(model.get(), data.get());

  for (int first = 0; first < config_.num_envs; first += slice_size_) {
    slices_.push_back(MakeSlice(*model, first, std::min(slice_size_, config_.num_envs - first)));
  }
  state_size_ = mjb_nstate(slices_.front().batch.get());
  previous_angle_.resize(config_.num_envs);
}

MuJoCoPhysics::Slice MuJoCoPhysics::MakeSlice(const mjModel& model, int first, int count) const {
  std::array<char, 1000> message{};
  mjBatchConfig batch_config;
  mjb_defaultConfig(&batch_config);
  batch_config.nthread = 1;
  BatchPtr batch(mjb_makeBatch(&model, count, &batch_config, message.data(), message.size()));
  if (batch == nullptr) throw Failure(Concat("MuJoCo: ", message.data()));
  if (config_.plants.size() > 1) {
    for (int i = 0; i < count; ++i) {
      WritePlant(config_.plant(first + i), FieldsOf(batch.get(), i));
    }
    mjb_setConst(batch.get(), nullptr, 0);
  }
  mjb_reset(batch.get(), nullptr, 0, nullptr, mjSTAGE_NONE);
  const auto component = [&](int what) { return mjb_stateComponent(batch.get(), what, nullptr); };
  mjtNum* qpos = component(mjSTATE_QPOS);
  mjtNum* qvel = component(mjSTATE_QVEL);
  mjtNum* ctrl = component(mjSTATE_CTRL);
  mjtNum* push = component(mjSTATE_QFRC_APPLIED);
  return {first, count, std::move(batch), qpos, qvel, ctrl, push};
}

PendulumState MuJoCoPhysics::state(int env) const {
  const mjtNum* q = Component(SliceOf(env).qpos, env);
  const mjtNum* w = Component(SliceOf(env).qvel, env);
  return {q[0], q[1], w[0], w[1]};
}

void MuJoCoPhysics::SetState(int env, const PendulumState& s) {
  const Slice& slice = SliceOf(env);
  // MuJoCo's own reset also clears time, control, warm start and warnings.
  const int row = env - slice.first;
  mjb_reset(slice.batch.get(), &row, 1, nullptr, mjSTAGE_NONE);
  std::copy_n(std::array{s.q1, s.q2}.data(), 2, Component(slice.qpos, env));
  std::copy_n(std::array{s.w1, s.w2}.data(), 2, Component(slice.qvel, env));
}

void MuJoCoPhysics::SetPlant(int env, const Plant& plant) {
  // From here on, each environment has its own plant.
  config_.plants.resize(config_.num_envs, config_.plants.front());
  config_.plants[env] = plant;
  const Slice& slice = SliceOf(env);
  const int row = env - slice.first;
  WritePlant(plant, FieldsOf(slice.batch.get(), row));
  mjb_setConst(slice.batch.get(), &row, 1);
}

void MuJoCoPhysics::Push(int env, const std::array<double, 2>& torque) {
  std::ranges::copy(torque, Component(SliceOf(env).push, env));
}

bool MuJoCoPhysics::BlewUp(int env) const {
  const PendulumState s = state(env);
  const Slice& slice = SliceOf(env);
  const int row = env - slice.first;
  const mjWarningStat* warnings = mjb_warning(slice.batch.get()) + row * mjNWARNING;
  return mjb_status(slice.batch.get())[row] != 0 || warnings[mjWARN_BADQPOS].number > 0 ||
         warnings[mjWARN_BADQVEL].number > 0 || warnings[mjWARN_BADQACC].number > 0 ||
         !std::isfinite(s.q1 + s.q2 + s.w1 + s.w2);
}

void MuJoCoPhysics::Judge(int env, double torque, StepResult& result) const {
  const size_t obs_size = result.next_obs.size() / result.reward.size();
  const PendulumState s = state(env);
  const Plant& plant = config_.plant(env);
  const double tau = std::clamp(torque, -plant.torque_limit, plant.torque_limit);
  std::ranges::copy(Observe(plant, s, config_.scale),
                    std::span(result.next_obs).subspan(env * obs_size).begin());
  config_.reward.Weigh(env, RewardTerms(plant, s, tau, config_.scale), result);
  result.at_goal[env] = Inverted(s) ? 1 : 0;
  result.torque[env] = tau;
  result.work[env] = std::abs(tau * (MotorAngle(plant, s) - previous_angle_[env]));
}

void MuJoCoPhysics::Step(std::span<const double> torque, StepResult& result) {
  // The lambda captures only one reference, so std::function needs no allocation.
  const struct {
    std::span<const double> torque;
    StepResult& result;
  } step{torque, result};
  ParallelFor(config_.pool, static_cast<int>(slices_.size()),
              [this, &step](int slice) { StepSlice(slices_[slice], step.torque, step.result); });
}

void MuJoCoPhysics::StepSlice(const Slice& slice, std::span<const double> torque,
                              StepResult& result) {
  const int end = slice.first + slice.count;
  for (int env = slice.first; env < end; ++env) {
    previous_angle_[env] = MotorAngle(config_.plant(env), state(env));
    Component(slice.ctrl, env)[0] = torque[env];
  }
  mjb_step(slice.batch.get(), nullptr, 0, config_.physics_steps, mjSTAGE_NONE);
  for (int env = slice.first; env < end; ++env) {
    result.terminated[env] = BlewUp(env) ? 1 : 0;
    if (!result.terminated[env]) Judge(env, torque[env], result);
  }
}

void MuJoCoPhysics::State(const Archive& archive) {
  for (const Slice& slice : slices_) {
    const size_t size = static_cast<size_t>(slice.count) * static_cast<size_t>(state_size_);
    archive.Array(Concat("state.", slice.first), std::span(mjb_state(slice.batch.get()), size));
  }
}

}  // namespace

const Engine kMuJoCo{kMuJoCoName, [](const PhysicsConfig& config) -> std::unique_ptr<Physics> {
                       return std::make_unique<MuJoCoPhysics>(config);
                     }};

}  // namespace upswing

#include "pendulum/pendulum_env.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "pendulum/timestep.h"

namespace upswing {
namespace {

/// The random streams other than the start states' stream, for (seed, stream of the environments).
std::string PlantStream(const std::string& stream) { return Concat(stream, ": plant"); }
std::string NoiseStream(const std::string& stream) { return Concat(stream, ": sensor noise"); }

/// The sensors and motors of these settings; none if they are perfect.
std::optional<Disturber> MakeDisturber(const PendulumEnvConfig& config) {
  const Randomization& random = config.randomization;
  Disturbance largest;
  for (const Disturbance& each : config.disturbances) {
    largest = Larger(largest, random.Largest(each));
  }
  if (!largest.any()) return std::nullopt;
  return Disturber(config.disturbances, config.num_envs, largest, config.seed,
                   NoiseStream(config.stream), config.first_index);
}

/// The settings, if their time step is stable for all plants. Throws BadInput.
const PendulumEnvConfig& Checked(const PendulumEnvConfig& config) {
  for (const Plant& plant : config.plants) CheckTimestep(plant, config.randomization, "plant");
  return config;
}

/// The settings of the physics, which judges by the built-in terms that an expression may use.
PhysicsConfig PhysicsOf(const PendulumEnvConfig& config) {
  PhysicsConfig physics = config;
  if (!config.reward.expression.empty()) physics.reward = RewardConfig();
  return physics;
}

}  // namespace

std::string RewardAsymmetry(const PendulumEnvConfig& config) {
  const std::string& reward = config.reward.expression;
  if (reward.empty()) return "";
  const std::optional<Posterior> posterior = config.randomization.MakePosterior();
  return OwnReward(reward).Asymmetry([&](Rng& rng) {
    Plant plant = config.randomization.Draw(config.plants[rng.Below(config.plants.size())], rng);
    Disturbance unused;
    if (posterior) posterior->Deviate(plant, unused, rng);
    return plant;
  });
}

EnvSpec PendulumSpec(const PendulumEnvConfig& config) {
  EnvSpec spec;
  spec.task = kDoublePendulum;
  spec.num_envs = config.num_envs;
  spec.obs_size = kObservationSize + (config.identified_from ? kIdentifiedSize : 0) +
                  (config.any_pose ? kGoalSize : 0) + config.memory * kMemorySize;
  spec.action_limit = {config.plant(0).torque_limit};
  spec.step_seconds = kControlPeriod;
  spec.term_names = {kRewardTermNames.begin(), kRewardTermNames.end()};
  const std::string& reward = config.reward.expression;
  if (!reward.empty()) spec.term_names = OwnReward(reward).names();
  spec.mirror_signs = {kMirrorSigns.begin(), kMirrorSigns.end()};
  if (config.identified_from) {
    spec.mirror_signs.insert(spec.mirror_signs.end(), kIdentifiedMirrorSigns.begin(),
                             kIdentifiedMirrorSigns.end());
  }
  if (config.any_pose) spec.mirror_signs.insert(spec.mirror_signs.end(), kGoalSize, 1.0F);
  spec.mirror_signs.resize(static_cast<size_t>(spec.obs_size), -1.0F);
  if (!RewardAsymmetry(config).empty()) spec.mirror_signs.clear();
  spec.bodies = 2;
  spec.evaluation = {kEvaluationSeconds, kReturnSeconds, kHoldSeconds, 0};
  return spec;
}

PendulumEnv::PendulumEnv(const PendulumEnvConfig& config)
    : config_(Checked(config)),
      spec_(PendulumSpec(config)),
      physics_(config.engine->make(PhysicsOf(config))),
      episode_steps_(std::max<int64_t>(1, std::llround(config_.episode_seconds / kControlPeriod))),
      disturber_(MakeDisturber(config)),
      posterior_(config.randomization.MakePosterior()),
      builder_(config.num_envs, config.memory, config.identified_from, config.any_pose),
      exact_(!disturber_ && !config.assumed_plant && !config.identified_from) {
  const auto n = static_cast<size_t>(config_.num_envs);
  const std::string& reward = config.reward.expression;
  if (!reward.empty()) reward_ = std::make_unique<OwnReward>(reward, config.num_envs);
  step_counts_.resize(n);
  obs_.resize(n * static_cast<size_t>(spec_.obs_size));
  if (config_.randomization.any()) plants_.resize(n);
  for (int i = 0; i < config_.num_envs; ++i) {
    const uint64_t index = config_.first_index + static_cast<uint64_t>(i);
    if (!plants_.empty()) {
      plant_rngs_.emplace_back(config_.seed, PlantStream(config_.stream), index);
    }
    rngs_.emplace_back(config_.seed, config_.stream, index);
  }
  plant_seeds_ = plant_rngs_;
  for (int i = 0; i < config_.num_envs; ++i) Reset(i);
}

void PendulumEnv::Lean(int env, std::span<double> lean) const {
  std::ranges::copy(upswing::Lean(SeenFrom(goal(env).value_or(Pose()), state(env))), lean.begin());
}

Matrix<const float> PendulumEnv::obs() const {
  return {obs_.data(), config_.num_envs, spec_.obs_size};
}

void PendulumEnv::SetState(int env, const PendulumState& s) {
  physics_->SetState(env, s);
  step_counts_[static_cast<size_t>(env)] = 0;
  if (disturber_) disturber_->Begin(env, s);
  if (reward_) reward_->Begin(env);
  builder_.Begin(env, ObservedPlant(env), Measure(env, 0).state, Row(obs_, env));
}

Measurement PendulumEnv::Measure(int env, double torque) {
  if (disturber_) return disturber_->Measure(env, state(env), torque);
  return {state(env), torque};
}

const Plant& PendulumEnv::ObservedPlant(int env) const {
  if (config_.identified_from) return *config_.identified_from;
  return config_.assumed_plant ? *config_.assumed_plant : plant(env);
}

void PendulumEnv::Randomize(int env) {
  const auto i = static_cast<size_t>(env);
  const Randomization& random = config_.randomization;
  plant_seeds_[i] = plant_rngs_[i];
  plants_[i] = random.Draw(config_.plant(env), plant_rngs_[i]);
  Disturbance disturbance = random.Draw(config_.disturbance(env), plant_rngs_[i]);
  if (posterior_) {
    posterior_->Deviate(plants_[i], disturbance, plant_rngs_[i]);
    CheckTimestep(plants_[i], "plant drawn from the posterior");
  }
  physics_->SetPlant(env, plants_[i]);
  if (disturber_) disturber_->Set(env, disturbance);
}

void PendulumEnv::Reset(int env) {
  if (!plants_.empty()) Randomize(env);
  Rng& rng = rngs_[static_cast<size_t>(env)];
  const StartStates& start = config_.start;
  const bool is_random = rng.Uniform() < start.random_share;
  PendulumState s = is_random ? start.Random(plant(env), state(env), rng) : start.Hanging(rng);
  if (config_.any_pose && config_.goal) {
    builder_.SetGoal(env, *config_.goal);
  } else if (config_.any_pose && is_random) {
    builder_.SetGoal(env, kPoses[rng.Below(4)]);
  } else if (config_.any_pose) {
    // One of the 12 pairs of a goal and another pose, in which the episode begins.
    const uint64_t pair = rng.Below(12);
    const uint64_t goal = pair % 4;
    const uint64_t first = (goal + 1 + pair / 4) % 4;
    builder_.SetGoal(env, kPoses[goal]);
    s = RestIn(kPoses[first], s);
  }
  SetState(env, s);
}

void PendulumEnv::Restart(int env, std::optional<uint64_t> seed) {
  if (seed) {
    physics_->SetState(env, {});  // a drive begins here, and not where an earlier episode ended
    const auto i = static_cast<size_t>(env);
    rngs_[i] = Rng(*seed, config_.stream);
    if (!plants_.empty()) plant_rngs_[i] = Rng(*seed, PlantStream(config_.stream));
    if (disturber_) disturber_->Seed(env, Rng(*seed, NoiseStream(config_.stream)));
  }
  Reset(env);
}

void PendulumEnv::Hold(int env) {
  held_.resize(static_cast<size_t>(config_.num_envs));
  held_[static_cast<size_t>(env)] = state(env);
}

void PendulumEnv::Step(std::span<const double> torque, StepResult& result) {
  std::span<const double> applied = torque;
  if (disturber_) applied = disturber_->Apply(torque, step_counts_);
  if (reward_) reward_->SwapTerms(result);
  physics_->Step(applied, result);
  JudgeByGoal(result);
  if (reward_) reward_->SwapTerms(result);
  RestoreHeld(result);
  JudgeByOwnReward(result);
  ObserveSuccessors(torque, result);
  KeepTime(result);
  StandIn(result);
  BeginNextStep(result);
}

void PendulumEnv::RestoreHeld(StepResult& result) {
  for (size_t i = 0; i < held_.size(); ++i) {
    if (!held_[i]) continue;
    physics_->SetState(static_cast<int>(i), *held_[i]);
    if (disturber_) disturber_->Undo(static_cast<int>(i), step_counts_[i]);
    result.terminated[i] = 0;
  }
}

void PendulumEnv::JudgeByGoal(StepResult& result) const {
  if (!config_.any_pose) return;
  const RewardConfig built_in;  // an expression uses the terms with weights of 1
  const RewardConfig& reward = reward_ ? built_in : config_.reward;
  for (int env = 0; env < config_.num_envs; ++env) {
    const auto i = static_cast<size_t>(env);
    const Pose goal = *this->goal(env);
    const auto terms = RewardTerms(plant(env), state(env), result.torque[i], goal);
    reward.Weigh(env, terms, result);
    result.at_goal[i] = Inverted(SeenFrom(goal, state(env))) ? 1 : 0;
  }
}

void PendulumEnv::JudgeByOwnReward(StepResult& result) {
  if (!reward_) return;
  for (int env = 0; env < config_.num_envs; ++env) {
    if (IsHeld(env) || result.terminated[static_cast<size_t>(env)]) continue;
    reward_->Judge(env, plant(env), state(env), result);
  }
}

void PendulumEnv::ObserveSuccessors(std::span<const double> chosen, StepResult& result) {
  if (exact_ && config_.memory == 0 && !config_.any_pose) return;
  for (int env = 0; env < config_.num_envs; ++env) {
    if (IsHeld(env)) continue;
    const auto i = static_cast<size_t>(env);
    const Measurement measured = Measure(env, result.torque[i]);
    if (result.terminated[i]) continue;
    const auto before = Row(obs_, env), next = Row(result.next_obs, env);
    if (exact_) {
      builder_.Complete(env, measured, before, chosen[i], next);
    } else {
      builder_.Next(env, ObservedPlant(env), measured, before, chosen[i], next);
    }
  }
}

void PendulumEnv::KeepTime(StepResult& result) {
  for (int env = 0; env < config_.num_envs; ++env) {
    const auto i = static_cast<size_t>(env);
    if (!IsHeld(env)) ++step_counts_[i];
    result.truncated[i] =
        !IsHeld(env) && !result.terminated[i] && step_counts_[i] >= episode_steps_;
  }
}

void PendulumEnv::StandIn(StepResult& result) const {
  const size_t K = spec_.term_names.size();
  for (int env = 0; env < config_.num_envs; ++env) {
    const auto i = static_cast<size_t>(env);
    if (!IsHeld(env) && !result.terminated[i]) continue;
    std::ranges::copy(Row(obs_, env), Row(result.next_obs, env).begin());
    std::ranges::fill(std::span(result.reward_terms).subspan(i * K, K), 0.0);
    result.reward[i] = 0;
    result.at_goal[i] = 0;
    result.torque[i] = 0;
    result.work[i] = 0;
  }
}

void PendulumEnv::BeginNextStep(const StepResult& result) {
  held_.clear();
  // The next observation is the successor, or the start of a new episode.
  std::ranges::copy(result.next_obs, obs_.begin());
  for (int env = 0; env < config_.num_envs; ++env) {
    if (result.done(static_cast<size_t>(env))) Reset(env);
  }
}

void PendulumEnv::State(const Archive& archive) {
  for (size_t i = 0; i < plants_.size(); ++i) {
    // A saved state holds the random stream of each plant; loading draws the plant again.
    plant_seeds_[i].State(archive.In(Concat("plant_seed.", i)));
    if (!archive.loading()) continue;
    plant_rngs_[i] = plant_seeds_[i];
    Randomize(static_cast<int>(i));
  }
  physics_->State(archive);
  archive.Array("step_counts", std::span(step_counts_), {0, episode_steps_ - 1});
  archive.Array("obs", std::span(obs_));
  archive.Scalar("start_noise", config_.start.noise, {0, 10});
  if (disturber_) disturber_->State(archive.In("disturbance"));
  if (reward_) reward_->State(archive.In("reward"));
  builder_.State(archive);
  for (size_t i = 0; i < rngs_.size(); ++i) rngs_[i].State(archive.In(Concat("rng.", i)));
}

}  // namespace upswing

#include "pendulum/pendulum_env.h"

#include <algorithm>

#include "base/error.h"
#include "base/text.h"
#include "pendulum/control_period.h"
#include "pendulum/stages.h"
#include "pendulum/timestep.h"

namespace upswing {
namespace {

/// The settings with the physics steps that all plants need. Throws BadInput.
PendulumEnvConfig WithPhysicsSteps(PendulumEnvConfig config) {
  CheckPeriods(config);
  config.physics_steps = 1;
  for (const Plant& plant : config.plants) {
    config.physics_steps =
        std::max(config.physics_steps,
                 PhysicsStepsFor(plant, config.randomization, config.control_period, "plant"));
  }
  return config;
}

/// The episodes of these settings, before any has begun.
Episodes EpisodesOf(const PendulumEnvConfig& config) {
  PhysicsConfig physics = config;
  physics.reward = BuiltInReward(config);
  const auto n = static_cast<size_t>(config.num_envs);
  Episodes episodes;
  episodes.physics = config.engine->make(physics);
  for (int i = 0; i < config.num_envs; ++i) {
    episodes.plants.push_back(config.plant(i));
    episodes.disturbances.push_back(config.disturbance(i));
  }
  episodes.steps.resize(n);
  if (config.any_pose) episodes.goals.resize(n);
  return episodes;
}

}  // namespace

void CheckPeriods(const PendulumEnvConfig& config) {
  const double period = config.control_period;
  if (!(period >= kShortestPeriod && period <= kLongestPeriod)) {
    throw BadInput(Concat("control_period: expected ", kShortestPeriod, " to ", kLongestPeriod,
                          " s, got ", FormatNumber(period)));
  }
  for (const Disturbance& disturbance : config.disturbances) {
    ExpectWholePeriods("delay", disturbance.delay, period,
                       "; sensor_latency may be any time up to 0.1 s");
  }
  ExpectWholePeriods("randomize_delay", config.randomization.delay, period);
}

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
  spec.step_seconds = config.control_period;
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
  const double time = config.scale.time;
  spec.evaluation = {.seconds = kEvaluationSeconds * time,
                     .return_seconds = kReturnSeconds * time,
                     .hold_seconds = kHoldSeconds * time,
                     .return_weight = config.control_period / (kControlPeriod * time)};
  return spec;
}

PendulumEnv::PendulumEnv(const PendulumEnvConfig& config)
    : config_(WithPhysicsSteps(config)),
      spec_(PendulumSpec(config_)),
      episodes_(EpisodesOf(config_)),
      stages_(MakeStages(config_)),
      obs_(static_cast<size_t>(config.num_envs) * static_cast<size_t>(spec_.obs_size)) {
  for (int i = 0; i < config_.num_envs; ++i) {
    rngs_.emplace_back(config_.seed, config_.stream,
                       config_.first_index + static_cast<uint64_t>(i));
  }
  for (int i = 0; i < config_.num_envs; ++i) Reset(i);
}

void PendulumEnv::Lean(int env, std::span<double> lean) const {
  std::ranges::copy(upswing::Lean(SeenFrom(goal(env).value_or(Pose()), state(env))), lean.begin());
}

Matrix<const float> PendulumEnv::obs() const {
  return {obs_.data(), config_.num_envs, spec_.obs_size};
}

void PendulumEnv::Step(std::span<const double> torque, StepResult& result) {
  ControlStep step{episodes_, torque, torque, obs(), result};
  for (const auto& stage : stages_) stage->Act(step);
  episodes_.physics->Step(step.applied, result);
  RestoreHeld(result);
  for (const auto& stage : stages_) stage->Judge(step);
  for (const auto& stage : stages_) stage->Observe(step);
  for (const auto& stage : stages_) stage->KeepTime(step);
  StandIn(step);
  BeginNextStep(result);
}

void PendulumEnv::RestoreHeld(StepResult& result) {
  for (size_t i = 0; i < episodes_.held.size(); ++i) {
    if (!episodes_.held[i]) continue;
    episodes_.physics->SetState(static_cast<int>(i), *episodes_.held[i]);
    result.terminated[i] = 0;
  }
}

void PendulumEnv::StandIn(const ControlStep& step) const {
  const size_t K = spec_.term_names.size();
  StepResult& result = step.result;
  for (int env = 0; env < config_.num_envs; ++env) {
    if (step.moves(env)) continue;
    const auto i = static_cast<size_t>(env);
    std::ranges::copy(step.obs.row(env), step.next_obs(env).begin());
    std::ranges::fill(std::span(result.reward_terms).subspan(i * K, K), 0.0);
    result.reward[i] = 0;
    result.at_goal[i] = 0;
    result.torque[i] = 0;
    result.work[i] = 0;
  }
}

void PendulumEnv::BeginNextStep(const StepResult& result) {
  episodes_.held.clear();
  // The next observation is the successor, or the start of a new episode.
  std::ranges::copy(result.next_obs, obs_.begin());
  for (int env = 0; env < config_.num_envs; ++env) {
    if (result.done(static_cast<size_t>(env))) Reset(env);
  }
}

void PendulumEnv::Reset(int env) {
  for (const auto& stage : stages_) stage->Prepare(env, episodes_);
  Rng& rng = rngs_[static_cast<size_t>(env)];
  const StartStates& random_start = config_.start;
  EpisodeStart start{{}, rng.Uniform() < random_start.random_share, rng};
  if (start.is_random) {
    start.state = random_start.Random(plant(env), state(env), rng);
  } else {
    start.state = random_start.Hanging(config_.scale, rng);
  }
  for (const auto& stage : stages_) stage->Place(env, episodes_, start);
  SetState(env, start.state);
}

void PendulumEnv::SetState(int env, const PendulumState& s) {
  episodes_.physics->SetState(env, s);
  const Matrix<float> rows(obs_, config_.num_envs, spec_.obs_size);
  const std::span<float> obs = rows.row(env);
  std::ranges::fill(obs, 0.0F);
  std::ranges::copy(Observe(plant(env), state(env), config_.scale), obs.begin());
  for (const auto& stage : stages_) stage->Begin(env, episodes_, obs);
}

void PendulumEnv::Restart(int env, std::optional<uint64_t> seed) {
  if (seed) {
    episodes_.physics->SetState(env, {});  // a drive begins here, not where an episode ended
    rngs_[static_cast<size_t>(env)] = Rng(*seed, config_.stream);
    for (const auto& stage : stages_) stage->Seed(env, *seed);
  }
  Reset(env);
}

void PendulumEnv::Hold(int env) {
  episodes_.held.resize(static_cast<size_t>(config_.num_envs));
  episodes_.held[static_cast<size_t>(env)] = state(env);
}

void PendulumEnv::State(const Archive& archive) {
  for (const auto& stage : stages_) stage->State(archive, episodes_);
  episodes_.physics->State(archive);
  archive.Array("obs", std::span(obs_));
  archive.Scalar("start_noise", config_.start.noise, {0, 10});
  for (size_t i = 0; i < rngs_.size(); ++i) rngs_[i].State(archive.In(Concat("rng.", i)));
}

}  // namespace upswing

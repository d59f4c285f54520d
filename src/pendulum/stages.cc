#include "pendulum/stages.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "pendulum/control_period.h"
#include "pendulum/pendulum_env.h"
#include "pendulum/timestep.h"

namespace upswing {
namespace {

/// The random streams other than the start states' stream, for a stream of environments.
std::string PlantStream(const std::string& stream) { return Concat(stream, ": plant"); }
std::string LateStream(const std::string& stream) { return Concat(stream, ": late steps"); }
std::string NoiseStream(const std::string& stream) { return Concat(stream, ": sensor noise"); }

/// For each setting, the largest value that an episode may have.
Disturbance LargestDisturbance(const PendulumEnvConfig& config) {
  Disturbance largest;
  for (const Disturbance& each : config.disturbances) {
    largest = Larger(largest, config.randomization.Largest(each));
  }
  return largest;
}

int64_t IndexOf(const Pose& pose) { return std::ranges::find(kPoses, pose) - kPoses.begin(); }

}  // namespace

// ---- Random plants, sensors and motors.

RandomConditions::RandomConditions(const PendulumEnvConfig& config)
    : randomization_(config.randomization),
      posterior_(config.randomization.MakePosterior()),
      period_(config.control_period),
      timestep_(config.timestep()),
      stream_(PlantStream(config.stream)) {
  for (int i = 0; i < config.num_envs; ++i) {
    nominal_plants_.push_back(config.plant(i));
    nominal_disturbances_.push_back(config.disturbance(i));
    next_.emplace_back(config.seed, stream_, config.first_index + static_cast<uint64_t>(i));
  }
  current_ = next_;
}

void RandomConditions::Seed(int env, uint64_t seed) {
  next_[static_cast<size_t>(env)] = Rng(seed, stream_);
}

void RandomConditions::Prepare(int env, Episodes& episodes) {
  const auto i = static_cast<size_t>(env);
  current_[i] = next_[i];
  Plant& plant = episodes.plants[i];
  Disturbance& disturbance = episodes.disturbances[i];
  plant = randomization_.Draw(nominal_plants_[i], next_[i]);
  disturbance = randomization_.Draw(nominal_disturbances_[i], period_, next_[i]);
  if (posterior_) {
    posterior_->Deviate(plant, disturbance, next_[i]);
    CheckTimestep(plant, "plant drawn from the posterior", timestep_);
  }
  episodes.physics->SetPlant(env, plant);
}

void RandomConditions::State(const Archive& archive, Episodes& episodes) {
  for (size_t i = 0; i < current_.size(); ++i) {
    current_[i].State(archive.In(Concat("plant_seed.", i)));
    if (!archive.loading()) continue;
    next_[i] = current_[i];
    Prepare(static_cast<int>(i), episodes);
  }
}

// ---- Delayed motors.

DelayedMotors::DelayedMotors(int num_envs, double control_period, int longest)
    : period_(control_period),
      longest_(static_cast<size_t>(longest)),
      queues_(static_cast<size_t>(num_envs) * longest_),
      applied_(static_cast<size_t>(num_envs)) {}

void DelayedMotors::Begin(int env, Episodes& /*episodes*/, std::span<float> /*obs*/) {
  std::ranges::fill(Queue(env), 0.0);
}

void DelayedMotors::Act(ControlStep& step) {
  const Episodes& episodes = step.episodes;
  for (int env = 0; env < step.num_envs(); ++env) {
    const auto i = static_cast<size_t>(env);
    applied_[i] = step.applied[i];
    const int delay = episodes.disturbances[i].delay_steps(period_);
    if (delay == 0 || episodes.is_held(env)) continue;
    // The queue is a ring as long as the delay: the new torque replaces the one that is due now.
    std::swap(applied_[i], Queue(env)[static_cast<size_t>(episodes.steps[i] % delay)]);
  }
  step.applied = applied_;
}

void DelayedMotors::State(const Archive& archive, Episodes& /*episodes*/) {
  archive.In("disturbance").Array("queues", std::span(queues_));
}

// ---- Late control steps.

LateSteps::LateSteps(const PendulumEnvConfig& config)
    : period_(config.control_period),
      stream_(LateStream(config.stream)),
      applied_(static_cast<size_t>(config.num_envs)),
      waits_(static_cast<size_t>(config.num_envs)) {
  for (int i = 0; i < config.num_envs; ++i) {
    rngs_.emplace_back(config.seed, stream_, config.first_index + static_cast<uint64_t>(i));
  }
}

void LateSteps::Seed(int env, uint64_t seed) {
  rngs_[static_cast<size_t>(env)] = Rng(seed, stream_);
}

void LateSteps::Begin(int env, Episodes& /*episodes*/, std::span<float> /*obs*/) {
  applied_[static_cast<size_t>(env)] = 0;
  waits_[static_cast<size_t>(env)] = 0;
}

void LateSteps::Act(ControlStep& step) {
  for (int env = 0; env < step.num_envs(); ++env) {
    const auto i = static_cast<size_t>(env);
    const Disturbance& disturbance = step.episodes.disturbances[i];
    if (step.episodes.is_held(env)) continue;
    if (waits_[i] > 0) {
      --waits_[i];
    } else if (disturbance.is_late() && rngs_[i].Uniform() < disturbance.late_share) {
      // This step and the following ones within the lateness keep the torque.
      waits_[i] = static_cast<int64_t>(rngs_[i].Uniform(0, disturbance.late) / period_);
    } else {
      applied_[i] = step.applied[i];
    }
  }
  step.applied = applied_;
}

void LateSteps::State(const Archive& archive, Episodes& /*episodes*/) {
  const Archive late = archive.In("late_steps");
  late.Array("applied", std::span(applied_));
  late.Array("waits", std::span(waits_),
             {0, static_cast<int64_t>(kLargestDelay / kShortestPeriod)});
  for (size_t i = 0; i < rngs_.size(); ++i) rngs_[i].State(late.In(Concat("rng.", i)));
}

// ---- Goals.

PoseGoal::PoseGoal(const PendulumEnvConfig& config)
    : fixed_(config.goal),
      built_in_(BuiltInReward(config)),
      scale_(config.scale),
      memory_(config.memory) {}

void PoseGoal::Place(int env, Episodes& episodes, EpisodeStart& start) {
  int64_t& goal = episodes.goals[static_cast<size_t>(env)];
  if (fixed_) {
    goal = IndexOf(*fixed_);
  } else if (start.is_random) {
    goal = static_cast<int64_t>(start.rng.Below(4));
  } else {
    // One of the 12 pairs of a goal and another pose, in which the episode begins.
    const uint64_t pair = start.rng.Below(12);
    goal = static_cast<int64_t>(pair % 4);
    const uint64_t first = (pair % 4 + 1 + pair / 4) % 4;
    start.state = RestIn(kPoses[first], start.state);
  }
}

void PoseGoal::Begin(int env, Episodes& episodes, std::span<float> obs) {
  WriteGoal(*episodes.goal(env), memory_, obs);
}

void PoseGoal::Judge(ControlStep& step) {
  for (int env = 0; env < step.num_envs(); ++env) {
    const auto i = static_cast<size_t>(env);
    const Pose goal = *step.episodes.goal(env);
    const PendulumState state = step.episodes.state(env);
    const auto terms =
        RewardTerms(step.episodes.plants[i], state, step.result.torque[i], goal, scale_);
    built_in_.Weigh(env, terms, step.result);
    step.result.at_goal[i] = Inverted(SeenFrom(goal, state)) ? 1 : 0;
  }
}

void PoseGoal::Observe(ControlStep& step) {
  for (int env = 0; env < step.num_envs(); ++env) {
    WriteGoal(*step.episodes.goal(env), memory_, step.next_obs(env));
  }
}

void PoseGoal::State(const Archive& archive, Episodes& episodes) {
  archive.Array("goals", std::span(episodes.goals), {0, kPoses.size() - 1});
}

// ---- Rewards of your own.

ExpressionReward::ExpressionReward(const PendulumEnvConfig& config)
    : reward_(config.reward.expression, config.num_envs, config.control_period) {}

void ExpressionReward::Begin(int env, Episodes& /*episodes*/, std::span<float> /*obs*/) {
  reward_.Begin(env);
}

void ExpressionReward::Act(ControlStep& step) {
  // Physics, and PoseGoal after it, write the built-in terms in place of the expression's.
  reward_.SwapTerms(step.result);
}

void ExpressionReward::Judge(ControlStep& step) {
  reward_.SwapTerms(step.result);
  for (int env = 0; env < step.num_envs(); ++env) {
    if (!step.moves(env)) continue;
    reward_.Judge(env, step.episodes.plants[static_cast<size_t>(env)], step.episodes.state(env),
                  step.result);
  }
}

void ExpressionReward::State(const Archive& archive, Episodes& /*episodes*/) {
  reward_.State(archive.In("reward"));
}

// ---- Perception.

Perception::Perception(const PendulumEnvConfig& config, std::optional<NoisySensors> sensors)
    : sensors_(std::move(sensors)),
      stream_(NoiseStream(config.stream)),
      assumed_plant_(config.identified_from ? config.identified_from : config.assumed_plant),
      keeps_true_state_(!sensors_ && !assumed_plant_),
      builder_(config.num_envs, config.scale, config.control_period, config.memory,
               config.identified_from) {}

void Perception::Seed(int env, uint64_t seed) {
  if (sensors_) sensors_->Seed(env, Rng(seed, stream_));
}

void Perception::Begin(int env, Episodes& episodes, std::span<float> obs) {
  if (sensors_) sensors_->Begin(env, episodes.state(env));
  builder_.Begin(env, ObservedPlant(env, episodes), Measure(env, episodes, 0).state, obs);
}

void Perception::Observe(ControlStep& step) {
  for (int env = 0; env < step.num_envs(); ++env) {
    if (step.episodes.is_held(env)) continue;
    const auto i = static_cast<size_t>(env);
    // Sensors also draw noise in a step that blows up.
    const Measurement measured = Measure(env, step.episodes, step.result.torque[i]);
    if (!step.moves(env)) continue;
    const auto before = step.obs.row(env);
    const auto next = step.next_obs(env);
    if (keeps_true_state_) {
      builder_.Complete(env, measured, before, step.chosen[i], next);
    } else {
      builder_.Next(env, ObservedPlant(env, step.episodes), measured, before, step.chosen[i], next);
    }
  }
}

void Perception::State(const Archive& archive, Episodes& /*episodes*/) {
  if (sensors_) sensors_->State(archive.In("disturbance"));
  builder_.State(archive);
}

Measurement Perception::Measure(int env, const Episodes& episodes, double torque) {
  const PendulumState state = episodes.state(env);
  if (!sensors_) return {state, torque};
  return sensors_->Measure(env, episodes.disturbances[static_cast<size_t>(env)], state, torque);
}

const Plant& Perception::ObservedPlant(int env, const Episodes& episodes) const {
  return assumed_plant_ ? *assumed_plant_ : episodes.plants[static_cast<size_t>(env)];
}

// ---- Time limit.

void TimeLimit::Begin(int env, Episodes& episodes, std::span<float> /*obs*/) {
  episodes.steps[static_cast<size_t>(env)] = 0;
}

void TimeLimit::KeepTime(ControlStep& step) {
  std::vector<int64_t>& steps = step.episodes.steps;
  for (int env = 0; env < step.num_envs(); ++env) {
    const auto i = static_cast<size_t>(env);
    if (!step.episodes.is_held(env)) ++steps[i];
    step.result.truncated[i] = step.moves(env) && steps[i] >= limit_ ? 1 : 0;
  }
}

void TimeLimit::State(const Archive& archive, Episodes& episodes) {
  archive.Array("step_counts", std::span(episodes.steps), {0, limit_ - 1});
}

// ---- The list.

RewardConfig BuiltInReward(const PendulumEnvConfig& config) {
  return config.reward.expression.empty() ? config.reward : RewardConfig();
}

std::vector<std::unique_ptr<Stage>> MakeStages(const PendulumEnvConfig& config) {
  const Disturbance largest = LargestDisturbance(config);
  const bool has_expression = !config.reward.expression.empty();
  const int64_t steps = PeriodsIn(config.episode_seconds, config.control_period);
  std::optional<NoisySensors> sensors;
  if (largest.any()) {
    sensors.emplace(config.num_envs, config.control_period, largest.sensors, config.seed,
                    NoiseStream(config.stream), config.first_index);
  }
  const bool perceives =
      sensors || config.assumed_plant || config.identified_from || config.memory > 0;

  // The order matters: a stage may read what an earlier one wrote in the same hook.
  std::vector<std::unique_ptr<Stage>> stages;
  // First: motors and sensors follow the episode's disturbance, which it draws.
  if (config.randomization.any()) stages.push_back(std::make_unique<RandomConditions>(config));
  // A saved run with a disturbance has the state of both motors and sensors.
  if (largest.any()) {
    stages.push_back(std::make_unique<DelayedMotors>(config.num_envs, config.control_period,
                                                     largest.delay_steps(config.control_period)));
  }
  // After DelayedMotors: a late loop sends nothing, and the last torque stays.
  if (largest.is_late()) stages.push_back(std::make_unique<LateSteps>(config));
  // Before ExpressionReward, which reads the terms and the goal that PoseGoal judges.
  if (config.any_pose) stages.push_back(std::make_unique<PoseGoal>(config));
  if (has_expression) stages.push_back(std::make_unique<ExpressionReward>(config));
  if (perceives) stages.push_back(std::make_unique<Perception>(config, std::move(sensors)));
  stages.push_back(std::make_unique<TimeLimit>(std::max<int64_t>(1, steps)));
  return stages;
}

}  // namespace upswing

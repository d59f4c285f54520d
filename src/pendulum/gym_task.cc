#include "pendulum/gym_task.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/text.h"

namespace upswing {

GymTask::GymTask(EnvSpec spec, Limits limits, const GymTaskConfig& config)
    : spec_(std::move(spec)), limits_(std::move(limits)) {
  spec_.num_envs = config.num_envs;
  const auto n = static_cast<size_t>(config.num_envs);
  for (size_t i = 0; i < n; ++i) {
    rngs_.emplace_back(config.seed, config.stream, config.first_index + i);
  }
  states_.resize(limits_.state_bound.size() * n);
  obs_.resize(n * static_cast<size_t>(spec_.obs_size));
  step_counts_.resize(n);
}

void GymTask::Begin() {
  for (int env = 0; env < num_envs(); ++env) Reset(env);
}

void GymTask::Reset(int env) {
  Rng& rng = rngs_[static_cast<size_t>(env)];
  for (int k = 0; k < num_states(); ++k) {
    const double bound = limits_.start_bound[static_cast<size_t>(k)];
    states()(k, env) = rng.Uniform(-bound, bound);
  }
  BeginEpisode(env);
}

void GymTask::BeginEpisode(int env) {
  step_counts_[static_cast<size_t>(env)] = 0;
  Observe(states().Cols(env, 1), Observations().Rows(env, 1));
}

void GymTask::GetState(int env, std::span<double> state) const {
  const Matrix<const double> all(states_.data(), num_states(), num_envs());
  for (int k = 0; k < num_states(); ++k) state[static_cast<size_t>(k)] = all(k, env);
}

void GymTask::SetState(int env, std::span<const double> state) {
  for (size_t k = 0; k < limits_.state_bound.size(); ++k) {
    const double bound = limits_.state_bound[k];
    if (std::abs(state[k]) <= bound) continue;  // false for NaN
    throw BadInput(Concat(spec_.task, ": expected ", spec_.state_names[k], " from ", -bound, " to ",
                          bound, " ", spec_.state_units[k], ", got ", state[k]));
  }
  for (int k = 0; k < num_states(); ++k) states()(k, env) = state[static_cast<size_t>(k)];
  BeginEpisode(env);
}

void GymTask::Step(Matrix<const double> action, StepResult& result) {
  const double limit = spec_.action_limit[0];
  const size_t n = step_counts_.size(), terms = spec_.term_names.size();
  for (size_t i = 0; i < n; ++i) {
    result.torque[i] = std::clamp(action(static_cast<int>(i), 0), -limit, limit);
  }
  Move(states(), result.torque, result);
  Observe(states(), Observations());
  std::ranges::copy(obs_, result.next_obs.begin());

  for (size_t i = 0; i < n; ++i) {
    result.reward[i] = 0;
    for (size_t k = 0; k < terms; ++k) result.reward[i] += result.reward_terms[i * terms + k];
    const bool out_of_time = ++step_counts_[i] >= limits_.episode_steps;
    result.truncated[i] = out_of_time && result.terminated[i] == 0 ? 1 : 0;
    if (result.done(i)) Reset(static_cast<int>(i));
  }
}

void GymTask::State(const Archive& archive) {
  for (int k = 0; k < num_states(); ++k) {
    const double bound = limits_.state_bound[static_cast<size_t>(k)];
    archive.Array(spec_.state_names[static_cast<size_t>(k)], states().row(k), {-bound, bound});
  }
  archive.Array("step_counts", std::span(step_counts_), {0, limits_.episode_steps - 1});
  for (size_t i = 0; i < rngs_.size(); ++i) rngs_[i].State(archive.In(Concat("rng.", i)));
  if (archive.loading()) Observe(states(), Observations());
}

}  // namespace upswing

#include "python/src/batch_env.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"
#include "io/machine.h"
#include "mujoco/engines.h"
#include "rl/torque_levels.h"
#include "sim/pendulum_env.h"

namespace upswing {
namespace {

std::unique_ptr<SeededEnv> MakeSeededEnv(const Config& config, ThreadPool& pool) {
  EnvConfig settings = config.Environments();
  settings.engine = &FindEngine(config.physics, "physics");
  settings.pool = &pool;
  std::unique_ptr<VectorEnv> env = MakeEnv(settings);
  auto* seeded = dynamic_cast<SeededEnv*>(env.get());
  if (seeded == nullptr) {
    throw BadInput(Concat("task: expected one whose episodes can be begun, got ", config.task));
  }
  (void)env.release();
  return std::unique_ptr<SeededEnv>(seeded);
}

/// Such as ` of environment 3`; empty where there is one alone.
std::string OfEnvironment(size_t i, int num_envs) {
  return num_envs == 1 ? "" : Concat(" of environment ", i);
}

}  // namespace

BatchEnv::BatchEnv(const Config& config, int64_t levels, Autoreset autoreset)
    : config_(config),
      autoreset_(autoreset),
      pool_(ResolveThreads(config.train.threads)),
      env_(MakeSeededEnv(config, pool_)),
      result_(env_->spec()) {
  const EnvSpec& spec = env_->spec();
  actions_.resize(static_cast<size_t>(spec.num_envs) * spec.action_limit.size());
  if (levels > 0) levels_ = TorqueLevels(spec.action_limit.front(), levels);
  ended_.reserve(static_cast<size_t>(spec.num_envs));
  ShowStarts();
}

std::span<const float> BatchEnv::obs() const {
  return autoreset_ == Autoreset::kSameStep ? std::span<const float>(env_->obs().values())
                                            : final_obs();
}

std::span<const float> BatchEnv::final_obs() const { return result_.next_obs; }

void BatchEnv::ShowStart(int env) {
  const auto obs = env_->obs();
  std::ranges::copy(obs.row(env),
                    Matrix<float>(result_.next_obs, obs.rows(), obs.cols()).row(env).begin());
}

void BatchEnv::ShowStarts() { std::ranges::copy(env_->obs().values(), result_.next_obs.begin()); }

void BatchEnv::Reset(std::span<const std::optional<uint64_t>> seeds,
                     std::span<const uint8_t> mask) {
  for (size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] == 0) continue;
    const int env = static_cast<int>(i);
    // Of one that has ended, another episode has begun and nobody has seen it.
    const bool begun = std::erase(ended_, env) > 0;
    if (!begun || seeds[i]) env_->Restart(env, seeds[i]);
    result_.torque[i] = 0;  // none acts yet
    ShowStart(env);
  }
}

void BatchEnv::SetState(int env, std::span<const double> state) {
  const std::vector<std::string>& names = spec().state_names;
  for (size_t k = 0; k < state.size(); ++k) {
    if (std::isfinite(state[k])) continue;
    throw BadInput(Concat("state: expected a finite ", names[k], ", got ", state[k]));
  }
  env_->SetState(env, state);
  ShowStart(env);
}

template <typename Number>
void BatchEnv::StepContinuous(std::span<const Number> action) {
  for (size_t i = 0; i < action.size(); ++i) {
    if (!std::isfinite(action[i])) {
      const size_t A = spec().action_limit.size();
      throw BadInput(Concat("action", OfEnvironment(i / A, spec().num_envs),
                            ": expected a finite number of ", spec().action_unit, ", got ",
                            action[i]));
    }
    actions_[i] = static_cast<double>(action[i]);
  }
  Step();
}
template void BatchEnv::StepContinuous(std::span<const float>);
template void BatchEnv::StepContinuous(std::span<const double>);

template <typename Number>
void BatchEnv::StepLevels(std::span<const Number> action) {
  for (size_t i = 0; i < action.size(); ++i) {
    const auto level = static_cast<size_t>(action[i]);  // of a negative number: a large one
    if (level >= levels_.size()) {
      throw BadInput(Concat("action", OfEnvironment(i, spec().num_envs),
                            ": expected a torque level from 0 to ", levels_.size() - 1, ", got ",
                            static_cast<int64_t>(action[i])));
    }
    actions_[i] = levels_[level];
  }
  Step();
}
template void BatchEnv::StepLevels(std::span<const int64_t>);
template void BatchEnv::StepLevels(std::span<const int32_t>);

void BatchEnv::Step() {
  // An environment whose episode has ended is at the start of another one already.
  for (const int env : ended_) env_->Hold(env);
  env_->Step({actions_.data(), spec().num_envs, spec().action_size()}, result_);
  ended_.clear();
  if (autoreset_ == Autoreset::kSameStep) return;
  for (int env = 0; env < spec().num_envs; ++env) {
    if (result_.done(static_cast<size_t>(env))) ended_.push_back(env);
  }
}

Plant BatchEnv::plant(int env) const {
  const auto* pendulum = dynamic_cast<const PendulumEnv*>(env_.get());
  return pendulum == nullptr ? Plant() : pendulum->plant(env);
}

}  // namespace upswing

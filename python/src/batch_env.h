#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/env.h"
#include "core/thread_pool.h"
#include "setup/config.h"
#include "sim/seeded_env.h"

namespace upswing {

/// The environments behind Gymnasium's interface, without Python: N of them stepped together, whose
/// results stay where they are, so that arrays can view them. Letters as in core/env.h; L torque
/// levels.
class BatchEnv {
 public:
  /// What happens to an environment whose episode has ended (Gymnasium's AutoresetMode).
  enum class Autoreset {
    kNextStep,  // the next step begins another episode and ignores the action
    kSameStep,  // another episode begins at once; final_obs has the last observation
  };

  /// Environments as the settings have them; `levels`: how many torques there are to choose from,
  /// 0: any. Throws BadInput.
  BatchEnv(const Config& config, int64_t levels, Autoreset autoreset);

  const EnvSpec& spec() const { return env_->spec(); }
  const std::vector<double>& levels() const { return levels_; }  // (L) N·m
  int threads() const { return pool_.threads(); }

  /// Begins an episode of each environment for which `mask` (N) is not 0. Those with a seed (N)
  /// have the episodes of a first environment with that seed from then on.
  void Reset(std::span<const std::optional<uint64_t>> seeds, std::span<const uint8_t> mask);

  /// Begins an episode of an environment in a state (S).
  void SetState(int env, std::span<const double> state);
  void GetState(int env, std::span<double> state) const { env_->GetState(env, state); }

  /// One step of all environments under actions (N × A), in the task's unit.
  template <typename Number>
  void StepContinuous(std::span<const Number> action);
  /// The same under the numbers of torque levels (N).
  template <typename Number>
  void StepLevels(std::span<const Number> action);

  // Results of the last step; these stay where they are.
  std::span<const float> obs() const;        // (N, D) to act on
  std::span<const float> final_obs() const;  // (N, D) the successors, also of finished episodes
  const StepResult& result() const { return result_; }

  /// The plant of a running episode; the built-in one for tasks without.
  Plant plant(int env) const;
  const Config& config() const { return config_; }

 private:
  /// Steps with actions_.
  void Step();
  /// Lets the present observations be those of the last step.
  void ShowStarts();
  /// The same of one environment.
  void ShowStart(int env);

  Config config_;
  Autoreset autoreset_;
  ThreadPool pool_;
  std::unique_ptr<SeededEnv> env_;
  std::vector<double> levels_;   // (L) N·m
  std::vector<double> actions_;  // (N, A)
  StepResult result_;
  std::vector<int> ended_;  // environments whose next step begins another episode
};

}  // namespace upswing

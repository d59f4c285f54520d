#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "agents/training.h"

namespace upswing {

/// The settings of a training from flags. Throws BadInput as the program does, and for a model,
/// because a page has no files.
Config ConfigOf(const std::vector<FlagValue>& flags);

/// A training that a page runs in slices.
class Learner : private TrainObserver {
 public:
  /// `flags` begin with a named agent ("agent", "fast"). Training and evaluation use the closed
  /// form. Throws BadInput as the program does.
  explicit Learner(const std::vector<FlagValue>& flags);

  /// Makes at most `most` steps of all environments. False once the training is finished.
  bool Run(int most);

  /// Progress, and events since the last call.
  nlohmann::json Report();

  /// An example of the last update; null if there is none.
  nlohmann::json LastUpdate() const;

  /// The current policy and the best evaluated one (empty: none yet), as files.
  std::vector<std::byte> policy() const;
  const std::vector<std::byte>& best() const { return best_; }

  /// The training pendulums: q1 and q2 [rad] of each environment, as bytes of 32-bit floats.
  std::vector<std::byte> Poses() const;

 private:
  void OnEpisode(const TrainState& state, const FinishedEpisode& episode) override;
  void OnEvaluation(const TrainState& state, const Evaluation& evaluation) override;
  void OnBest(const TrainState& state, const Policy& policy) override;

  std::vector<std::byte> best_;
  std::vector<std::string> warnings_;      // about the settings
  nlohmann::json episodes_, evaluations_;  // since the last report
  Training training_;                      // last, as it tells of itself
};

}  // namespace upswing

#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "agents/training.h"

namespace upswing {

/// The settings of a training that flags give. Throws BadInput as the program does, and for a
/// model, as a page has no files.
Config ConfigOf(const std::vector<FlagValue>& flags);

/// A training that a page drives step by step and looks at in between.
class Learner : private TrainObserver {
 public:
  /// With these settings, which begin with a named agent ("agent", "fast"). Physics are the closed
  /// form, in training and evaluation. Throws BadInput as the program does.
  explicit Learner(const std::vector<FlagValue>& flags);

  /// At most this many steps of all environments. False once the training is finished.
  bool Run(int most);

  /// Where the training stands, and what has happened since the last call.
  nlohmann::json Report();

  /// The policy as it stands; the best at an evaluation, empty until there is one. As files.
  std::vector<std::byte> policy() const;
  const std::vector<std::byte>& best() const { return best_; }

  /// The pendulums of the training as they are now: q1 and q2 [rad] of each environment, as bytes
  /// of 32-bit floats.
  std::vector<std::byte> Poses() const;

 private:
  void OnEpisode(const TrainState& state, const FinishedEpisode& episode) override;
  void OnEvaluation(const TrainState& state, const Evaluation& evaluation) override;
  void OnBest(const TrainState& state, const Policy& policy) override;

  std::vector<std::byte> best_;
  nlohmann::json episodes_, evaluations_;  // since the last report
  Training training_;                      // last, as it tells of itself
};

}  // namespace upswing

#pragma once

#include <filesystem>

#include "apps/config.h"
#include "apps/progress.h"
#include "rl/train.h"

namespace upswing {

/// What people see of a training: a progress line, a line for each evaluation, a summary.
class TrainView {
 public:
  /// A training that stands at `state`, whose agent reports `report`.
  TrainView(const TrainState& state, const AgentReport& report);

  /// Prints what is trained and where.
  void Announce(const Config& config, int threads, size_t num_parameters,
                const std::filesystem::path& run) const;

  /// Connects this view to the training's callbacks.
  void Follow(Training& training);

  /// Prints the result and the next commands to type. `finished`: the training was not stopped.
  void Summarize(const TrainState& state, const TrainConfig& config,
                 const std::filesystem::path& run, bool finished);

 private:
  void UpdateRates(const TrainState& state, const AgentReport& report);
  /// The rate of updates and the loss as the lines show them.
  std::string UpdatesText() const;
  std::string LossText() const;
  void ShowProgress(const TrainState& state, int64_t steps_in_all);

  /// Prints in one sentence how far the training is.
  void PrintOutcome(const TrainState& state, const TrainConfig& config, bool finished) const;

  ProgressLine line_;
  int64_t begin_step_;  // where this view's training began
  AgentReport report_;  // the last one

  // Rates of training, between two reports at least half a second apart; before there are such, of
  // all that was reported; 0 before the first report.
  double steps_per_second_ = 0, updates_per_second_ = 0;
  bool rates_settled_ = false;
  int64_t since_step_, since_updates_;
  double since_seconds_;
};

}  // namespace upswing

#pragma once

#include <filesystem>

#include "apps/progress.h"
#include "run/training_run.h"

namespace upswing {

/// What people see of a training: a progress line, a line for each evaluation, a summary.
class TrainView : public TrainingRun::Driver {
 public:
  /// A training, which must outlive this, from where it stands.
  explicit TrainView(const Training& training);

  /// Prints what is trained and where.
  void Announce(const std::filesystem::path& run) const;

  void OnMetrics(const TrainState& s, const Metrics& metrics) override;
  void OnEvaluation(const TrainState& s, const Evaluation& e) override;
  /// Shows progress; signals stop the training.
  TrainRequest AfterStep(const TrainState& s) override;

  /// Prints the result and the next commands to type. `finished`: the training was not stopped.
  void Summarize(const std::filesystem::path& run, bool finished);

 private:
  void UpdateRates(const TrainState& state);
  /// The rate of updates as the lines show it.
  std::string UpdatesText() const;
  /// What the agent has to tell, such as `eps 0.05` and `loss 0.0012`.
  std::vector<std::string> AgentTexts() const;
  void ShowProgress(const TrainState& state);

  /// Prints in one sentence how far the training is.
  void PrintOutcome(bool finished) const;

  const Training& training_;
  ProgressLine line_;
  int64_t begin_step_;  // where this view's training began
  Metrics metrics_;     // the last ones

  // Rates of training, between two reports at least half a second apart; before there are such, of
  // all that was reported; 0 before the first report.
  double steps_per_second_ = 0, updates_per_second_ = 0;
  bool rates_settled_ = false;
  int64_t since_step_, since_updates_;
  double since_seconds_;
};

}  // namespace upswing

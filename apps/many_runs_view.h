#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "apps/progress.h"
#include "apps/signals.h"
#include "study/many_runs.h"

namespace upswing {

/// What people see of many runs: a progress line, a line for each that has ended, a table. Signals
/// stop them.
class ManyRunsView : public ManyRunsObserver {
 public:
  /// The plan must outlive it.
  explicit ManyRunsView(const ManyRuns& many) : many_(many), plan_(many.plan) {}

  void Prepare() override { InstallSignalHandlers(kStoppingTraining); }
  /// Prints what is trained and where. The rate counts the steps made from now on.
  void Begin(const std::vector<SeedRun>& runs) override;
  void Watch(const std::vector<const SeedRun*>& running) override;
  void End(const SeedRun& run) override;
  /// Prints all results and the next command to type.
  void Finish() override;
  TrainRequest Poll() override { return PollSignals(); }
  int stop_signal() const override { return StopSignal(); }

 protected:
  /// Says how it goes on after a signal to stop.
  virtual void SayStopped(size_t done) const;
  /// Runs that are neither done nor failed.
  size_t Left() const;
  void ClearLine() { line_.Clear(); }

 private:
  /// How far all runs are together.
  struct Standing {
    size_t done = 0;             // runs
    double steps = 0, left = 0;  // made, and at most to be made
    double share = 0;            // of the work, 0 to 1
    double steps_per_second = 0;
    std::string time_left;  // such as `at most 3 min 20 s left`
  };
  Standing Measure() const;
  void Announce() const;
  void PrintTable(const Variant& variant) const;

  const ManyRuns& many_;
  const StudyPlan& plan_;
  const std::vector<SeedRun>* runs_ = nullptr;
  std::vector<const SeedRun*> running_;
  ProgressLine line_;
  double steps_before_ = 0;  // made before this process
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace upswing

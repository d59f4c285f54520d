#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "apps/many_runs_view.h"
#include "study/slurm.h"

namespace upswing {

/// What was typed of a job array for Slurm.
struct SlurmRequest {
  std::string options;  // of sbatch
  int64_t tasks = 0;    // workers; 0: one for each run that is not done, up to kMostSlurmTasks
};
inline constexpr int64_t kMostSlurmTasks = 100;  // unless told otherwise

/// The script for runs of a plan as they stand.
std::string SlurmScriptFor(const StudyPlan& plan, const std::vector<SeedRun>& runs,
                           const SlurmRequest& request);

/// Many runs whose workers are the tasks of a job array: queues it, or finds the one that is queued
/// already, and shows how the runs go on. A signal to stop ends the view alone.
class SlurmView : public ManyRunsView {
 public:
  /// The plan must outlive it; many.jobs is 0.
  SlurmView(const ManyRuns& many, SlurmRequest request)
      : ManyRunsView(many), many_(many), request_(std::move(request)) {}

  void Prepare() override;
  /// Throws Failure if the array cannot be queued.
  void Begin(const std::vector<SeedRun>& runs) override;
  /// Throws Failure if nobody works on the runs that are left.
  void Watch(const std::vector<const SeedRun*>& running) override;

 protected:
  void SayStopped(size_t done) const override;

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kAskEvery{15};  // squeue asks a daemon that all share

  void CheckQueue(const std::vector<const SeedRun*>& running, Clock::time_point now);

  const ManyRuns& many_;
  SlurmRequest request_;
  std::optional<SlurmArray> array_;
  Clock::time_point ask_at_{};
  bool none_left_ = false;  // when last asked
};

}  // namespace upswing

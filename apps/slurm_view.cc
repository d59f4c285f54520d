#include "apps/slurm_view.h"

#include <algorithm>
#include <cstdio>

#include "apps/say.h"
#include "core/error.h"
#include "core/format.h"
#include "core/text.h"
#include "io/lease.h"

namespace upswing {
namespace {

std::string Logs(const ManyRuns& many, const SlurmArray& array) {
  return Printable((SlurmFolder(many.plan.folder) / (array.number() + "_*.log")).string());
}

}  // namespace

std::string SlurmScriptFor(const StudyPlan& plan, const std::vector<SeedRun>& runs,
                           const SlurmRequest& request) {
  int64_t tasks = request.tasks;
  if (tasks == 0) {
    const int64_t left =
        std::ranges::count_if(runs, [](const SeedRun& run) { return !run.finished; });
    tasks = std::clamp<int64_t>(left, 1, kMostSlurmTasks);
  }
  return SlurmScript(plan, request.options, tasks);
}

void SlurmView::Prepare() { InstallSignalHandlers("\nthe jobs go on\n"); }

void SlurmView::Begin(const std::vector<SeedRun>& runs) {
  ManyRunsView::Begin(runs);
  if (Left() == 0) return;
  array_ = SlurmArray::LastOf(many_.plan.folder);
  const auto queued = array_ ? array_->TasksLeft() : 0;
  if (!queued) {
    throw Failure(Concat("squeue does not say whether job array ", array_->number(),
                         " of this study is still queued"));
  }
  if (*queued > 0) {
    Say("  Job array {}, queued before: {} left, output in {}\n", array_->number(),
        Counted(*queued, "task"), Logs(many_, *array_));
  } else {
    const std::string script = SlurmScriptFor(many_.plan, runs, request_);
    array_ = SlurmArray::Submit(many_.plan.folder, script);
    Say("  Queued as job array {}, output in {}\n", array_->number(), Logs(many_, *array_));
  }
  std::fflush(stdout);
  ask_at_ = Clock::now() + kAskEvery;
}

void SlurmView::Watch(const std::vector<const SeedRun*>& running) {
  ManyRunsView::Watch(running);
  const auto now = Clock::now();
  if (array_ && now >= ask_at_ && Left() > 0) CheckQueue(running, now);
}

void SlurmView::CheckQueue(const std::vector<const SeedRun*>& running, Clock::time_point now) {
  const auto tasks = array_->TasksLeft();
  const bool are_none = tasks == 0;
  // What the last task did may not have been seen yet.
  const bool were_none = std::exchange(none_left_, are_none);
  ask_at_ = now + (are_none ? std::chrono::seconds(2) : kAskEvery);
  if (!are_none || !were_none) return;
  // Other workers may be at work, or a lost one's claims have to run out.
  for (const SeedRun* run : running) {
    const auto lease = ReadLease(run->claim());
    if (lease && !lease->lost) return;
  }
  ClearLine();
  throw Failure(Concat("no task of job array ", array_->number(), " is left, but ", Left(),
                       " of the runs are not done (output: ", Logs(many_, *array_),
                       "); the same command queues them again"));
}

void SlurmView::SayStopped(size_t done) const {
  if (!array_) return ManyRunsView::SayStopped(done);
  Say("Job array {} goes on; the same command follows it again, `{}` cancels it.\n",
      array_->number(), array_->CancelCommand());
}

}  // namespace upswing

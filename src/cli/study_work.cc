#include "cli/study_work.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/format.h"
#include "base/json.h"
#include "base/text.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "cli/train_view.h"
#include "os/file.h"
#include "runs/lease.h"
#include "runs/study_worker.h"

namespace upswing {
namespace {

/// Appends standard output and error to a file during its lifetime.
class PrintedTo {
 public:
  explicit PrintedTo(const std::filesystem::path& path)
      : file_(path), output_(dup(STDOUT_FILENO)), error_(dup(STDERR_FILENO)) {
    std::fflush(stdout);
    dup2(file_.descriptor(), STDOUT_FILENO);
    dup2(file_.descriptor(), STDERR_FILENO);
  }
  ~PrintedTo() {
    std::fflush(stdout);
    dup2(output_.get(), STDOUT_FILENO);
    dup2(error_.get(), STDERR_FILENO);
  }
  PrintedTo(const PrintedTo&) = delete;
  PrintedTo& operator=(const PrintedTo&) = delete;

 private:
  AppendFile file_;
  Descriptor output_, error_;
};

/// Trains a study's run, and writes the output of `train` to its log.
bool TrainLogged(const SeedRun& run, const std::function<std::unique_ptr<TrainingRun>()>& make,
                 const std::function<bool()>& ours) {
  const PrintedTo log(run.log());
  try {
    return TrainAndShow(*make(), [&] {
      if (!ours())
        throw Failure("another worker may have claimed the run while this one was halted");
    });
  } catch (const std::exception& error) {
    SayError(Printable(error.what()));
    throw;
  }
}

}  // namespace

int WorkOnStudy(const std::filesystem::path& folder) {
  InstallSignalHandlers(kStoppingTraining);
  const StudyPlan plan = ReadPlan(folder);
  const WorkerOutcome outcome = WorkOn(plan, TrainLogged, [] { return StopSignal() != 0; });
  Say("{}: this worker finished {}, {} failed{}{}\n", Printable(folder.string()), outcome.done,
      outcome.failed,
      outcome.claimed_by_others > 0
          ? fmt::format(", {} claimed by other workers", outcome.claimed_by_others)
          : "",
      outcome.stopped ? ", stopped" : "");
  if (outcome.stopped) return kTryAgain;
  return outcome.failed > 0 ? 1 : 0;
}

int PrintStudyStatus(const std::filesystem::path& folder, bool as_json) {
  struct Counts {
    int64_t done = 0, solved = 0, running = 0, lost = 0, failed = 0, stopped = 0, waiting = 0;
  };
  const StudyPlan plan = ReadPlan(folder);
  std::map<const Variant*, Counts> counts;
  std::vector<std::string> lines;
  for (SeedRun& run : RunsOf(plan)) {
    Counts& c = counts[run.variant];
    run.Refresh();
    const auto lease = ReadLease(run.claim());
    if (run.finished) {
      ++c.done;
      c.solved += run.state->solved ? 1 : 0;
    } else if (lease) {
      ++(lease->lost ? c.lost : c.running);
      lines.push_back(fmt::format("  {:<20} {:>11} steps  {} by {}, seen {} ago", run.name,
                                  FormatCount(run.Steps()), lease->lost ? "lost" : "claimed",
                                  Printable(lease->holder), FormatDuration(lease->seconds)));
    } else if (!run.problem.empty()) {
      ++c.failed;
      lines.push_back(fmt::format("  {:<20} failed: {}", run.name, Printable(run.problem)));
    } else {
      ++(run.state ? c.stopped : c.waiting);
    }
  }
  if (as_json) {
    nlohmann::ordered_json j{{"study", folder.string()}};
    for (const Variant& variant : plan.variants) {
      const Counts& c = counts[&variant];
      j["variants"].push_back({{"variant", variant.name},
                               {"done", c.done},
                               {"solved", c.solved},
                               {"running", c.running},
                               {"lost", c.lost},
                               {"failed", c.failed},
                               {"stopped", c.stopped},
                               {"waiting", c.waiting}});
    }
    Say("{}\n", PrintableJson(j));
    return 0;
  }
  Say("{}\n", Printable(folder.string()));
  Say("  {:<20} {:>7} {:>7} {:>8} {:>7} {:>7} {:>8} {:>8}\n", "", "done", "solved", "running",
      "lost", "failed", "stopped", "waiting");
  for (const Variant& variant : plan.variants) {
    const Counts& c = counts[&variant];
    Say("  {:<20} {:>7} {:>7} {:>8} {:>7} {:>7} {:>8} {:>8}\n", variant.name, c.done, c.solved,
        c.running, c.lost, c.failed, c.stopped, c.waiting);
  }
  if (!lines.empty()) Say("\n");
  for (const std::string& line : lines) Say("{}\n", line);
  return 0;
}

}  // namespace upswing

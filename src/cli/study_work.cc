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
  const char* const states[] = {"done",   "solved",  "running", "lost",
                                "failed", "stopped", "waiting"};
  const StudyPlan plan = ReadPlan(folder);
  std::map<const Variant*, std::map<std::string_view, int64_t>> counts;  // of runs, by state
  std::vector<std::string> lines;
  for (SeedRun& run : RunsOf(plan)) {
    auto& count = counts[run.variant];
    run.Refresh();
    const auto lease = ReadLease(run.claim());
    if (run.finished) {
      ++count["done"];
      count["solved"] += run.state->solved ? 1 : 0;
    } else if (lease) {
      ++count[lease->lost ? "lost" : "running"];
      lines.push_back(fmt::format("  {:<20} {:>11} steps  {} by {}, seen {} ago", run.name,
                                  FormatCount(run.Steps()), lease->lost ? "lost" : "claimed",
                                  Printable(lease->holder), FormatDuration(lease->seconds)));
    } else if (!run.problem.empty()) {
      ++count["failed"];
      lines.push_back(fmt::format("  {:<20} failed: {}", run.name, Printable(run.problem)));
    } else {
      ++count[run.state ? "stopped" : "waiting"];
    }
  }
  if (as_json) {
    nlohmann::ordered_json j{{"study", folder.string()}};
    for (const Variant& variant : plan.variants) {
      auto& row = j["variants"].emplace_back();
      row["variant"] = variant.name;
      for (const char* state : states) row[state] = counts[&variant][state];
    }
    Say("{}\n", PrintableJson(j));
    return 0;
  }
  Say("{}\n", Printable(folder.string()));
  Say("  {:<20} {:>8}\n", "", fmt::join(states, " "));
  for (const Variant& variant : plan.variants) {
    Say("  {:<20}", variant.name);
    for (const char* state : states) Say(" {:>8}", counts[&variant][state]);
    Say("\n");
  }
  if (!lines.empty()) Say("\n");
  for (const std::string& line : lines) Say("{}\n", line);
  return 0;
}

}  // namespace upswing

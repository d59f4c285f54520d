#include "runs/compare.h"

#include <algorithm>
#include <set>

#include "base/csv.h"
#include "base/text.h"
#include "os/file.h"
#include "runs/compare_runs.h"
#include "runs/learning_curve.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

std::string SummaryCsv(const std::vector<RunGroup>& groups) {
  CsvTable csv;
  for (const RunGroup& group : groups) {
    const GroupSummary& s = group.summary;
    csv.Add("group", group.label);
    csv.Add("seeds", group.runs.size());
    csv.Add("solved", s.solved);
    csv.Add("solved_low", s.solved_interval.low);
    csv.Add("solved_high", s.solved_interval.high);
    for (const RunFigure& figure : RunFigures()) {
      // Unreached figures are `inf`; the interval of a single run is empty.
      const Scores& scores = s.*figure.scores;
      const auto& interval = scores.iqm.interval;
      csv.Add(Concat(figure.name, "_median"), scores.median);
      csv.Add(Concat(figure.name, "_iqm"), scores.iqm.value);
      csv.Add(Concat(figure.name, "_low"), interval ? FormatNumber(interval->low) : "");
      csv.Add(Concat(figure.name, "_high"), interval ? FormatNumber(interval->high) : "");
    }
    csv.Add("evaluations_after_solved", s.stability.evaluations);
    csv.Add("of_them_steady", s.stability.steady_evaluations);
    csv.Add("lowest_success_after_solved",
            s.stability.evaluations > 0 ? FormatNumber(s.stability.lowest) : "");
    csv.Add("task", group.task + 1);
    csv.EndRow();
  }
  return csv.text();
}

std::string RunsCsv(const std::vector<RunGroup>& groups) {
  CsvTable csv;
  // A run that was resumed on another machine has several texts.
  const auto add = [&](const char* name, const std::set<std::string>& texts) {
    csv.Add(name, Join({texts.begin(), texts.end()}, " + "));
  };
  for (const RunGroup& group : groups) {
    for (size_t k = 0; k < group.runs.size(); ++k) {
      const RunRecord& run = group.runs[k];
      csv.Add("group", group.label);
      csv.Add("run", run.path.string());
      csv.Add("seed", run.config.train.seed);
      csv.Add("steps", run.evaluations.back().step);
      csv.Add("seconds", run.evaluations.back().seconds);
      for (const RunFigure& figure : RunFigures()) {
        csv.Add(figure.name, (group.summary.*figure.scores).values[k]);
      }
      add("host", run.conditions.hosts);
      add("processor", run.conditions.processors);
      add("vectors", run.conditions.vectors);
      csv.EndRow();
    }
  }
  return csv.text();
}

}  // namespace

Comparison Compare(const CompareRequest& request) {
  Comparison comparison = GroupRuns(request);
  std::vector<RunGroup>& groups = comparison.groups;
  for (RunGroup& group : groups) group.summary = Summarize(group);
  for (size_t b = 1; b < groups.size(); ++b) {
    for (size_t a = 0; a < b; ++a) {
      if (groups[a].task == groups[b].task) comparison.pairs.push_back(ComparePair(groups, b, a));
    }
  }
  return comparison;
}

std::vector<std::string> WriteComparison(const Comparison& comparison, const fs::path& folder) {
  std::vector<std::string> files;
  const auto write = [&](const char* name, const std::string& table) {
    WriteFileAtomically(folder / name, table);
    files.push_back((folder / name).string());
  };
  write("summary.csv", SummaryCsv(comparison.groups));
  write("runs.csv", RunsCsv(comparison.groups));
  for (int task = 0; task < std::ssize(comparison.task_texts); ++task) {
    std::vector<RunGroup> groups;
    std::ranges::copy_if(comparison.groups, std::back_inserter(groups),
                         [&](const RunGroup& group) { return group.task == task; });
    const fs::path name = folder / (task == 0 ? "curves" : Concat("curves-", task + 1));
    std::ranges::move(DrawIfPossible(LearningCurves(groups), name), std::back_inserter(files));
  }
  return files;
}

}  // namespace upswing

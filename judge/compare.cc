#include "judge/compare.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/text.h"
#include "io/file.h"
#include "report/learning_curve.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// The text of a CSV cell: quoted where it has to be.
std::string Cell(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

/// Median, IQM and its interval; what is not reached is `inf`, an interval of one run is empty.
std::string ScoreCells(const Scores& s) {
  const auto& interval = s.iqm.interval;
  return Concat(',', FormatNumber(s.median), ',', FormatNumber(s.iqm.value), ',',
                interval ? FormatNumber(interval->low) : "", ',',
                interval ? FormatNumber(interval->high) : "");
}

std::string SummaryCsv(const Comparison& comparison) {
  std::string csv = "group,seeds,solved,solved_low,solved_high";
  for (const RunFigure& figure : RunFigures()) {
    csv += fmt::format(",{0}_median,{0}_iqm,{0}_low,{0}_high", figure.name);
  }
  csv += ",evaluations_after_solved,of_them_steady,lowest_success_after_solved,task\n";
  for (size_t i = 0; i < comparison.summaries.size(); ++i) {
    const GroupSummary& s = comparison.summaries[i];
    const RunGroup& group = comparison.runs.groups[i];
    csv += Concat(Cell(group.label), ',', group.runs.size(), ',', s.solved, ',',
                  FormatNumber(s.solved_interval.low), ',', FormatNumber(s.solved_interval.high));
    for (const RunFigure& figure : RunFigures()) csv += ScoreCells(s.*figure.scores);
    csv += Concat(',', s.stability.evaluations, ',', s.stability.steady_evaluations, ',',
                  s.stability.evaluations > 0 ? FormatNumber(s.stability.lowest) : "", ',',
                  comparison.runs.tasks[i] + 1, '\n');
  }
  return csv;
}

std::string RunsCsv(const Comparison& comparison) {
  std::string csv = "group,run,seed,steps,seconds";
  for (const RunFigure& figure : RunFigures()) csv += Concat(',', figure.name);
  csv += ",host,processor,vectors\n";
  for (size_t i = 0; i < comparison.summaries.size(); ++i) {
    const RunGroup& group = comparison.runs.groups[i];
    for (size_t k = 0; k < group.runs.size(); ++k) {
      const RunRecord& run = group.runs[k];
      csv += Concat(Cell(group.label), ',', Cell(run.path.string()), ',', run.seed, ',',
                    run.evaluations.back().step, ',', FormatNumber(run.evaluations.back().seconds));
      for (const RunFigure& figure : RunFigures()) {
        csv += Concat(',', FormatNumber((comparison.summaries[i].*figure.scores).values[k]));
      }
      // Several of a run that was resumed elsewhere.
      for (const auto* names :
           {&run.conditions.hosts, &run.conditions.processors, &run.conditions.vectors}) {
        csv += Concat(',', Cell(Join({names->begin(), names->end()}, " + ")));
      }
      csv += '\n';
    }
  }
  return csv;
}

std::string PoliciesCsv(const std::vector<JudgedPolicy>& policies) {
  std::string csv =
      "policy,task,runs,episodes,success_rate,success_low,success_high,swing_up_seconds_median,"
      "return,return_deviation,rms_torque,torque_variation,torque_variation_upright\n";
  for (const JudgedPolicy& policy : policies) {
    const Evaluation& e = policy.figures;
    const bool upright = policy.upright();
    csv += Concat(Cell(policy.name), ',', policy.task + 1, ',', policy.runs, ',', e.episodes, ',',
                  FormatNumber(e.success_rate()), ',', FormatNumber(e.success_interval.low), ',',
                  FormatNumber(e.success_interval.high), ',',
                  upright ? FormatNumber(e.swing_up_seconds.median) : "", ',',
                  FormatNumber(e.reward_sum.mean), ',', FormatNumber(e.reward_sum.deviation), ',',
                  FormatNumber(e.rms_torque.mean), ',', FormatNumber(e.torque_variation.mean), ',',
                  upright ? FormatNumber(e.goal_variation.mean) : "", '\n');
  }
  return csv;
}

}  // namespace

size_t NumTasks(const Comparison& comparison) {
  return static_cast<size_t>(*std::ranges::max_element(comparison.runs.tasks)) + 1;
}

std::string CurvesName(size_t task) { return task == 0 ? "curves" : Concat("curves-", task + 1); }

Comparison Compare(const CompareRequest& request) {
  Comparison comparison;
  comparison.runs = GroupRuns(request);
  for (const RunGroup& group : comparison.runs.groups) {
    comparison.summaries.push_back(Summarize(group));
  }
  for (size_t b = 1; b < comparison.summaries.size(); ++b) {
    for (size_t a = 0; a < b; ++a) {
      if (comparison.runs.tasks[a] != comparison.runs.tasks[b]) continue;
      comparison.pairs.push_back(ComparePair(comparison.summaries, b, a));
    }
  }
  return comparison;
}

void AddPolicies(const std::vector<LoadedPolicy>& policies, bool make_anew, ThreadPool& pool,
                 const Progress& progress, Comparison& comparison) {
  comparison.policies = JudgePolicies(policies, make_anew, pool, progress, comparison.runs);
  for (size_t group = 0; group < comparison.summaries.size(); ++group) {
    for (size_t policy = 0; policy < comparison.policies.size(); ++policy) {
      if (comparison.runs.tasks[group] != comparison.policies[policy].task) continue;
      AgainstPolicy against =
          CompareWithPolicy(comparison.summaries[group], comparison.policies[policy]);
      against.group = group;
      against.policy = policy;
      comparison.against.push_back(against);
    }
  }
}

void WriteComparison(const Comparison& comparison, const fs::path& folder) {
  for (size_t task = 0; task < NumTasks(comparison); ++task) {
    std::vector<RunGroup> groups;
    for (size_t i = 0; i < comparison.runs.groups.size(); ++i) {
      if (static_cast<size_t>(comparison.runs.tasks[i]) != task) continue;
      groups.push_back(comparison.runs.groups[i]);
    }
    std::vector<Level> levels;
    for (const JudgedPolicy& policy : comparison.policies) {
      if (static_cast<size_t>(policy.task) != task) continue;
      levels.push_back(
          {policy.title, policy.figures.success_rate(), policy.figures.reward_sum.mean});
    }
    const Figure curves = LearningCurves(groups, levels);
    Draw(curves, folder / Concat(CurvesName(task), ".svg"));
    Draw(curves, folder / Concat(CurvesName(task), ".png"));
  }
  WriteFileAtomically(folder / "summary.csv", SummaryCsv(comparison));
  WriteFileAtomically(folder / "runs.csv", RunsCsv(comparison));
  if (comparison.policies.empty()) return;
  WriteFileAtomically(folder / "policies.csv", PoliciesCsv(comparison.policies));
}

}  // namespace upswing

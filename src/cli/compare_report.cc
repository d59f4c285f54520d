#include "cli/compare_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/format.h"
#include "base/json.h"
#include "base/text.h"
#include "cli/eval_table.h"
#include "runs/seeds.h"

namespace upswing {
namespace {

using nlohmann::ordered_json;

/// Formats a number of the table; infinity means that too few runs reached it.
using Formatter = std::string (*)(double);

std::string Seconds(double x) { return std::isfinite(x) ? FormatDuration(x) : "not solved"; }
std::string Steps(double x) { return std::isfinite(x) ? FormatCount(x) : "not solved"; }
std::string Torque(double x) { return std::isfinite(x) ? fmt::format("{:.3g}", x) : "not known"; }
std::string Whole(double x) { return FormatCount(x); }
std::string Percent(double x) { return fmt::format("{:.1f}%", 100 * x); }
std::string Share(double x) { return fmt::format("{:.2f}", x); }
std::string Signed(double x) { return fmt::format("{:+.1f}", x); }
std::string SignedSteps(double x) { return Concat(x < 0 ? "-" : "+", FormatCount(std::abs(x))); }

/// `18.7 s (95% 17.0 s to 22.3 s)`.
std::string EstimateText(const Estimate& e, Formatter format) {
  if (!e.interval) return format(e.value) + " (no interval)";
  return fmt::format("{} (95% {} to {})", format(e.value), format(e.interval->low),
                     format(e.interval->high));
}

/// A probability over pairs of runs.
std::string PairsText(const Estimate& e) {
  std::string text = Concat("with probability ", EstimateText(e, Share));
  if (e.interval && e.value == 1) text += ", in every pair of runs";
  if (e.interval && e.value == 0) text += ", in no pair of runs";
  return text;
}

void PrintScores(const char* name, const Scores& s, Formatter format, const std::string& unit) {
  if (s.low == s.high) {
    fmt::print("  {:<16}{}{}{}\n", name, format(s.low), unit,
               s.values.size() > 1 ? " in every run" : "");
    return;
  }
  fmt::print("  {:<16}median {}, IQM {}, range {} to {}{}\n", name, format(s.median),
             EstimateText(s.iqm, format), format(s.low), format(s.high), unit);
}

void PrintStability(const GroupSummary& summary) {
  const Stability& s = summary.stability;
  if (summary.solved == 0) return;
  if (s.runs == 0) {
    fmt::print("  {:<16}no later evaluations: each run stopped when solved\n", "once solved");
    return;
  }
  fmt::print(
      "  {:<16}{} of {} seeds reach {:.0f}% success in every later evaluation, as do {} of {} "
      "evaluations; lowest {}\n",
      "once solved", s.steady_runs, s.runs, 100 * kSteadyRate, s.steady_evaluations, s.evaluations,
      Percent(s.lowest));
}

/// Prints a figure over the runs of a group if at least one run has it.
void PrintFigure(const RunFigure& figure, const Scores& scores, const std::string& torque_unit) {
  if (!std::isfinite(scores.low)) return;
  if (figure.unit == RunFigure::Unit::kRatio && !std::isfinite(scores.high)) return;
  using enum RunFigure::Unit;
  static const std::map<RunFigure::Unit, Formatter> kFormats{
      {kSeconds, Seconds}, {kSteps, Steps},       {kReturn, Whole}, {kShare, Percent},
      {kTorque, Torque},   {kTorqueRate, Torque}, {kRatio, Share}};
  std::string unit;
  if (figure.unit == kTorque) unit = " " + torque_unit;
  if (figure.unit == kTorqueRate) unit = Concat(" ", torque_unit, "/s");
  PrintScores(figure.label, scores, kFormats.at(figure.unit), unit);
  if (figure.unit == kRatio && ValueIsOff(scores.median, 1)) {
    fmt::print("  {:<16}the estimate is off by more than a quarter\n", "");
  }
}

void PrintGroup(const RunGroup& group, const std::string& task) {
  const GroupSummary& s = group.summary;
  std::vector<int64_t> seeds;
  for (const RunRecord& run : group.runs) seeds.push_back(run.config.train.seed);
  fmt::print("{}\n", Printable(group.label));
  if (!task.empty()) fmt::print("  {:<16}{}\n", "task", Printable(task));
  if (!group.differences.empty()) {
    fmt::print("  {:<16}{}\n", "settings", Printable(group.differences));
  }
  fmt::print("  {:<16}{} ({})\n", "seeds", group.runs.size(), SeedsText(seeds));
  fmt::print("  {:<16}{} of {} (95% {} to {})\n", "solved", s.solved, group.runs.size(),
             Percent(s.solved_interval.low), Percent(s.solved_interval.high));
  const EnvSpec spec = group.runs.front().config.Spec();
  for (const RunFigure& figure : RunFigures()) {
    const bool upright = figure.scores == &GroupSummary::upright_variation;
    if (upright && spec.evaluation.by_return()) continue;
    PrintFigure(figure, s.*figure.scores, spec.action_unit);
  }
  PrintStability(s);
  fmt::print("\n");
}

void PrintPair(const Comparison& comparison, const PairSummary& pair) {
  fmt::print("{} against {}\n", Printable(comparison.groups[pair.a].label),
             Printable(comparison.groups[pair.b].label));
  const auto print = [](const char* name, const PairFigure& figure, const char* unit,
                        Formatter format = Signed) {
    fmt::print("  {:<16}{}", name, PairsText(figure.better));
    if (figure.difference) {
      fmt::print("; difference of IQMs{}: {}", unit, EstimateText(*figure.difference, format));
    }
    fmt::print("\n");
  };
  print("solves sooner", pair.seconds, " [s]");
  print("in fewer steps", pair.steps, " [steps]", SignedSteps);
  print("higher return", pair.final_return, "");
  fmt::print("\n");
}

/// JSON writes null for a number that is not finite, such as the time to solve of an unsolved run.
ordered_json EstimateJson(const Estimate& e) {
  ordered_json j{{"value", e.value}, {"interval_95", nullptr}};
  if (e.interval) j["interval_95"] = {e.interval->low, e.interval->high};
  return j;
}

ordered_json ScoresJson(const Scores& s) {
  return {{"median", s.median},
          {"iqm", EstimateJson(s.iqm)},
          {"range", {s.low, s.high}},
          {"values", s.values}};
}

ordered_json GroupJson(const RunGroup& group) {
  const GroupSummary& s = group.summary;
  ordered_json j;
  j["group"] = group.label;
  for (const RunRecord& run : group.runs) {
    j["runs"].push_back({{"path", run.path.string()},
                         {"seed", run.config.train.seed},
                         {"steps", run.evaluations.back().step},
                         {"seconds", run.evaluations.back().seconds},
                         {"finished", Finished(run)}});
  }
  j["solved"] = s.solved;
  j["solved_interval_95"] = {s.solved_interval.low, s.solved_interval.high};
  for (const RunFigure& figure : RunFigures()) j[figure.name] = ScoresJson(s.*figure.scores);
  j["once_solved"] = {
      {"seeds", s.stability.runs},
      {"steady_seeds", s.stability.steady_runs},
      {"evaluations", s.stability.evaluations},
      {"steady_evaluations", s.stability.steady_evaluations},
      {"lowest_success",
       s.stability.evaluations > 0 ? ordered_json(s.stability.lowest) : ordered_json()}};
  j["settings"] = group.differences;
  j["task"] = group.task + 1;
  return j;
}

}  // namespace

void PrintComparison(const Comparison& comparison) {
  const auto task_text = [&](int task) {
    if (comparison.task_texts.size() == 1) return std::string();
    return fmt::format("{} ({})", task + 1, comparison.task_texts[static_cast<size_t>(task)]);
  };
  for (const RunGroup& group : comparison.groups) PrintGroup(group, task_text(group.task));
  for (const PairSummary& pair : comparison.pairs) PrintPair(comparison, pair);
  for (const std::string& note : comparison.notes) fmt::print("Note: {}\n", Printable(note));
  const bool fewer = std::ranges::any_of(comparison.groups, [](const RunGroup& group) {
    return ResamplesOf(std::ssize(group.runs)) < kResamples;
  });
  fmt::print(
      "Intervals: Wilson for shares, Newcombe if all pairs of runs agree, else percentile "
      "bootstrap "
      "with\n{}{} resamples of the runs.\n",
      fewer ? "at most " : "", FormatCount(kResamples));
}

void PrintWritten(const std::vector<std::string>& files) {
  std::vector<std::string> names;
  for (const std::string& file : files) {
    names.push_back(std::filesystem::path(file).filename().string());
  }
  const std::string folder = std::filesystem::path(files.front()).parent_path().string();
  fmt::print("Written: {} in {}\n", Join(names, ", "), Printable(folder));
}

std::string ComparisonJson(const Comparison& comparison) {
  ordered_json j;
  j["resamples"] = kResamples;
  j["notes"] = comparison.notes;
  for (const RunGroup& group : comparison.groups) j["groups"].push_back(GroupJson(group));
  j["pairs"] = ordered_json::array();
  for (const PairSummary& pair : comparison.pairs) {
    const auto difference = [](const PairFigure& figure) {
      return figure.difference ? EstimateJson(*figure.difference) : ordered_json();
    };
    j["pairs"].push_back({{"group", comparison.groups[pair.a].label},
                          {"against", comparison.groups[pair.b].label},
                          {"solves_sooner", EstimateJson(pair.seconds.better)},
                          {"solve_seconds_difference", difference(pair.seconds)},
                          {"solves_in_fewer_steps", EstimateJson(pair.steps.better)},
                          {"solve_steps_difference", difference(pair.steps)},
                          {"higher_return", EstimateJson(pair.final_return.better)},
                          {"return_difference", difference(pair.final_return)}});
  }
  return PrintableJson(j);
}

}  // namespace upswing

#include "cli/eval_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "base/format.h"
#include "base/text.h"

namespace upswing {
namespace {

/// Mean and deviation, such as `34.18 ± 0.57`. The deviation has two digits, or more if its whole
/// part has more. The mean has as many decimals as the deviation.
std::string MomentsText(const Moments& m, double scale = 1) {
  constexpr double kLeast = 1e-6;  // smaller numbers are rounding errors
  const double mean = scale * m.mean, deviation = scale * m.deviation;
  if (deviation < kLeast) return fmt::format("{:.4g} ± 0", std::abs(mean) < kLeast ? 0 : mean);
  const int decimals = std::max(0, 1 - static_cast<int>(std::floor(std::log10(deviation))));
  return fmt::format("{:.{}f} ± {:.{}f}", mean, decimals, deviation, decimals);
}

/// Median and quartiles, such as `2.74 s   (median; middle half 2.70 to 2.78 s)`.
std::string QuartilesText(const Quartiles& q) {
  return fmt::format("{:.2f} s   (median; middle half {:.2f} to {:.2f} s)", q.median, q.low,
                     q.high);
}

/// Length of the episodes: the common length, or the mean if some end earlier.
std::string LengthText(const Moments& seconds) {
  constexpr double kSame = 1e-6;  // s
  if (seconds.deviation < kSame) return fmt::format("{:.6g} s", seconds.mean);
  return fmt::format("{} s per episode", MomentsText(seconds));
}

/// Prints figures over successful episodes.
void PrintSuccesses(const Evaluation& e, bool any_pose) {
  if (e.successes == 0) {
    fmt::print("  swing-up time  none: no episode stays {}\n",
               any_pose ? "at its goal" : "upright");
    return;
  }
  fmt::print("  swing-up time  {}\n", QuartilesText(e.swing_up_seconds));
  const std::string within =
      fmt::format("{:.0f}° of {}", kSettledTilt * kDegrees, any_pose ? "the goal" : "upright");
  if (e.settled > 0) {
    fmt::print("  settling time  {}, within {}: {} of {}\n", QuartilesText(e.settling_seconds),
               within, e.settled, e.successes);
  } else {
    fmt::print("  settling time  none: no episode stays within {}\n", within);
  }
  std::vector<std::string> tilts;
  for (const Moments& tilt : e.tilt) {
    tilts.push_back(fmt::format("link {} {}°", tilts.size() + 1, MomentsText(tilt, kDegrees)));
  }
  fmt::print("  steady tilt    {}   in the last {} s\n", Join(tilts, ", "), kSteadyTiltSeconds);
}

void PrintTorques(const Evaluation& e, const char* reached) {
  fmt::print("  torque         peak {:.4g} N·m, rms {} N·m\n", e.peak_torque,
             MomentsText(e.rms_torque));
  fmt::print("  torque change  {} N·m/s", MomentsText(e.torque_variation));
  const bool upright = e.successes > 0;
  if (upright) fmt::print("; {} N·m/s once {}", MomentsText(e.goal_variation), reached);
  fmt::print("\n");
  if (upright) {
    fmt::print("  chatter        {} torque changes per second once {}\n",
               MomentsText(e.goal_changes), reached);
  }
}

/// A mean difference with its interval, such as `+45.2 (+42.1 to +48.0)`.
std::string DifferenceText(const PairedFigure& figure, double scale, int decimals) {
  const Estimate& e = figure.difference;
  if (figure.episodes == 0) return "none";
  if (!e.interval) return fmt::format("{:+.{}f}", scale * e.value, decimals);
  return fmt::format("{:+.{}f} ({:+.{}f} to {:+.{}f})", scale * e.value, decimals,
                     scale * e.interval->low, decimals, scale * e.interval->high, decimals);
}

/// A row of the comparison's table.
struct ComparisonRow {
  std::string policy, success, reward_sum, swing_up, variation;
};

/// The cells of a row, in the order of the columns.
std::array<std::string, 5> CellsOf(const ComparisonRow& row) {
  return {row.policy, row.success, row.reward_sum, row.swing_up, row.variation};
}

/// The width of each column of a table with these rows.
std::array<size_t, 5> WidthsOf(std::span<const ComparisonRow> rows) {
  std::array<size_t, 5> widths{0, 20, 28, 23, 0};  // the usual ones
  for (const ComparisonRow& row : rows) {
    const std::array<std::string, 5> cells = CellsOf(row);
    for (size_t i = 0; i < cells.size(); ++i) widths[i] = std::max(widths[i], Columns(cells[i]));
  }
  return widths;
}

void PrintRow(const ComparisonRow& row, const std::array<size_t, 5>& widths) {
  fmt::print("  {:<{}}  {:<{}}  {:<{}}  {:<{}}  {}\n", row.policy, widths[0], row.success,
             widths[1], row.reward_sum, widths[2], row.swing_up, widths[3], row.variation);
}

ComparisonRow FiguresRow(const EvalReport& report) {
  const Evaluation& e = report.figures;
  return {
      .policy = Printable(report.title),
      .success = fmt::format("{:.1f} ({} of {})", 100 * e.success_rate(), e.successes, e.episodes),
      .reward_sum = MomentsText(e.reward_sum),
      .swing_up = e.successes > 0 ? fmt::format("{:.2f}", e.swing_up_seconds.median) : "none",
      .variation = MomentsText(e.torque_variation)};
}

ComparisonRow DifferencesRow(const EvalReport& report, const EvalReport& first) {
  ComparisonRow row;
  row.policy = Printable(report.title);
  for (const PairedFigure& figure : PairedFigures(report, first)) {
    if (figure.name == "success_rate") row.success = DifferenceText(figure, 100, 1);
    if (figure.name == "return") row.reward_sum = DifferenceText(figure, 1, 1);
    if (figure.name == "swing_up_seconds") row.swing_up = DifferenceText(figure, 1, 2);
    if (figure.name == "torque_variation") row.variation = DifferenceText(figure, 1, 2);
  }
  return row;
}

/// Prints the plant and the other conditions.
void PrintConditions(const EvalReport& report) {
  const Plant& plant = report.env.plant(0);
  std::string text = PlantText(plant);
  if (plant.armature == kArmature) text += Concat(", armature ", kArmature);
  fmt::print("  plant          {}, physics {}\n", text, report.env.engine->name);
  if (!report.left_out.empty()) {
    fmt::print("  defaults       {}; the plant file leaves them out\n", report.left_out);
  }
  if (report.env.control_period != kControlPeriod) {
    fmt::print("  decisions      every {:.4g} s\n", report.env.control_period);
  }
  const std::string changes = ChangesText(report.env);
  if (!changes.empty()) fmt::print("  {:<15}{}\n", "with", changes);
}

/// Prints what a reader of the figures has to know of the policy, whose `name` begins each line.
/// `first` is the first of the compared reports, whose conditions stand above.
void PrintNotes(const EvalReport& report, const EvalReport& first, const std::string& name) {
  const int64_t episodes = report.figures.episodes;
  if (report.known_plant) {
    fmt::print(
        "  designed for   {}the plant of each episode; {} of {} plants have no such controller\n",
        name, episodes - NumDesigned(report), episodes);
  }
  if (report.figures.diverged > 0) {
    fmt::print("  note           {}the simulation diverged in {} of {}, which count as failures\n",
               name, report.figures.diverged, Counted(episodes, "episode"));
  }
  if (report.env.control_period != first.env.control_period) {
    fmt::print("  decisions      {}every {:.4g} s\n", name, report.env.control_period);
  }
  if (report.only_balances) {
    fmt::print(
        "  note           {}the controller balances and does not swing up; episodes start "
        "hanging\n",
        name);
  }
}

}  // namespace

bool ValueIsOff(double expected, double attained) {
  return std::abs(expected - attained) > 0.25 * std::abs(attained);
}

void PrintEvalTable(const EvalReport& report) {
  const Evaluation& e = report.figures;
  fmt::print("{}\n", Printable(report.policy));
  PrintConditions(report);
  PrintNotes(report, report, "");
  fmt::print("  success        {} of {} = {:.1f}%   (95% interval {:.1f}% to {:.1f}%)\n",
             e.successes, e.episodes, 100 * e.success_rate(), 100 * e.success_interval.low,
             100 * e.success_interval.high);
  for (const auto& [name, t] : TransitionsOf(report)) {
    fmt::print("    {:<22} {} of {}\n", name, t.successes, t.episodes);
  }
  PrintSuccesses(e, report.env.any_pose);
  fmt::print("  return         {}   in the first {:.4g} s\n", MomentsText(e.reward_sum),
             PendulumSpec(report.env).evaluation.return_seconds);
  for (size_t k = 0; k < e.term_means.size(); ++k) {
    fmt::print("    {:<18}{:8.2f}\n", kRewardTermNames[k], e.term_means[k]);
  }
  if (report.knows_values) {
    fmt::print("  value at start {:.4g} expected, {:.4g} attained (discounted reward)\n", e.value,
               e.discounted_return);
    if (ValueIsOff(e.value, e.discounted_return)) {
      fmt::print("                 the estimate is off by more than a quarter\n");
    }
  }
  fmt::print("  energy used    {} J   in {}\n", MomentsText(e.work), LengthText(e.seconds));
  PrintTorques(e, Reached(report.env.any_pose));
  fmt::print("  ± is the standard deviation over the episodes\n");
}

void PrintEvalComparison(std::span<const EvalReport> reports,
                         std::span<const Undesigned> undesigned) {
  const EvalReport& first = reports.front();
  std::vector<ComparisonRow> rows{
      {"", "success [%]", "return", "swing-up [s]", "torque change [N·m/s]"}};
  for (const EvalReport& report : reports) rows.push_back(FiguresRow(report));
  for (const EvalReport& report : reports.subspan(1)) rows.push_back(DifferencesRow(report, first));
  std::array<size_t, 5> widths = WidthsOf(rows);
  for (const Undesigned& controller : undesigned) {
    widths[0] = std::max(widths[0], Columns(controller.name));
  }

  fmt::print("The same {} for all\n", Counted(first.figures.episodes, "episode"));
  PrintConditions(first);
  for (const EvalReport& report : reports) {
    PrintNotes(report, first, Printable(report.title) + ": ");
  }
  fmt::print("\n");
  const size_t figures = 1 + reports.size();  // rows before those of the differences
  for (const ComparisonRow& row : std::span(rows).first(figures)) PrintRow(row, widths);
  for (const auto& [name, reason] : undesigned) {
    fmt::print("  {:<{}}  not designed: {}\n", name, widths[0], Printable(reason));
  }
  if (reports.size() > 1) {
    fmt::print("\n  minus {}, in the same episodes\n", Printable(first.title));
    for (const ComparisonRow& row : std::span(rows).subspan(figures)) PrintRow(row, widths);
  }
  fmt::print(
      "\n  ± is the standard deviation over the episodes; swing-up is a median.\n"
      "  Differences are means over the episodes, of swing-up over those in which both succeed.\n"
      "  Brackets: 95% interval, bootstrap of pairs; none if all pairs differ by the same.\n");
}

}  // namespace upswing

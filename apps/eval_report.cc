#include "apps/eval_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/trial.h"
#include "core/json.h"
#include "core/text.h"

namespace upswing {
namespace {

using nlohmann::ordered_json;

constexpr double kDegrees = 180 / std::numbers::pi;

/// Such as `34.18 ± 0.57`: two digits of the deviation, or its whole part, and the mean to as many
/// decimals.
std::string MomentsText(const Moments& m, double scale = 1) {
  constexpr double kLeast = 1e-6;  // below it a deviation is rounding
  const double mean = scale * m.mean, deviation = scale * m.deviation;
  if (deviation < kLeast) return fmt::format("{:.4g} ± 0", mean);
  const int decimals = std::max(0, 1 - static_cast<int>(std::floor(std::log10(deviation))));
  return fmt::format("{:.{}f} ± {:.{}f}", mean, decimals, deviation, decimals);
}

std::string QuartilesText(const Quartiles& q) {
  return fmt::format("{:.2f} s   (median; middle half {:.2f} to {:.2f} s)", q.median, q.low,
                     q.high);
}

/// Figures of the successful episodes alone, of a task whose goal is to be held.
void PrintSuccesses(const Evaluation& e) {
  if (e.successes == 0) {
    fmt::print("  swing-up time  no episode stays upright\n");
    return;
  }
  fmt::print("  swing-up time  {}\n", QuartilesText(e.swing_up_seconds));
  const std::string within = fmt::format("{:.0f}° of upright", kSettledTilt * kDegrees);
  if (e.settled > 0) {
    fmt::print("  settling time  {}, within {}: {} of {}\n", QuartilesText(e.settling_seconds),
               within, e.settled, e.successes);
  } else {
    fmt::print("  settling time  none stays within {}\n", within);
  }
  fmt::print("  steady tilt    link 1 {}°, link 2 {}°   of the last {} s\n",
             MomentsText(e.tilt[0], kDegrees), MomentsText(e.tilt[1], kDegrees),
             kSteadyTiltSeconds);
}

void PrintTorques(const Evaluation& e, bool has_goal) {
  fmt::print("  torque         peak {:.4g} N·m, rms {} N·m\n", e.peak_torque,
             MomentsText(e.rms_torque));
  fmt::print("  its variation  {} N·m/s", MomentsText(e.torque_variation));
  const bool upright = has_goal && e.successes > 0;
  if (upright) fmt::print("; once upright {} N·m/s", MomentsText(e.goal_variation));
  fmt::print("\n");
  if (upright) {
    fmt::print("  chatter        {} changes of the torque a second, once upright\n",
               MomentsText(e.goal_changes));
  }
}

ordered_json MomentsJson(const Moments& m, double scale = 1) {
  return {{"mean", scale * m.mean}, {"deviation", scale * m.deviation}};
}

/// null if there is no such episode.
ordered_json QuartilesJson(const Quartiles& q, int64_t episodes) {
  if (episodes == 0) return nullptr;
  return {{"median", q.median}, {"quartiles", {q.low, q.high}}};
}

void AddFigures(const Evaluation& e, const EnvSpec& spec, bool knows_values, ordered_json& j) {
  const bool any = !spec.evaluation.by_return() && e.successes > 0;
  j["episodes"] = e.episodes;
  j["successes"] = e.successes;
  j["success_rate"] = e.success_rate();
  j["success_interval_95"] = {e.success_interval.low, e.success_interval.high};
  j["swing_up_seconds"] = QuartilesJson(e.swing_up_seconds, any ? e.successes : 0);
  j["settled"] = e.settled;
  j["settling_seconds"] = QuartilesJson(e.settling_seconds, e.settled);
  j["steady_tilt_degrees"] = nullptr;
  if (any && e.tilt.size() == 2) {
    j["steady_tilt_degrees"] = {{"link1", MomentsJson(e.tilt[0], kDegrees)},
                                {"link2", MomentsJson(e.tilt[1], kDegrees)}};
  }
  j["return"] = MomentsJson(e.reward_sum);
  for (size_t k = 0; k < e.term_means.size(); ++k) {
    j["reward_terms"][spec.term_names[k]] = e.term_means[k];
  }
  j["value"] = knows_values ? ordered_json(e.value) : nullptr;
  j["discounted_return"] = knows_values ? ordered_json(e.discounted_return) : nullptr;
  j["energy_used"] = MomentsJson(e.work);
  j["peak_torque"] = e.peak_torque;
  j["rms_torque"] = MomentsJson(e.rms_torque);
  j["torque_variation"] = MomentsJson(e.torque_variation);
  j["torque_variation_upright"] = any ? MomentsJson(e.goal_variation) : nullptr;
  j["torque_changes_upright"] = any ? MomentsJson(e.goal_changes) : nullptr;
}

/// Name and text of each figure of an episode, in the order of the columns.
std::vector<std::pair<std::string, std::string>> Cells(const EvalReport& report,
                                                       const JudgedEpisode& episode) {
  const EnvSpec& spec = report.spec;
  const EvaluationRule& rule = spec.evaluation;
  const EvaluationEpisode& e = episode.result;
  std::vector<std::pair<std::string, std::string>> cells;
  const auto add = [&](const std::string& name, double value, bool known = true) {
    cells.emplace_back(name, known ? FormatNumber(value) : "");
  };
  for (size_t i = 0; i < episode.start.size(); ++i) add(spec.state_names[i], episode.start[i]);
  if (spec.task == kDoublePendulum) {
    for (const auto& [name, value] : PlantValues(episode.plant)) add(name, value);
    add("sensor_noise", episode.disturbance.sensor_noise);
    add("delay", episode.disturbance.delay);
  }
  add("success", e.success ? 1 : 0);
  const bool upright = e.swing_up_seconds < rule.seconds;
  add("swing_up_seconds", e.swing_up_seconds, upright);
  add("settling_seconds", e.settling_seconds, e.settling_seconds < rule.seconds);
  for (size_t body = 0; body < e.tilt.size(); ++body) {
    add(Concat("tilt", body + 1, "_degrees"), e.tilt[body] * kDegrees);
  }
  add("return", e.reward_sum);
  for (size_t k = 0; k < e.terms.size(); ++k) add(spec.term_names[k], e.terms[k] + 0.0);
  add("value", e.value, report.knows_values);
  add("discounted_return", e.discounted_return, report.knows_values);
  add("energy_used", e.work);
  add("peak_torque", e.peak_torque);
  add("rms_torque", e.rms_torque);
  add("torque_variation", e.torque_variation);
  add("torque_variation_upright", e.goal_variation, upright);
  add("torque_changes_upright", e.goal_changes, upright);
  return cells;
}

}  // namespace

void PrintEvalTable(const EvalReport& report) {
  const Evaluation& e = report.figures;
  fmt::print("{}\n", Printable(report.policy));
  const EvaluationRule& rule = report.spec.evaluation;
  if (report.spec.task == kDoublePendulum) {
    fmt::print("  plant          {}, physics {}\n", PlantText(report.env.plant(0)), report.physics);
  } else {
    fmt::print("  task           {}, success is a return of {:.6g} or more\n", report.spec.task,
               rule.solved_return);
  }
  if (report.model) fmt::print("  {:<15}{}\n", "model", report.model->Text());
  const std::string changes = ChangesText(report.env);
  if (!changes.empty()) fmt::print("  {:<15}{}\n", "with", changes);
  fmt::print("  success        {} of {} = {:.1f}%   (95% interval {:.1f}% to {:.1f}%)\n",
             e.successes, e.episodes, 100 * e.success_rate(), 100 * e.success_interval.low,
             100 * e.success_interval.high);
  if (!rule.by_return()) PrintSuccesses(e);
  fmt::print("  return         {}   in the first {} s\n", MomentsText(e.reward_sum),
             rule.return_seconds);
  for (size_t k = 0; k < e.term_means.size(); ++k) {
    fmt::print("    {:<18}{:8.2f}\n", report.spec.term_names[k], e.term_means[k]);
  }
  if (report.knows_values) {
    fmt::print("  Q at the start {:.4g} expected, {:.4g} attained (discounted reward)\n", e.value,
               e.discounted_return);
  }
  fmt::print("  energy used    {} J   in {} s\n", MomentsText(e.work), rule.seconds);
  PrintTorques(e, !rule.by_return());
  fmt::print("  ± is the standard deviation over the episodes\n");
}

void PrintEvalJson(const EvalReport& report) {
  ordered_json j;
  j["policy"] = report.policy;
  j["seed"] = report.env.seed;
  j["physics"] = report.physics;
  j["task"] = report.spec.task;
  if (report.spec.task != kDoublePendulum) {
    AddFigures(report.figures, report.spec, report.knows_values, j);
    fmt::print("{}\n", PrintableJson(j));
    return;
  }
  for (const auto& [name, value] : PlantValues(report.env.plant(0))) j["plant"][name] = value;
  j["model"] = report.model ? report.model->Json() : kBuiltIn;
  j["unknown_plant"] = report.env.assumed_plant.has_value();
  Disturbance disturbance = report.env.disturbance(0);
  Randomization randomization = report.env.randomization;
  for (const Options& options : {OptionsOf(disturbance), OptionsOf(randomization)}) {
    for (const Option& option : options.all()) {
      j[option.section][option.name] = *std::get<double*>(option.target);
    }
  }
  AddFigures(report.figures, report.spec, report.knows_values, j);
  fmt::print("{}\n", PrintableJson(j));
}

std::string EpisodesCsv(const EvalReport& report) {
  std::string csv = "episode";
  for (const auto& [name, text] : Cells(report, report.episodes.front())) csv += ',' + name;
  csv += '\n';
  for (size_t i = 0; i < report.episodes.size(); ++i) {
    csv += std::to_string(i);
    for (const auto& [name, text] : Cells(report, report.episodes[i])) {
      csv += ',' + text;
    }
    csv += '\n';
  }
  return csv;
}

}  // namespace upswing

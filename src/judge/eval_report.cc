#include "judge/eval_report.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "agents/controllers.h"
#include "base/csv.h"
#include "base/error.h"
#include "base/format.h"
#include "base/json.h"
#include "base/text.h"
#include "pendulum/observation.h"
#include "pendulum/upright_modes.h"
#include "runs/plant_file.h"

namespace upswing {
namespace {

using nlohmann::ordered_json;

ordered_json FigureJson(double value) { return value; }
ordered_json FigureJson(const Moments& m, double scale = 1) {
  return {{"mean", scale * m.mean}, {"deviation", scale * m.deviation}};
}
ordered_json FigureJson(const Quartiles& q) {
  return {{"median", q.median}, {"quartiles", {q.low, q.high}}};
}

ordered_json JsonOf(const Option& option) {
  if (const auto* on = std::get_if<bool*>(&option.target)) return **on;
  if (const auto* text = std::get_if<std::string*>(&option.target)) return **text;
  return option.number();
}

/// Whether a figure has a value to print.
bool IsKnown(const EvaluationFigure& figure, bool upright, bool settled, bool valued) {
  using enum EvaluationFigure::Known;
  return figure.known == kAlways || (figure.known == kUpright && upright) ||
         (figure.known == kSettled && settled) || (figure.known == kValued && valued);
}

/// The value of a figure in an episode; nothing if the episode has none.
std::optional<double> KnownValue(const EvaluationFigure& figure, const EvaluationEpisode& e,
                                 bool valued) {
  // A failed episode can end upright, but it did not stay so.
  const bool settled = e.success && e.settling_seconds.has_value();
  if (!IsKnown(figure, e.success, settled, valued)) return std::nullopt;
  return figure.Of(e);
}

/// Adds conditions and figures of an episode to its row, which has cells for a goal if `has_goal`.
void AddCells(const EvalReport& report, const JudgedEpisode& episode, bool has_goal,
              CsvTable& csv) {
  const EvaluationEpisode& e = episode.result;
  const auto add = [&](const std::string& name, double value, bool known = true) {
    csv.Add(name, known ? FormatNumber(value) : "");
  };
  add("q1", episode.start.q1);
  add("q2", episode.start.q2);
  add("w1", episode.start.w1);
  add("w2", episode.start.w2);
  if (has_goal) {
    const auto [goal1, goal2] = GoalInputs(episode.goal.value_or(Pose()));
    add("goal1", goal1);
    add("goal2", goal2);
  }
  for (const auto& [name, value] : PlantValues(episode.plant)) add(name, value);
  const double delta = ModesOf(episode.plant).delta;
  add("delta", delta, std::isfinite(delta));
  const Options disturbance = OptionsOf(episode.disturbance);
  for (const Option& option : disturbance.all()) add(option.name, option.number());
  add("success", e.success ? 1 : 0);
  for (size_t body = 0; body < e.tilt.size(); ++body) {
    add(Concat("tilt", body + 1, "_degrees"), e.tilt[body] * kDegrees);
  }
  for (size_t k = 0; k < e.terms.size(); ++k) add(kRewardTermNames[k], e.terms[k] + 0.0);
  for (const EvaluationFigure& figure : EvaluationFigures()) {
    const auto value = KnownValue(figure, e, report.knows_values);
    add(figure.name, value.value_or(0), value.has_value());
  }
}

/// Adds the figures of an evaluation to its JSON document.
void AddFigures(const EvalReport& report, ordered_json& j) {
  const Evaluation& e = report.figures;
  const bool upright = e.successes > 0;
  const bool settled = upright && e.settled > 0;
  j["episodes"] = e.episodes;
  j["successes"] = e.successes;
  j["diverged"] = e.diverged;
  j["success_rate"] = e.success_rate();
  j["success_interval_95"] = {e.success_interval.low, e.success_interval.high};
  j["settled"] = upright ? e.settled : 0;
  j["steady_tilt_degrees"] = nullptr;
  if (upright) {
    j["steady_tilt_degrees"] = {{"link1", FigureJson(e.tilt[0], kDegrees)},
                                {"link2", FigureJson(e.tilt[1], kDegrees)}};
  }
  for (size_t k = 0; k < e.term_means.size(); ++k) {
    j["reward_terms"][kRewardTermNames[k]] = e.term_means[k];
  }
  for (const EvaluationFigure& figure : EvaluationFigures()) {
    ordered_json& value = j[figure.name] = nullptr;
    if (!IsKnown(figure, upright, settled, report.knows_values)) continue;
    value = std::visit([&](auto member) { return FigureJson(e.*member); }, figure.summary);
  }
}

using DesignFor = decltype(LoadedPolicy::design_for);

/// Evaluates the episodes of `config`, each with a controller designed for its plant.
void JudgeDesigned(const Policy& policy, const DesignFor& design_for,
                   const PendulumEnvConfig& config, const Progress& progress, size_t first,
                   EvalReport& report) {
  std::mutex mutex;
  int done = 0;
  config.pool->ParallelFor(config.num_envs, [&](int i) {
    JudgedEpisode& episode = report.episodes[first + static_cast<size_t>(i)];
    std::shared_ptr<const Policy> made;
    try {
      made = design_for(episode.plant);
      episode.for_its_plant = true;
    } catch (const Error&) {  // no controller holds or swings up this plant
    }
    PendulumEnvConfig one = config;
    one.pool = nullptr;
    PendulumEnv env = OneEpisode(one, i);
    episode.result = EvaluateEpisodes(made ? *made : policy, env).front();
    const std::lock_guard lock(mutex);
    progress(++done, config.num_envs);
  });
}

/// Evaluates the episodes of the environments of `config` and appends them to the report. With
/// `design_for`, each episode has a controller designed for its plant.
void JudgeEpisodes(const Policy& policy, const DesignFor* design_for,
                   const PendulumEnvConfig& config, const Progress& progress, EvalReport& report) {
  PendulumEnv env(config);
  const auto first = report.episodes.size();
  for (int i = 0; i < config.num_envs; ++i) {
    report.episodes.push_back(
        {env.state(i), env.goal(i), env.plant(i), env.disturbance(i), false, {}});
  }
  if (design_for) return JudgeDesigned(policy, *design_for, config, progress, first, report);
  std::vector<EvaluationEpisode> results = EvaluateEpisodes(policy, env, config.pool, progress);
  for (size_t i = 0; i < results.size(); ++i) {
    report.episodes[first + i].result = std::move(results[i]);
  }
}

/// The document of one report.
ordered_json ReportJson(const EvalReport& report) {
  ordered_json j;
  j["policy"] = report.policy;
  j["seed"] = report.env.seed;
  j["physics"] = report.env.engine->name;
  j["task"] = kDoublePendulum;
  for (const auto& [name, value] : PlantValues(report.env.plant(0))) j["plant"][name] = value;
  j["control_period"] = report.env.control_period;
  j["unknown_plant"] = report.env.assumed_plant.has_value();
  if (report.known_plant) j["known_plant"] = NumDesigned(report);
  const TrialConditions conditions{report.env.disturbance(0), report.env.randomization};
  const Options options = OptionsOf(conditions);
  for (const Option& option : options.all()) {
    if (option.name == "posterior" && conditions.randomization.posterior.empty()) continue;
    j[option.section][option.name] = JsonOf(option);
  }
  AddFigures(report, j);
  for (const auto& [name, t] : TransitionsOf(report)) {
    j["transitions"][name] = {{"episodes", t.episodes}, {"successes", t.successes}};
  }
  return j;
}

/// A difference with its number of episodes; null if no episode has the figure for both policies.
ordered_json PairedJson(const PairedFigure& figure) {
  if (figure.episodes == 0) return nullptr;
  const auto& interval = figure.difference.interval;
  ordered_json j{{"mean", figure.difference.value}, {"interval_95", nullptr}};
  if (interval) j["interval_95"] = {interval->low, interval->high};
  j["episodes"] = figure.episodes;
  return j;
}

/// Throws BadInput if two evaluations have different plants.
void CheckSamePlant(const EvalReport& first, const EvalReport& other) {
  const Plant expected = first.env.plant(0), got = other.env.plant(0);
  std::vector<std::string> before, now;
  for (const auto& [option, value] : Differences(OptionsOf(got), OptionsOf(expected))) {
    before.push_back(Concat(option.name, " ", value->text()));
    now.push_back(Concat(option.name, " ", option.text()));
  }
  if (now.empty()) return;
  throw BadInput(Concat(Printable(other.policy), ": expected the plant of ",
                        Printable(first.policy), " (", Join(before, ", "), "), got ",
                        Join(now, ", "), "; --plant gives all policies one plant"));
}

/// Throws BadInput if two evaluations have different goals.
void CheckSameGoal(const EvalReport& first, const EvalReport& other) {
  const auto text = [](const PendulumEnvConfig& env) {
    if (env.any_pose && !env.goal) return std::string("another one in each episode");
    return PoseName(env.goal.value_or(Pose()));
  };
  const std::string expected = text(first.env), got = text(other.env);
  if (got == expected) return;
  throw BadInput(Concat(Printable(other.policy), ": expected the goal of ", Printable(first.policy),
                        " (", expected, "), got ", got,
                        "; --goal up-up gives all policies one goal"));
}

}  // namespace

EvalReport PlanEvaluation(const LoadedPolicy& loaded, const TrialArguments& trial,
                          int64_t episodes) {
  if (trial.known_plant && !loaded.design_for) {
    throw BadInput(Concat("--known-plant: expected a controller, which has a design plant, got ",
                          loaded.name));
  }
  if (trial.known_plant && trial.unknown_plant) {
    throw BadInput("--known-plant: expected no --unknown-plant with it");
  }
  EvalReport report;
  report.policy = loaded.name;
  report.title = ShortTitle(loaded);
  report.known_plant = trial.known_plant;
  if (!trial.plant.empty()) report.left_out = ReadPlantFile(trial.plant).left_out;
  report.env = TrialEnvironments(trial, &loaded, true);
  report.env.num_envs = static_cast<int>(episodes);
  report.knows_values = loaded.policy->info().gamma.value_or(0) > 0;
  report.only_balances = OnlyBalances(loaded.policy->kind());
  return report;
}

void CheckSameEpisodes(std::span<const EvalReport> reports) {
  for (const EvalReport& report : reports) {
    CheckSamePlant(reports.front(), report);
    CheckSameGoal(reports.front(), report);
  }
}

void RunEvaluation(EvalReport& report, const LoadedPolicy& loaded, ThreadPool& pool,
                   const Progress& progress) {
  constexpr int64_t kAtOnce = 4096;
  const int64_t episodes = report.env.num_envs;
  for (int64_t done = 0; done < episodes; done += kAtOnce) {
    PendulumEnvConfig config = report.env;
    config.pool = &pool;
    config.first_index += static_cast<uint64_t>(done);
    config.num_envs = static_cast<int>(std::min(kAtOnce, episodes - done));
    JudgeEpisodes(
        *loaded.policy, report.known_plant ? &loaded.design_for : nullptr, config,
        [&](double part, double) {
          if (progress) progress(static_cast<double>(done) + part, static_cast<double>(episodes));
        },
        report);
  }
  std::vector<EvaluationEpisode> results;
  for (const JudgedEpisode& episode : report.episodes) results.push_back(episode.result);
  report.figures = Summarize(results, PendulumSpec(report.env).evaluation);
}

EvalReport EvaluatePolicy(const LoadedPolicy& loaded, const TrialArguments& trial, int64_t episodes,
                          ThreadPool& pool, const Progress& progress) {
  EvalReport report = PlanEvaluation(loaded, trial, episodes);
  RunEvaluation(report, loaded, pool, progress);
  return report;
}

std::map<std::string, TransitionCount> TransitionsOf(const EvalReport& report) {
  std::map<std::string, TransitionCount> transitions;
  for (const JudgedEpisode& episode : report.episodes) {
    for (const Pose& from : kPoses) {
      if (!episode.goal || !Inverted(SeenFrom(from, episode.start))) continue;
      TransitionCount& t = transitions[Concat(PoseName(from), " to ", PoseName(*episode.goal))];
      ++t.episodes;
      t.successes += episode.result.success ? 1 : 0;
    }
  }
  return transitions;
}

int64_t NumDesigned(const EvalReport& report) {
  return std::ranges::count(report.episodes, true, &JudgedEpisode::for_its_plant);
}

std::vector<PairedFigure> PairedFigures(const EvalReport& report, const EvalReport& other) {
  std::vector<PairedFigure> figures;
  const auto add = [&](const char* name, auto value) {
    std::vector<double> x, y;
    for (size_t i = 0; i < report.episodes.size(); ++i) {
      const std::optional<double> a = value(report.episodes[i].result);
      const std::optional<double> b = value(other.episodes[i].result);
      if (!a || !b) continue;
      x.push_back(*a);
      y.push_back(*b);
    }
    figures.push_back({name, std::ssize(x), EstimatePairedDifference(x, y)});
  };
  add("success_rate",
      [](const EvaluationEpisode& e) { return std::optional(e.success ? 1.0 : 0); });
  for (const EvaluationFigure& figure : EvaluationFigures()) {
    if (figure.known == EvaluationFigure::Known::kValued) continue;
    add(figure.name, [&](const EvaluationEpisode& e) { return KnownValue(figure, e, false); });
  }
  return figures;
}

std::string EvalJson(const EvalReport& report) { return PrintableJson(ReportJson(report)); }

std::string ComparisonJson(std::span<const EvalReport> reports,
                           std::span<const Undesigned> undesigned) {
  ordered_json j;
  for (const EvalReport& report : reports) j["policies"].push_back(ReportJson(report));
  for (const EvalReport& report : reports.subspan(1)) {
    ordered_json difference{{"policy", report.policy}, {"minus", reports.front().policy}};
    for (const PairedFigure& figure : PairedFigures(report, reports.front())) {
      difference[figure.name] = PairedJson(figure);
    }
    j["differences"].push_back(difference);
  }
  for (const auto& [name, reason] : undesigned) {
    j["undesigned"].push_back({{"policy", name}, {"reason", reason}});
  }
  return PrintableJson(j);
}

std::string EpisodesCsv(std::span<const EvalReport> reports, bool compared) {
  CsvTable csv;
  const bool has_goal =
      std::ranges::any_of(reports, [](const EvalReport& report) { return report.env.any_pose; });
  for (const EvalReport& report : reports) {
    for (size_t i = 0; i < report.episodes.size(); ++i) {
      if (compared) csv.Add("policy", report.policy);
      csv.Add("episode", i);
      AddCells(report, report.episodes[i], has_goal, csv);
      csv.EndRow();
    }
  }
  return csv.text();
}

}  // namespace upswing

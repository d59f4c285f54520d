#include "judge/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "core/error.h"
#include "core/text.h"
#include "io/file.h"
#include "mujoco/engines.h"
#include "report/learning_curve.h"
#include "run/find_policy.h"
#include "setup/task.h"
#include "setup/training.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// Episodes of a task on which policies are judged, at most, unless one run's evaluation has more.
constexpr int64_t kMostJudged = 1000;

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

/// The episodes of the final evaluations of runs that are evaluated on one task.
std::vector<EnvConfig> FinalEvaluations(const GroupedRuns& runs, int task) {
  std::vector<EnvConfig> evaluations;
  std::set<std::pair<int64_t, int64_t>> seen;  // seed and step
  int64_t episodes = 0;
  for (size_t i = 0; i < runs.groups.size(); ++i) {
    if (runs.tasks[i] != task) continue;
    Config config = *runs.configs[i];
    for (const RunRecord& run : runs.groups[i].runs) {
      config.train.seed = run.seed;
      const int64_t step = run.evaluations.back().step;
      if (!seen.emplace(run.seed, step).second) continue;
      episodes += config.train.eval_episodes;
      if (!evaluations.empty() && episodes > kMostJudged) return evaluations;
      EnvConfig& env = evaluations.emplace_back(EvaluationEnvironments(config, step));
      // Screened: in MuJoCo are those that count.
      const bool screened = config.eval_physics == kScreened;
      env.engine = screened ? &kMuJoCo : &FindEngine(config.eval_physics, "--eval-physics");
    }
  }
  return evaluations;
}

/// The policy, or the controller made for the plant of the episodes. Throws BadInput where there is
/// none for it.
std::shared_ptr<const Policy> PolicyFor(const LoadedPolicy& loaded, bool make_anew,
                                        const EnvConfig& env) {
  const bool same = PlantValues(loaded.plant) == PlantValues(env.plant(0));
  if (!loaded.remade || !make_anew || same) return loaded.policy;
  try {
    return loaded.remade(env.plant(0));
  } catch (const Error& error) {
    throw Error(error.exit_code(),
                Concat(error.what(), " (for the plant of the runs; --made-for names another)"));
  }
}

/// Throws BadInput unless the motor is at the joint that the policy was made for.
void ExpectJoint(const LoadedPolicy& loaded, bool make_anew, const Plant& plant) {
  const double own = loaded.plant.actuated_joint, given = plant.actuated_joint;
  if (own == given || (loaded.remade && make_anew)) return;
  throw BadInput(Concat(loaded.name, ": was made for a motor at joint ", own,
                        ", and that of the runs is at joint ", given));
}

/// A policy to judge on a task.
struct Job {
  size_t index;  // of the policy
  std::shared_ptr<const Policy> policy;
  int task;
  std::vector<EnvConfig> evaluations;
  int64_t episodes = 0;
};

JudgedPolicy Judge(const LoadedPolicy& loaded, const Job& job, ThreadPool& pool,
                   const Progress& progress) {
  JudgedPolicy judged;
  judged.name = loaded.name;
  judged.task = job.task;
  judged.runs = std::ssize(job.evaluations);
  judged.spec = SpecOf(job.evaluations.front());
  std::vector<EvaluationEpisode> episodes;
  for (EnvConfig env : job.evaluations) {
    env.pool = &pool;
    env.memory = loaded.memory();
    env.identified_from.reset();
    if (loaded.identifies()) env.identified_from = loaded.plant;
    const auto done = static_cast<double>(episodes.size());
    const auto more = EvaluateEpisodes(*job.policy, *MakeEnv(env), &pool, [&](double part, double) {
      progress(done + part, static_cast<double>(job.episodes));
    });
    episodes.insert(episodes.end(), more.begin(), more.end());
  }
  judged.figures = Summarize(episodes, judged.spec.evaluation);
  return judged;
}

/// What is to be judged; what is not is noted.
std::vector<Job> JobsOf(const std::vector<LoadedPolicy>& policies, bool make_anew,
                        GroupedRuns& runs) {
  const int tasks = static_cast<int>(runs.task_texts.size());
  std::vector<Job> jobs;
  for (size_t index = 0; index < policies.size(); ++index) {
    const LoadedPolicy& loaded = policies[index];
    std::vector<std::string> others;  // tasks that it is not of
    for (int task = 0; task < tasks; ++task) {
      Job job{index, nullptr, task, FinalEvaluations(runs, task)};
      const EnvConfig& first = job.evaluations.front();
      if (first.task != loaded.task) {
        others.push_back(first.task);
        continue;
      }
      ExpectJoint(loaded, make_anew, first.plant(0));
      job.policy = PolicyFor(loaded, make_anew, first);
      for (const EnvConfig& env : job.evaluations) job.episodes += env.num_envs;
      jobs.push_back(std::move(job));
    }
    if (std::ssize(others) == tasks) {
      throw BadInput(Concat(loaded.name, ": expected a policy of ", others.front(),
                            ", as the runs are, got one of ", loaded.task));
    }
    if (!others.empty()) {
      runs.notes.push_back(Concat(loaded.name, ": not judged on ", others.front(),
                                  ", as it is a policy of ", loaded.task));
    }
  }
  return jobs;
}

std::vector<JudgedPolicy> JudgePolicies(const std::vector<LoadedPolicy>& policies, bool make_anew,
                                        ThreadPool& pool, const Progress& progress,
                                        GroupedRuns& runs) {
  const std::vector<std::string> titles = TitlesOf(policies);
  double all = 0, before = 0;
  const std::vector<Job> jobs = JobsOf(policies, make_anew, runs);
  for (const Job& job : jobs) all += static_cast<double>(job.episodes);
  std::vector<JudgedPolicy> judged;
  for (const Job& job : jobs) {
    judged.push_back(Judge(policies[job.index], job, pool, [&](double done, double) {
      if (progress) progress(before + done, all);
    }));
    judged.back().title = titles[job.index];
    before += static_cast<double>(job.episodes);
  }
  return judged;
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
      const JudgedPolicy& judged = comparison.policies[policy];
      if (comparison.runs.tasks[group] != judged.task) continue;
      std::vector<double> differences = comparison.summaries[group].final_return.values;
      for (double& value : differences) value -= judged.figures.reward_sum.mean;
      const int64_t higher = std::ranges::count_if(differences, [](double x) { return x > 0; });
      comparison.against.push_back({group, policy, higher,
                                    WilsonInterval(higher, std::ssize(differences)),
                                    EstimateIqm({differences})});
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

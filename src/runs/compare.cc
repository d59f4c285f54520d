#include "runs/compare.h"

#include <algorithm>
#include <set>

#include "agents/training.h"
#include "base/csv.h"
#include "base/error.h"
#include "base/text.h"
#include "mujoco/engines.h"
#include "os/file.h"
#include "runs/compare_runs.h"
#include "runs/find_policy.h"
#include "runs/learning_curve.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// Largest number of episodes on which policies are judged, unless one run's evaluation has more.
constexpr int64_t kMostJudged = 1000;

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

/// The episodes of the final evaluations of runs that are evaluated on one task, the double
/// pendulum.
std::vector<PendulumEnvConfig> FinalEvaluations(const Comparison& comparison, int task) {
  std::vector<PendulumEnvConfig> evaluations;
  std::set<std::pair<int64_t, int64_t>> seen;  // seed and step
  int64_t episodes = 0;
  for (const RunGroup& group : comparison.groups) {
    if (group.task != task) continue;
    for (const RunRecord& run : group.runs) {
      const Config& config = run.config;
      const int64_t step = run.evaluations.back().step;
      if (!seen.emplace(config.train.seed, step).second) continue;
      episodes += config.train.eval_episodes;
      if (!evaluations.empty() && episodes > kMostJudged) return evaluations;
      PendulumEnvConfig& env = evaluations.emplace_back(EvaluationEnvironments(config, step));
      // Screened runs: the evaluations in MuJoCo count.
      const bool screened = config.eval_physics == kScreened;
      env.engine = screened ? &kMuJoCo : &FindEngine(config.eval_physics, "--eval-physics");
    }
  }
  return evaluations;
}

/// The policy, or the controller designed for the plant of the episodes. Throws BadInput if no such
/// controller exists.
std::shared_ptr<const Policy> PolicyFor(const LoadedPolicy& loaded, bool redesign,
                                        const PendulumEnvConfig& env) {
  const bool same = PlantValues(loaded.plant) == PlantValues(env.plant(0));
  if (!loaded.design_for || !redesign || same) return loaded.policy;
  try {
    return loaded.design_for(env.plant(0));
  } catch (const Error& error) {
    throw Error(
        error.exit_code(),
        Concat(error.what(), " (designed for the plant of the runs; --made-for sets another one)"));
  }
}

/// Throws BadInput unless the plant's motor is at the policy's joint.
void ExpectJoint(const LoadedPolicy& loaded, bool redesign, const Plant& plant) {
  const double own = loaded.plant.actuated_joint, given = plant.actuated_joint;
  if (own == given || (loaded.design_for && redesign)) return;
  throw BadInput(Concat(loaded.name, ": expected a policy for a motor at joint ", given,
                        ", as in the runs, got one for joint ", own));
}

/// A policy to judge on a task.
struct Job {
  const LoadedPolicy& loaded;
  std::shared_ptr<const Policy> policy;
  std::vector<PendulumEnvConfig> evaluations;
  JudgedPolicy judged;  // figures still empty
  int64_t episodes = 0;
};

/// The figures of a policy. `progress` counts its episodes.
Evaluation Judge(const Job& job, ThreadPool& pool, const Progress& progress) {
  const LoadedPolicy& loaded = job.loaded;
  std::vector<EvaluationEpisode> episodes;
  for (PendulumEnvConfig env : job.evaluations) {
    env.pool = &pool;
    env.memory = loaded.memory();
    env.identified_from.reset();
    if (loaded.identifies()) env.identified_from = loaded.plant;
    const auto done = static_cast<double>(episodes.size());
    PendulumEnv pendulums(env);
    const auto more = EvaluateEpisodes(*job.policy, pendulums, &pool, [&](double part, double) {
      progress(done + part, static_cast<double>(job.episodes));
    });
    episodes.insert(episodes.end(), more.begin(), more.end());
  }
  return Summarize(episodes, PendulumSpec(job.evaluations.front()).evaluation);
}

/// The policies to evaluate on each task. Throws BadInput if a task is an environment that only
/// Python steps.
std::vector<Job> JobsOf(const std::vector<LoadedPolicy>& policies, bool redesign,
                        const Comparison& comparison) {
  for (const RunGroup& group : comparison.groups) {
    if (policies.empty() || !group.runs.front().config.is_foreign()) continue;
    throw BadInput(Concat(policies.front().name, ": expected no policies with ", group.label,
                          ", runs of ", group.runs.front().config.Spec().task));
  }
  const std::vector<std::string> titles = TitlesOf(policies);
  const int tasks = static_cast<int>(comparison.task_texts.size());
  std::vector<Job> jobs;
  for (size_t index = 0; index < policies.size(); ++index) {
    const LoadedPolicy& loaded = policies[index];
    for (int task = 0; task < tasks; ++task) {
      Job job{loaded, nullptr, FinalEvaluations(comparison, task), {}};
      const PendulumEnvConfig& first = job.evaluations.front();
      ExpectJoint(loaded, redesign, first.plant(0));
      job.policy = PolicyFor(loaded, redesign, first);
      job.judged = {loaded.name, titles[index], task, std::ssize(job.evaluations), {}};
      for (const PendulumEnvConfig& env : job.evaluations) job.episodes += env.num_envs;
      jobs.push_back(std::move(job));
    }
  }
  return jobs;
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

void AddPolicies(const std::vector<LoadedPolicy>& policies, bool redesign, ThreadPool& pool,
                 const Progress& progress, Comparison& comparison) {
  double all = 0, before = 0;
  const std::vector<Job> jobs = JobsOf(policies, redesign, comparison);
  for (const Job& job : jobs) all += static_cast<double>(job.episodes);
  for (const Job& job : jobs) {
    JudgedPolicy& judged = comparison.policies.emplace_back(job.judged);
    judged.figures = Judge(job, pool, [&](double done, double) {
      if (progress) progress(before + done, all);
    });
    before += static_cast<double>(job.episodes);
  }
  for (size_t group = 0; group < comparison.groups.size(); ++group) {
    for (size_t policy = 0; policy < comparison.policies.size(); ++policy) {
      const JudgedPolicy& judged = comparison.policies[policy];
      if (comparison.groups[group].task != judged.task) continue;
      std::vector<double> differences = comparison.groups[group].summary.final_return.values;
      for (double& value : differences) value -= judged.figures.reward_sum.mean;
      const int64_t higher = std::ranges::count_if(differences, [](double x) { return x > 0; });
      comparison.against.push_back({group, policy, higher,
                                    WilsonInterval(higher, std::ssize(differences)),
                                    EstimateIqm(differences)});
    }
  }
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
    std::vector<Level> levels;
    for (const JudgedPolicy& policy : comparison.policies) {
      if (policy.task != task) continue;
      levels.push_back(
          {policy.title, policy.figures.success_rate(), policy.figures.reward_sum.mean});
    }
    const fs::path name = folder / (task == 0 ? "curves" : Concat("curves-", task + 1));
    std::ranges::move(DrawIfPossible(LearningCurves(groups, levels), name),
                      std::back_inserter(files));
  }
  return files;
}

}  // namespace upswing

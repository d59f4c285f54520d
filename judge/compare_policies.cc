#include "judge/compare_policies.h"

#include <algorithm>
#include <set>

#include "core/error.h"
#include "core/text.h"
#include "mujoco/engines.h"
#include "run/find_policy.h"
#include "setup/task.h"
#include "setup/training.h"

namespace upswing {
namespace {

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

}  // namespace

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

AgainstPolicy CompareWithPolicy(const GroupSummary& group, const JudgedPolicy& policy) {
  const double bar = policy.figures.reward_sum.mean;
  std::vector<double> differences = group.final_return.values;
  for (double& value : differences) value -= bar;
  const int64_t higher =
      std::ranges::count_if(differences, [](double difference) { return difference > 0; });
  return {0, 0, higher, WilsonInterval(higher, std::ssize(differences)),
          EstimateIqm({differences})};
}

}  // namespace upswing

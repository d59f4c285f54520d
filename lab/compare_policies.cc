#include "lab/compare_policies.h"

#include <algorithm>
#include <set>

#include "core/error.h"
#include "core/text.h"
#include "lab/task.h"
#include "lab/training.h"
#include "lab/view.h"
#include "mujoco/engines.h"

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
      config.train.seed = run.plan.seed;
      const int64_t step = run.evaluations.back().step;
      if (!seen.emplace(run.plan.seed, step).second) continue;
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

/// The policy, or the controller made for the plant of the episodes.
std::shared_ptr<const Policy> PolicyFor(const LoadedPolicy& loaded, bool make_anew,
                                        const EnvConfig& env) {
  const bool same = PlantValues(loaded.plant) == PlantValues(env.plant(0));
  if (!loaded.remade || !make_anew || same) return loaded.policy;
  return loaded.remade(env.plant(0));
}

/// Throws BadInput unless the motor is at the joint that the policy was made for.
void ExpectJoint(const LoadedPolicy& loaded, bool make_anew, const Plant& plant) {
  const double own = loaded.plant.actuated_joint, given = plant.actuated_joint;
  if (own == given || (loaded.remade && make_anew)) return;
  throw BadInput(Concat(loaded.name, ": was made for a motor at joint ", own,
                        ", and that of the runs is at joint ", given));
}

JudgedPolicy Judge(const LoadedPolicy& loaded, bool make_anew,
                   const std::vector<EnvConfig>& evaluations, ThreadPool& pool,
                   const std::function<void(double)>& progress) {
  JudgedPolicy judged;
  judged.name = loaded.name;
  judged.title = TitleOf(loaded);
  judged.runs = std::ssize(evaluations);
  judged.spec = SpecOf(evaluations.front());
  const auto policy = PolicyFor(loaded, make_anew, evaluations.front());
  std::vector<EvaluationEpisode> episodes;
  double done = 0;
  for (EnvConfig env : evaluations) {
    env.pool = &pool;
    env.memory = loaded.memory();
    env.identified_from.reset();
    if (loaded.identifies()) env.identified_from = loaded.plant;
    const auto more = EvaluateEpisodes(*policy, *MakeEnv(env), &pool, [&](double share) {
      if (progress) progress((done + share) / static_cast<double>(evaluations.size()));
    });
    episodes.insert(episodes.end(), more.begin(), more.end());
    ++done;
  }
  judged.figures = Summarize(episodes, judged.spec.evaluation);
  return judged;
}

}  // namespace

std::vector<JudgedPolicy> JudgePolicies(const std::vector<LoadedPolicy>& policies, bool make_anew,
                                        ThreadPool& pool,
                                        const std::function<void(double)>& progress,
                                        GroupedRuns& runs) {
  const int tasks = static_cast<int>(runs.task_texts.size());
  std::vector<JudgedPolicy> judged;
  double done = 0;
  for (const LoadedPolicy& loaded : policies) {
    std::vector<std::string> others;  // tasks that it is not of
    for (int task = 0; task < tasks; ++task) {
      const std::vector<EnvConfig> evaluations = FinalEvaluations(runs, task);
      const std::string& name = evaluations.front().task;
      if (name != loaded.task) {
        others.push_back(name);
        ++done;
        continue;
      }
      ExpectJoint(loaded, make_anew, evaluations.front().plant(0));
      judged.push_back(Judge(loaded, make_anew, evaluations, pool, [&](double share) {
        if (progress) progress((done + share) / static_cast<double>(policies.size() * tasks));
      }));
      judged.back().task = task;
      ++done;
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

#include "setup/config_checks.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"
#include "io/machine.h"
#include "nn/q_network.h"
#include "setup/format.h"

namespace upswing {
namespace {

/// Such as `1.5 GB`.
std::string Gigabytes(double bytes) {
  const auto tenths = std::llround(1e-8 * bytes);
  return Concat(tenths / 10, ".", tenths % 10, " GB");
}

int ObservationSize(const Config& config) { return SpecOf(config.Environments()).obs_size; }

/// What the size of a training follows from.
struct LearnerSize {
  double parameters;     // of the networks that learn
  double arrays;         // of so many numbers each that there are
  double saved_arrays;   // and in the checkpoint
  double transition;     // numbers of one in the replay memory or rollout
  double capacity;       // transitions that it holds
  double batch, widest;  // rows of a minibatch, units of the widest layer…
  double layers;         // …and how many layers' activations and gradients are kept
};

LearnerSize SizeOfLearner(const Config& config) {
  const int D = ObservationSize(config);
  const auto widest = [](const std::vector<int64_t>& hidden) {
    return static_cast<double>(*std::ranges::max_element(hidden));
  };
  if (config.algorithm == kSac) {
    const SacConfig& s = config.sac;
    const int A = SpecOf(config.Environments()).action_size();
    const double critics = s.twin ? 2 : 1;
    const Network<float> actor(s.Trunk(D), {2 * A});
    const Network<float> critic(s.Trunk(D + A), {static_cast<int>(std::max<int64_t>(1, s.bins))});
    return {static_cast<double>(actor.num_parameters()) +
                critics * static_cast<double>(critic.num_parameters()),
            // Online, target or kept, gradient, Adam's two moments, and what products want.
            6, 4, 2.0 * D + A + 2, static_cast<double>(s.replay), static_cast<double>(s.batch),
            std::max(widest(s.hidden), static_cast<double>(s.bins)),
            (1 + critics) * 3 * static_cast<double>(s.hidden.size())};
  }
  if (config.algorithm == kPpo) {
    const PpoConfig& p = config.ppo;
    const int A = SpecOf(config.Environments()).action_size();
    const Network<float> actor(p.Shape(D), {p.discrete() ? static_cast<int>(p.levels) : A});
    const Network<float> critic(p.Shape(D), {1});
    return {
        static_cast<double>(actor.num_parameters() + critic.num_parameters()),
        // Parameters, gradient, Adam's two moments, and what products want.
        5, 3,
        // Observation and successor, action, ln π, reward, V, V', advantage, target, order, ends.
        2.0 * D + A + 9, static_cast<double>(p.horizon * config.train.envs),
        static_cast<double>(p.batch), widest(p.hidden),
        2 * 3 * static_cast<double>(p.hidden.size())};
  }
  const DqnConfig& d = config.dqn;
  const QNetwork<float> network(d.Shape(D, static_cast<int>(d.levels)));
  return {static_cast<double>(network.num_parameters()),
          // Online, target and kept parameters, gradient, Adam's two moments, and the forms that
          // products want of online and target weights.
          8, 5, 2.0 * D + 3, static_cast<double>(d.replay), static_cast<double>(d.batch),
          widest(d.hidden), 3 * static_cast<double>(d.hidden.size())};
}

template <typename AgentConfig>
void WarnOfNoRate(const AgentConfig& c, std::vector<std::string>& warnings) {
  if (c.learning_rate == 0 && c.learning_rate_end == 0) {
    warnings.emplace_back("learning_rate is 0 to the end: nothing will be learned");
  }
}

/// What would keep an agent with a replay memory from learning, in `steps` of training.
void AddWarnings(const OffPolicyConfig& d, int64_t steps, std::vector<std::string>& warnings) {
  if (d.learning_starts >= steps) {
    warnings.push_back(Concat("learning starts after step ", FormatCount(d.learning_starts),
                              ", and there are ", FormatCount(steps),
                              " steps: nothing will be learned"));
  }
  if (d.updates_per_step == 0) {
    warnings.emplace_back("updates_per_step is 0: nothing will be learned");
  }
  WarnOfNoRate(d, warnings);
}

/// The same for PPO.
void AddWarnings(const PpoConfig& p, int64_t envs, int64_t steps,
                 std::vector<std::string>& warnings) {
  if (p.horizon * envs > steps) {
    warnings.push_back(Concat("a rollout is ", FormatCount(p.horizon * envs),
                              " steps, and there are ", FormatCount(steps),
                              ": nothing will be learned"));
  }
  WarnOfNoRate(p, warnings);
}

/// Throws BadInput that begins with `place` if settings of an agent with a replay memory, each of
/// which is allowed, contradict each other, so that nothing could be learned.
void CheckTogether(const OffPolicyConfig& d, const std::string& place) {
  if (d.batch > d.replay) {
    throw BadInput(Concat(place,
                          "batch: expected at most as many transitions as the replay memory holds "
                          "(replay ",
                          d.replay, "), got ", d.batch));
  }
  if (d.learning_starts > d.replay) {
    throw BadInput(Concat(place,
                          "learning_starts: expected at most as many steps as the replay memory "
                          "holds transitions (replay ",
                          d.replay, "), got ", d.learning_starts));
  }
}

/// Throws BadInput that begins with `place` if minibatches do not divide a rollout, or if there is
/// a setting of the other kind of actions that is not at its default.
void CheckPpo(const PpoConfig& p, int64_t num_envs, const std::string& place) {
  try {
    p.CheckBatch(num_envs);
  } catch (const Error& error) {
    throw BadInput(place + error.what());
  }
  const PpoConfig usual;
  if (!p.discrete() && p.levels != usual.levels) {
    throw BadInput(Concat(place, "levels: expected none with continuous actions, got ", p.levels,
                          " (or actions = levels)"));
  }
  if (!p.discrete() && p.initial_std > p.max_std && p.initial_std != usual.initial_std) {
    throw BadInput(Concat(place, "initial_std: expected at most max_std (", p.max_std, "), got ",
                          p.initial_std));
  }
  if (p.discrete() && p.initial_std != usual.initial_std) {
    throw BadInput(
        Concat(place, "initial_std: expected none with actions = levels, got ", p.initial_std));
  }
}

/// Throws BadInput that begins with `place` unless the bins of a categorical critic can stand for
/// different values.
void CheckBins(const SacConfig& s, const std::string& place) {
  if (s.bins == 1) throw BadInput(Concat(place, "bins: expected 0 or at least 2, got 1"));
  if (s.bins > 0 && s.value_low >= s.value_high) {
    throw BadInput(Concat(place, "value_low: expected less than value_high (", s.value_high,
                          "), got ", s.value_low));
  }
}

/// Throws BadInput if a setting of the double pendulum is not at its default in another task, which
/// has no such setting.
void CheckTask(Config& config, const std::string& where) {
  if (config.task == kDoublePendulum) return;
  Config defaults;
  Options now, usual;
  config.DescribePlantTask(now);
  defaults.DescribePlantTask(usual);
  for (const auto& [option, other] : Differences(now, usual)) {
    throw BadInput(Concat(
        where.empty() ? "" : where + ": ", option.name, ": expected none, as the task ",
        config.task, " has no such setting, got ", option.text(), " (agent ", config.agent, ")"));
  }
}

}  // namespace

void CheckSettings(Config& config, const std::string& where) {
  const std::string place = where.empty() ? "" : where + ": ";
  if (config.algorithm == kSac) {
    CheckTogether(config.sac, place);
    CheckBins(config.sac, place);
  } else if (config.algorithm == kPpo) {
    CheckPpo(config.ppo, config.train.envs, place);
  } else {
    CheckTogether(config.dqn, place);
  }
  CheckTask(config, where);
}

std::vector<std::string> Warnings(const Config& config) {
  std::vector<std::string> warnings;
  // Environments step together: a training ends with the lock-step that reaches its last step.
  const int64_t envs = config.train.envs;
  const int64_t steps = (config.train.steps + envs - 1) / envs * envs;
  if (config.algorithm == kSac) {
    AddWarnings(config.sac, steps, warnings);
    if (config.sac.actor_rate == 0) {
      warnings.emplace_back("actor_rate is 0: the policy will stay as it began");
    }
    if (config.sac.tau == 0) warnings.emplace_back("tau is 0: the targets will stay as they began");
  } else if (config.algorithm == kPpo) {
    AddWarnings(config.ppo, envs, steps, warnings);
  } else {
    AddWarnings(config.dqn, steps, warnings);
    if (config.dqn.tau == 0 && config.dqn.target_period == 0) {
      warnings.emplace_back("tau is 0: the target network will stay as it began");
    }
  }
  if (std::ranges::all_of(config.reward.weight, [](double weight) { return weight == 0; })) {
    warnings.emplace_back("every weight of the reward is 0: there is nothing to learn");
  }
  return warnings;
}

TrainingSize SizeOf(const Config& config) {
  constexpr double kFloat = sizeof(float);
  const LearnerSize l = SizeOfLearner(config);
  const double replay = kFloat * l.transition * l.capacity;
  const double saved = kFloat * l.saved_arrays * l.parameters;
  // The first checkpoint, without a replay memory, lies beside what it is loaded into.
  return {
      kFloat * (l.arrays * l.parameters + l.batch * l.widest * l.layers) + std::max(saved, replay),
      saved + replay};
}

void CheckMemory(const Config& config, int64_t runs) {
  const double needed = static_cast<double>(runs) * SizeOf(config).memory;
  const auto available = static_cast<double>(AvailableMemory());
  if (needed <= available) return;
  const LearnerSize learner = SizeOfLearner(config);
  const bool on_policy = config.algorithm == kPpo;
  throw BadInput(Concat(
      "train: expected to fit into the ", Gigabytes(available), " of memory that are free, but ",
      runs > 1 ? Concat(runs, " trainings at a time, each with a ") : "a ", "network of ",
      FormatCount(learner.parameters), " parameters and a ",
      on_policy ? "rollout" : "replay memory", " of ", FormatCount(learner.capacity),
      " transitions take up to ", Gigabytes(needed), " (smaller: --hidden, ",
      on_policy ? "--horizon" : "--replay", runs > 1 ? ", --jobs" : "", ")"));
}

}  // namespace upswing

// Double pendulums with Gymnasium's interface: takes actions, returns arrays that view the results.
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <mutex>
#include <optional>
#include <tuple>

#include "base/error.h"
#include "base/text.h"
#include "mujoco/engines.h"
#include "os/host.h"
#include "pendulum/observation.h"
#include "pendulum/pendulum_env.h"
#include "python/src/bindings.h"
#include "rl/ppo/ppo_config.h"
#include "rl/torque_levels.h"
#include "runs/config_files.h"
#include "runs/plant_file.h"

namespace upswing {
namespace {

namespace nb = nanobind;

using AnyArray = nb::ndarray<nb::ro, nb::device::cpu, nb::c_contig>;
template <typename T>
using View = nb::ndarray<nb::numpy, const T>;

/// Number of torque levels; 0 for continuous actions. PPO's settings have the same names.
int64_t LevelsOf(const std::string& actions, const std::string& levels) {
  PpoConfig config;
  const Options options = OptionsOf(config);
  options.Set("actions", actions, "actions");
  options.Set("levels", levels, "levels");
  return config.discrete() ? config.levels : 0;
}

/// The settings of a plant file: name, text and place of each.
using PlantSettings = std::vector<std::tuple<std::string, std::string, std::string>>;

/// Reads the shipped plant of this name, or the plant file at this path. Throws BadInput.
PlantSettings LoadPlant(const std::string& name) {
  PlantSettings settings;
  for (const FlagValue& flag : WithPlantFile({{"plant", name, "plant"}})) {
    settings.emplace_back(flag.name, flag.text, flag.where);
  }
  return settings;
}

/// Settings of `num_envs` environments: those of the named or default agent, with the plant's, and
/// with these changes. Throws BadInput for settings that environments do not have.
Config ConfigOf(const std::string& num_envs, const PlantSettings& plant,
                const SettingTexts& settings) {
  std::vector<FlagValue> flags = FlagsOf(settings);
  flags.push_back({"envs", num_envs, "num_envs"});
  const Options every = EverySetting();
  for (const FlagValue& flag : flags) {
    for (const Option* option : every.Find(flag.name, flag.where)) {
      if (IsEnvironmentSetting(*option)) continue;
      throw BadInput(Concat(flag.where, ": expected a setting of an environment, got ", flag.name,
                            ", a setting of a training"));
    }
  }
  std::vector<FlagValue> all;
  for (const auto& [name, text, where] : plant) all.push_back({name, text, where});
  all.insert(all.end(), flags.begin(), flags.end());
  return BuildConfig("", all);
}

PendulumEnvConfig EnvConfigOf(const Config& config, ThreadPool& pool) {
  PendulumEnvConfig environments = config.Environments();
  environments.engine = &EngineCalled(config.physics);
  environments.pool = &pool;
  return environments;
}

/// N environments stepped together. Concurrent calls wait for each other. Results stay at the same
/// address, so that arrays can view them. Letters as in base/env.h; L torque levels.
class Environments {
 public:
  /// `same_step`: the next episode begins in the step that ends an episode; else the following step
  /// begins it and ignores the action (Gymnasium's AutoresetMode). Throws BadInput.
  Environments(const std::string& num_envs, const PlantSettings& plant,
               const SettingTexts& settings, const std::string& actions, const std::string& levels,
               bool same_step)
      : config_(ConfigOf(num_envs, plant, settings)),
        same_step_(same_step),
        pool_(ResolveThreads(config_.train.threads)),
        env_(EnvConfigOf(config_, pool_)),
        actions_(static_cast<size_t>(env_.num_envs())),
        result_(env_.spec()) {
    const int64_t count = LevelsOf(actions, levels);
    if (count > 0) levels_ = TorqueLevels(spec().action_limit.front(), count);
    std::ranges::copy(env_.obs().values(), result_.next_obs.begin());
  }

  const EnvSpec& spec() const { return env_.spec(); }
  const Config& config() const { return config_; }
  const std::vector<double>& levels() const { return levels_; }
  int threads() const { return pool_.threads(); }
  /// Names of the goals that episodes may have; none if they are always upright.
  std::vector<std::string> goals() const {
    return config_.any_pose ? PoseNames() : std::vector<std::string>();
  }
  /// Results of the last step; `next_obs` has the successors, even in ended episodes.
  const StepResult& result() const { return result_; }
  /// The observations to act on (N, D).
  std::span<const float> obs() const {
    return same_step_ ? env_.obs().values() : std::span<const float>(result_.next_obs);
  }

  /// Makes one step with actions: torques (N × A, N·m), or indices of levels (N), in any of the
  /// number types of AnyArray.
  void Step(const AnyArray& action) {
    CheckShape(action);
    Alone([&] {
      if (levels_.empty()) {
        action.dtype() == nb::dtype<float>() ? Take<float>(action) : Take<double>(action);
      } else {
        action.dtype() == nb::dtype<int32_t>() ? Take<int32_t>(action) : Take<int64_t>(action);
      }
      // An environment with an ended episode is already at the start of the next one.
      for (const int env : ended_) env_.Hold(env);
      env_.Step(actions_, result_);
      ended_.clear();
      if (!same_step_) {
        for (int env = 0; env < spec().num_envs; ++env) {
          if (result_.done(static_cast<size_t>(env))) ended_.push_back(env);
        }
      }
    });
  }

  /// Begins an episode in each environment with a nonzero `mask` (N). An environment with a seed
  /// (N) has the episodes of a first environment with this seed from then on.
  void Reset(const std::vector<std::optional<uint64_t>>& seeds, const std::vector<uint8_t>& mask) {
    Alone([&] {
      for (size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] == 0) continue;
        const int env = static_cast<int>(i);
        // The environment has already begun the next episode, which Python has not seen yet.
        const bool begun = std::erase(ended_, env) > 0;
        if (!begun || seeds[i]) env_.Restart(env, seeds[i]);
        result_.torque[i] = 0;  // no torque acts yet
        ShowStart(env);
      }
    });
  }

  std::vector<double> State(int env) {
    return Alone([&] {
      const auto [q1, q2, w1, w2] = env_.state(env);
      return std::vector{q1, q2, w1, w2};
    });
  }

  /// Begins an episode of an environment in a state (q1, q2, w1, w2), or as drawn, with the goal of
  /// this name, or as drawn.
  void SetStart(int env, const std::optional<std::array<double, 4>>& s,
                const std::optional<std::string>& goal) {
    Alone([&] {
      // Episodes are drawn until one has the goal, so that it begins as others with this goal do.
      while (goal && PoseName(*env_.goal(env)) != *goal) env_.Restart(env, {});
      if (s) env_.SetState(env, {(*s)[0], (*s)[1], (*s)[2], (*s)[3]});
      ShowStart(env);
    });
  }

  /// The goal as in observations; upright if episodes have none.
  std::array<float, kGoalSize> Goal(int env) {
    return Alone([&] { return GoalInputs(env_.goal(env).value_or(Pose())); });
  }

  Plant PlantOf(int env) {
    return Alone([&] { return env_.plant(env); });
  }

 private:
  /// Runs `work` without the interpreter's lock once no other call is running.
  template <typename Work>
  auto Alone(const Work& work) -> decltype(work()) {
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    return work();
  }

  /// Throws BadInput unless the shape has an action for each environment.
  void CheckShape(const AnyArray& action) const {
    const auto n = static_cast<size_t>(spec().num_envs);
    const bool torques = levels_.empty();
    const bool fits = action.size() == n && action.ndim() == (torques ? 2 : 1) &&
                      (!torques || action.shape(0) == n);
    if (fits) return;
    std::vector<size_t> shape;
    for (size_t k = 0; k < action.ndim(); ++k) shape.push_back(action.shape(k));
    throw BadInput(Concat("action: expected an array of shape (", n, torques ? ", 1" : ",",
                          "), got (", Join(shape, ", "), action.ndim() == 1 ? ",)" : ")"));
  }

  /// Sets actions_ from an array of type Number. Throws BadInput.
  template <typename Number>
  void Take(const AnyArray& action) {
    const auto* numbers = static_cast<const Number*>(action.data());
    const auto wrong = [&](size_t i, const std::string& expected, auto got) {
      return BadInput(Concat("action", spec().num_envs > 1 ? Concat(" of environment ", i) : "",
                             ": expected ", expected, ", got ", got));
    };
    for (size_t i = 0; i < actions_.size(); ++i) {
      if constexpr (std::floating_point<Number>) {
        if (!std::isfinite(numbers[i])) {
          throw wrong(i, Concat("a finite number of ", spec().action_unit), numbers[i]);
        }
        actions_[i] = numbers[i];
      } else {
        const auto level = static_cast<size_t>(numbers[i]);  // negative becomes large
        if (level >= levels_.size()) {
          throw wrong(i, Concat("a torque level from 0 to ", levels_.size() - 1), numbers[i]);
        }
        actions_[i] = levels_[level];
      }
    }
  }

  /// Makes the present observation of an environment the result of the last step.
  void ShowStart(int env) {
    const auto obs = env_.obs();
    const Matrix<float> shown(result_.next_obs, obs.rows(), obs.cols());
    std::ranges::copy(obs.row(env), shown.row(env).begin());
  }

  Config config_;
  bool same_step_;
  ThreadPool pool_;
  PendulumEnv env_;
  std::vector<double> levels_;   // (L) N·m; empty: any torque
  std::vector<double> actions_;  // (N) N·m
  StepResult result_;
  std::vector<int> ended_;  // their next step begins an episode
  std::mutex mutex_;
};

/// An array (N × anything, or N) that views the environments' numbers.
template <typename T>
View<T> ViewOf(const Environments& self, std::span<const T> values, bool matrix) {
  const auto n = static_cast<size_t>(self.spec().num_envs);
  const std::array<size_t, 2> shape{n, values.size() / n};
  return {values.data(), matrix ? size_t{2} : size_t{1}, shape.data()};
}

/// A property that views a table of the last step's results. The environments live as long as the
/// array.
template <typename T>
void AddView(nb::class_<Environments>& c, const char* name, std::vector<T> StepResult::*table,
             bool matrix) {
  c.def_prop_ro(
      name,
      [=](Environments& self) {
        return ViewOf(self, std::span<const T>(self.result().*table), matrix);
      },
      nb::rv_policy::reference_internal);
}

/// The task as a dictionary.
nb::dict DescribeTask(Environments& self) {
  const EnvSpec& spec = self.spec();
  nb::dict d;
  d["task"] = spec.task;
  d["num_envs"] = spec.num_envs;
  d["obs_size"] = spec.obs_size;
  d["action_limit"] = spec.action_limit;
  d["step_seconds"] = spec.step_seconds;
  d["reward_terms"] = spec.term_names;
  d["goals"] = self.goals();
  d["levels"] = self.levels();
  d["threads"] = self.threads();
  d["settings"] = ConfigToml(self.config(), false);
  return d;
}

}  // namespace

void BindEnvironments(nb::module_& m) {
  nb::class_<Environments> c(m, "Environments");
  c.def(nb::init<const std::string&, const PlantSettings&, const SettingTexts&, const std::string&,
                 const std::string&, bool>(),
        nb::arg("num_envs"), nb::arg("plant"), nb::arg("settings"), nb::arg("actions"),
        nb::arg("levels"), nb::arg("same_step"), nb::call_guard<nb::gil_scoped_release>())
      .def("step", &Environments::Step, nb::arg("action"))
      .def("reset", &Environments::Reset, nb::arg("seeds"), nb::arg("mask"))
      .def("spec", &DescribeTask)
      .def("get_state", &Environments::State, nb::arg("env"))
      .def("set_start", &Environments::SetStart, nb::arg("env"), nb::arg("state").none(),
           nb::arg("goal").none())
      .def("goal", &Environments::Goal, nb::arg("env"))
      .def(
          "plant", [](Environments& self, int env) { return PlantDict(self.PlantOf(env)); },
          nb::arg("env"))
      .def_prop_ro(
          "obs", [](Environments& self) { return ViewOf(self, self.obs(), true); },
          nb::rv_policy::reference_internal);
  m.def("load_plant", &LoadPlant, nb::arg("name"), nb::call_guard<nb::gil_scoped_release>());
  AddView(c, "final_obs", &StepResult::next_obs, true);
  AddView(c, "reward", &StepResult::reward, false);
  AddView(c, "reward_terms", &StepResult::reward_terms, true);
  AddView(c, "torque", &StepResult::torque, true);
  AddView(c, "terminated", &StepResult::terminated, false);
  AddView(c, "truncated", &StepResult::truncated, false);
  AddView(c, "at_goal", &StepResult::at_goal, false);
}

}  // namespace upswing

// BatchEnv for Python: actions in, arrays that view its results.
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <memory>
#include <mutex>
#include <optional>

#include "core/error.h"
#include "core/text.h"
#include "python/src/batch_env.h"
#include "python/src/bindings.h"
#include "python/src/environment_settings.h"
#include "python/src/pictures.h"
#include "rl/ppo_config.h"

namespace upswing {
namespace {

namespace nb = nanobind;

using AnyArray = nb::ndarray<nb::ro, nb::device::cpu, nb::c_contig>;
template <typename T, typename... Shape>
using View = nb::ndarray<nb::numpy, const T, Shape...>;

/// Which actions there are: 0 for any torque, else how many torques to choose from. The names are
/// those of PPO's settings.
int64_t LevelsOf(const std::string& actions, const std::string& levels) {
  PpoConfig config;
  const Options options = OptionsOf(config);
  options.Set("actions", actions, "actions");
  options.Set("levels", levels, "levels");
  return config.discrete() ? config.levels : 0;
}

/// The settings of so many environments.
Config ConfigOf(const std::string& num_envs, const SettingTexts& settings) {
  std::vector<FlagValue> flags = FlagsOf(settings);
  flags.push_back({"envs", num_envs, "num_envs"});
  return EnvironmentConfig(flags);
}

/// A BatchEnv that calls from several threads wait for.
class Environments {
 public:
  Environments(const std::string& num_envs, const SettingTexts& settings,
               const std::string& actions, const std::string& levels, bool same_step)
      : env_(ConfigOf(num_envs, settings), LevelsOf(actions, levels),
             same_step ? BatchEnv::Autoreset::kSameStep : BatchEnv::Autoreset::kNextStep) {}

  /// One step under actions (N, or N × A for any torque) of a type that Python may have.
  void Step(const AnyArray& action) {
    const bool any_torque = env_.levels().empty();
    const auto [data, size] = Checked(action, any_torque);
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    const auto as = [&, data = data, size = size]<typename T>(T /*example*/) {
      return std::span(static_cast<const T*>(data), size);
    };
    if (any_torque) {
      if (action.dtype() == nb::dtype<float>()) return env_.StepContinuous(as(float{}));
      return env_.StepContinuous(as(double{}));
    }
    if (action.dtype() == nb::dtype<int32_t>()) return env_.StepLevels(as(int32_t{}));
    return env_.StepLevels(as(int64_t{}));
  }

  void Reset(const std::vector<std::optional<uint64_t>>& seeds, const std::vector<uint8_t>& mask) {
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    env_.Reset(seeds, mask);
  }

  /// The picture of an environment as it stands, with the torque that acted last: a new array
  /// (height × width × 3), red, green, blue, the top row first.
  nb::ndarray<nb::numpy, uint8_t> Draw(int env, int width, int height) {
    const std::array<size_t, 3> shape{static_cast<size_t>(height), static_cast<size_t>(width), 3};
    std::unique_ptr<uint8_t[]> pixels;
    {
      const nb::gil_scoped_release unlocked;
      const std::lock_guard lock(mutex_);
      if (!pictures_) pictures_.emplace(PictureSize{width, height});
      std::array<double, 4> s{};
      env_.GetState(env, s);
      const double torque = env_.result().torque[static_cast<size_t>(env)];
      const auto picture =
          pictures_->Draw(env_.plant(env), env_.config().mjcf, {s[0], s[1], s[2], s[3]}, torque);
      pixels = std::make_unique<uint8_t[]>(picture.size());
      std::ranges::copy(picture, pixels.get());
    }
    const nb::capsule owner(pixels.get(),
                            [](void* p) noexcept { delete[] static_cast<uint8_t*>(p); });
    return {pixels.release(), shape.size(), shape.data(), owner};
  }

  std::vector<double> State(int env) {
    std::vector<double> state(env_.spec().state_names.size());
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    env_.GetState(env, state);
    return state;
  }
  void SetState(int env, const std::vector<double>& state) {
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    env_.SetState(env, state);
  }
  Plant PlantOf(int env) {
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    return env_.plant(env);
  }

  BatchEnv& env() { return env_; }

 private:
  /// The numbers of an array of actions. Throws BadInput.
  std::pair<const void*, size_t> Checked(const AnyArray& action, bool any_torque) const {
    const auto n = static_cast<size_t>(env_.spec().num_envs);
    const size_t A = any_torque ? env_.spec().action_limit.size() : 1;
    const bool fits =
        action.size() == n * A &&
        (any_torque ? action.ndim() == 2 && action.shape(0) == n : action.ndim() == 1);
    if (!fits) {
      std::vector<std::string> shape;
      for (size_t k = 0; k < action.ndim(); ++k) shape.push_back(std::to_string(action.shape(k)));
      throw BadInput(Concat("action: expected an array of shape (", n,
                            any_torque ? Concat(", ", A) : ",", "), got (", Join(shape, ", "),
                            action.ndim() == 1 ? ",)" : ")"));
    }
    return {action.data(), action.size()};
  }

  BatchEnv env_;
  std::optional<Pictures> pictures_;
  std::mutex mutex_;
};

/// A property that views numbers of the environments, which live as long as the array.
template <typename T, typename Get>
void AddView(nb::class_<Environments>& c, const char* name, bool matrix, const Get& get) {
  c.def_prop_ro(
      name,
      [matrix, get](Environments& self) {
        const std::span<const T> values = get(self.env());
        const auto n = static_cast<size_t>(self.env().spec().num_envs);
        const std::array<size_t, 2> shape{n, n == 0 ? 0 : values.size() / n};
        return View<T>(values.data(), matrix ? 2 : 1, shape.data());
      },
      nb::rv_policy::reference_internal);
}

/// The task as a dictionary.
nb::dict DescribeTask(Environments& self) {
  const EnvSpec& spec = self.env().spec();
  nb::dict d;
  d["task"] = spec.task;
  d["num_envs"] = spec.num_envs;
  d["obs_size"] = spec.obs_size;
  d["action_limit"] = spec.action_limit;
  d["action_unit"] = spec.action_unit;
  d["step_seconds"] = spec.step_seconds;
  d["reward_terms"] = spec.term_names;
  d["state_names"] = spec.state_names;
  d["state_units"] = spec.state_units;
  d["levels"] = self.env().levels();
  d["threads"] = self.env().threads();
  d["settings"] = ConfigToml(self.env().config(), false);
  return d;
}

}  // namespace

void BindEnvironments(nb::module_& m) {
  nb::class_<Environments> c(m, "Environments");
  c.def(nb::init<const std::string&, const SettingTexts&, const std::string&, const std::string&,
                 bool>(),
        nb::arg("num_envs"), nb::arg("settings"), nb::arg("actions"), nb::arg("levels"),
        nb::arg("same_step"), nb::call_guard<nb::gil_scoped_release>())
      .def("step", &Environments::Step, nb::arg("action"))
      .def("reset", &Environments::Reset, nb::arg("seeds"), nb::arg("mask"))
      .def("draw", &Environments::Draw, nb::arg("env"), nb::arg("width"), nb::arg("height"))
      .def("spec", &DescribeTask)
      .def("get_state", &Environments::State, nb::arg("env"))
      .def("set_state", &Environments::SetState, nb::arg("env"), nb::arg("state"))
      .def(
          "plant", [](Environments& self, int env) { return PlantDict(self.PlantOf(env)); },
          nb::arg("env"));
  m.def(
      "check_picture_size",
      [](int64_t width, int64_t height) {
        const auto clamp = [](int64_t n) {
          return static_cast<int>(std::clamp<int64_t>(n, 0, 1000000));
        };
        CheckedSize({clamp(width), clamp(height)});
      },
      nb::arg("width"), nb::arg("height"));
  AddView<float>(c, "obs", true, [](const BatchEnv& e) { return e.obs(); });
  AddView<float>(c, "final_obs", true, [](const BatchEnv& e) { return e.final_obs(); });
  AddView<double>(c, "reward", false,
                  [](const BatchEnv& e) { return std::span<const double>(e.result().reward); });
  AddView<double>(c, "reward_terms", true, [](const BatchEnv& e) {
    return std::span<const double>(e.result().reward_terms);
  });
  AddView<double>(c, "torque", true,
                  [](const BatchEnv& e) { return std::span<const double>(e.result().torque); });
  AddView<uint8_t>(c, "terminated", false, [](const BatchEnv& e) {
    return std::span<const uint8_t>(e.result().terminated);
  });
  AddView<uint8_t>(c, "truncated", false, [](const BatchEnv& e) {
    return std::span<const uint8_t>(e.result().truncated);
  });
  AddView<uint8_t>(c, "at_goal", false,
                   [](const BatchEnv& e) { return std::span<const uint8_t>(e.result().at_goal); });
}

}  // namespace upswing

// Policies for Python: from files, controllers and Python functions.
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <type_traits>

#include "agents/config.h"
#include "agents/controllers.h"
#include "base/error.h"
#include "base/safetensors.h"
#include "base/text.h"
#include "python/src/bindings.h"
#include "runs/find_policy.h"
#include "runs/tensor_file.h"

namespace upswing {
namespace {

namespace nb = nanobind;

using Observations = nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
template <typename T>
using Numbers = nb::ndarray<T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

/// Checks observations (N × D) for a policy. Throws BadInput.
Matrix<const float> Checked(const Observations& obs, const Policy& policy) {
  const auto D = static_cast<size_t>(policy.obs_size());
  if (obs.shape(1) != D) {
    throw BadInput(
        Concat("obs: expected ", D, " numbers for each observation, got ", obs.shape(1)));
  }
  for (size_t i = 0; i < obs.size(); ++i) {
    if (std::isfinite(obs.data()[i])) continue;
    throw BadInput(
        Concat("obs: expected finite numbers, got ", obs.data()[i], " in observation ", i / D));
  }
  return {obs.data(), static_cast<int>(obs.shape(0)), static_cast<int>(D)};
}

template <typename T>
Matrix<T> Result(const Numbers<T>& out) {
  return {out.data(), static_cast<int>(out.shape(0)), static_cast<int>(out.shape(1))};
}

void Act(PolicyHandle& self, const Observations& obs, const Numbers<double>& out) {
  const Matrix<const float> rows = Checked(obs, self.policy());
  const nb::gil_scoped_release unlocked;
  self.WithMemory(rows.rows(),
                  [&](Policy::Memory& memory) { self.policy().Act(rows, Result(out), memory); });
}

void Values(PolicyHandle& self, const Observations& obs, const Numbers<float>& out) {
  const Matrix<const float> rows = Checked(obs, self.policy());
  const nb::gil_scoped_release unlocked;
  self.WithMemory(rows.rows(),
                  [&](Policy::Memory& memory) { self.policy().Values(rows, Result(out), memory); });
}

void Spread(PolicyHandle& self, const Observations& obs, const Numbers<double>& low,
            const Numbers<double>& high) {
  const Matrix<const float> rows = Checked(obs, self.policy());
  const nb::gil_scoped_release unlocked;
  self.WithMemory(rows.rows(), [&](Policy::Memory& memory) {
    self.policy().Spread(rows, Result(low), Result(high), memory);
  });
}

std::vector<double> ValueActions(const PolicyHandle& self) {
  const Matrix<const double> actions = self.policy().value_actions();
  return {actions.data(), actions.data() + actions.size()};
}

/// The metadata of the policy's file; None if it lacks a value.
nb::dict DescribeInfo(const PolicyHandle& self) {
  const PolicyInfo& info = self.policy().info();
  nb::dict d;
  d["agent"] = info.agent;
  d["upswing_version"] = info.upswing_version;
  d["config"] = info.config;
  d["seed"] = info.seed;
  d["step"] = info.step;
  d["success_rate"] = info.success_rate;
  d["mean_return"] = info.mean_return;
  d["control_period"] = info.control_period;
  d["gamma"] = info.gamma;
  d["reward_scale"] = info.reward_scale;
  d["plant"] = self.loaded().is_foreign() ? nb::dict() : PlantDict(self.loaded().plant);
  return d;
}

/// The bytes of a policy's file.
nb::bytes FileOf(const Policy& policy) {
  const std::vector<std::byte> file = WriteSafetensors(policy.ToTensors()).Joined();
  return nb::bytes(file.data(), file.size());
}

/// The policy in a file with these bytes. Throws BadInput, which names the file.
LoadedPolicy PolicyOf(const nb::bytes& file, const std::string& name) {
  const auto* bytes = static_cast<const std::byte*>(file.data());
  return ReadPolicy(ReadSafetensors({bytes, bytes + file.size()}, name));
}

std::shared_ptr<PolicyHandle> Load(const std::string& name, const SettingTexts& settings,
                                   const std::vector<std::string>& made_for) {
  PolicyArguments arguments;
  arguments.name = name;
  arguments.flags = FlagsOf(settings);
  arguments.made_for = made_for;
  const nb::gil_scoped_release unlocked;
  return std::make_shared<PolicyHandle>(GetPolicy(arguments));
}

/// The controller of an earlier handle with these settings, name, plant, control period (s) and
/// swing-up policy (the bytes of its file, or None). Reads no file, so that it is the same
/// controller.
std::shared_ptr<PolicyHandle> Redesign(const std::string& controller, const SettingTexts& settings,
                                       const std::string& title,
                                       const std::map<std::string, double>& plant,
                                       double control_period,
                                       const std::optional<nb::bytes>& swing_up) {
  DesignPlant design(Plant(), control_period);
  std::vector<FlagValue> values;
  for (const auto& [name, value] : plant) values.push_back({name, FormatNumber(value), name});
  SetFlags(OptionsOf(design), values);
  ControllerConfig config = ControllerConfig::For(design);
  SetFlags(OptionsOf(config), FlagsOf(settings));
  if (swing_up) config.swing_up_policy = PolicyOf(*swing_up, config.swing_up).policy;
  const nb::gil_scoped_release unlocked;
  return std::make_shared<PolicyHandle>(
      DesignController(controller, config, title, {controller, FlagsOf(settings), {}}));
}

}  // namespace

void BindPolicies(nb::module_& m) {
  nb::class_<PolicyHandle> c(m, "PolicyHandle");
  c.def("act", &Act, nb::arg("obs"), nb::arg("out"))
      .def("values", &Values, nb::arg("obs"), nb::arg("out"))
      .def("spread", &Spread, nb::arg("obs"), nb::arg("low"), nb::arg("high"))
      .def(
          "save",
          [](const PolicyHandle& self, const std::filesystem::path& path) {
            const nb::gil_scoped_release unlocked;
            SaveTensors(self.policy().ToTensors(), path);
          },
          nb::arg("path"))
      .def("to_bytes", [](const PolicyHandle& self) { return FileOf(self.policy()); })
      .def("swing_up_bytes", [](const PolicyHandle& self) -> std::optional<nb::bytes> {
        if (!self.loaded().swing_up) return {};
        return FileOf(*self.loaded().swing_up);
      });
  const auto add = [&](const char* name, auto member) {
    c.def_prop_ro(name, [member](const PolicyHandle& self) {
      if constexpr (std::is_invocable_v<decltype(member), const Policy&>) {
        return std::invoke(member, self.policy());
      } else {
        return std::invoke(member, self.loaded());
      }
    });
  };
  add("name", &LoadedPolicy::name);
  add("kind", &Policy::kind);
  add("description", &Policy::description);
  add("task", &LoadedPolicy::task);
  add("memory", &LoadedPolicy::memory);
  add("identifies", &LoadedPolicy::identifies);
  add("any_pose", &LoadedPolicy::seeks_any_pose);
  add("obs_size", &Policy::obs_size);
  add("action_size", &Policy::action_size);
  add("num_parameters", &Policy::num_parameters);
  add("num_values", &Policy::num_values);
  add("has_spread", &Policy::has_spread);
  c.def("value_actions", &ValueActions).def("info", &DescribeInfo);
  m.def("load_policy", &Load, nb::arg("name"), nb::arg("settings"), nb::arg("made_for"));
  m.def(
      "policy_of_bytes",
      [](const nb::bytes& file, const std::string& name) {
        return std::make_shared<PolicyHandle>(PolicyOf(file, name));
      },
      nb::arg("file"), nb::arg("name"));
  m.def("redesign", &Redesign, nb::arg("controller"), nb::arg("settings"), nb::arg("title"),
        nb::arg("plant"), nb::arg("control_period"), nb::arg("swing_up").none());
  m.def("controllers", &ControllerNames);
  m.def(
      "function_policy",
      [](nb::callable function, int memory) {
        if (memory < 0 || memory > kMostMemory) {
          throw BadInput(Concat("memory: expected 0 to ", kMostMemory, " steps, got ", memory));
        }
        return std::make_shared<PolicyHandle>(MakeFunctionPolicy(std::move(function), memory));
      },
      nb::arg("function"), nb::arg("memory"));
}

}  // namespace upswing

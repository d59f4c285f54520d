// Controllers of real machines for Python.
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>

#include "base/format.h"
#include "base/text.h"
#include "extras/machine/drive/stepped_loop.h"
#include "extras/machine/twin/simulated_machine.h"
#include "python/src/bindings.h"
#include "runs/find_policy.h"

namespace upswing {
namespace {

namespace nb = nanobind;
using machine::Joints;
using machine::MachinePolicy;
using machine::Robot;
using machine::SimulatedMachine;
using machine::SteppedLoop;
using machine::SteppedLoopConfig;
using machine::Twin;

/// The policy or controller of a machine, before its loop.
struct Chosen {
  MachinePolicy policy;
  Twin twin;
};

/// Throws BadInput unless the policy's motor is at this joint (0: any).
MachinePolicy WithMotorAt(int joint, MachinePolicy policy) {
  const int own = static_cast<int>(machine::RobotOf(*policy));
  if (joint == 0 || joint == own) return policy;
  throw BadInput(Concat("actuated_joint: expected ", own, ", the joint of the motor of ",
                        Printable(policy->name), ", got ", joint));
}

Chosen Choose(const std::string& name, const SettingTexts& settings,
              const std::vector<std::string>& made_for, double control_period, int joint,
              const std::string& twin_name) {
  const Twin twin = machine::ReadTwin(twin_name, "twin");
  PolicyArguments arguments;
  arguments.name = name;
  arguments.flags = FlagsOf(settings);
  arguments.made_for = made_for;
  arguments.control_period = control_period;
  const nb::gil_scoped_release unlocked;
  const std::string robot =
      IsController(name) && joint != 0 ? machine::NameOf(static_cast<Robot>(joint)) : "";
  return {WithMotorAt(joint, machine::GetMachinePolicy(arguments, robot, twin, /*hz=*/0)), twin};
}

Chosen ChooseLoaded(const PolicyHandle& policy, int joint, const std::string& twin_name) {
  const Twin twin = machine::ReadTwin(twin_name, "twin");
  return {WithMotorAt(joint, machine::ForMachine(policy.loaded(), twin)), twin};
}

/// A twin's machine, whose motors have its torque limit.
class SimulatedHandle {
 public:
  SimulatedHandle(const Twin& twin, const PendulumState& start)
      : limit_(twin.plant.torque_limit), machine_(twin, start) {}

  void Advance(double time) {
    if (std::isfinite(time) && time >= machine_.time()) return machine_.Advance(time);
    throw BadInput(Concat("t: expected ", FormatNumber(machine_.time()), " s or later, got ",
                          FormatNumber(time)));
  }
  void Send(Joints torque) {
    for (double& each : torque) {
      if (!std::isfinite(each)) {
        throw BadInput(Concat("torques: expected finite numbers, got ", FormatNumber(each)));
      }
      each = std::clamp(each, -limit_, limit_);
    }
    machine_.Command(torque);
  }
  const SimulatedMachine& machine() const { return machine_; }

 private:
  double limit_;  // of both motors, N·m
  SimulatedMachine machine_;
};

/// The machine of a twin, or one drawn from its covariance with a seed, as `run --draw` draws it.
std::shared_ptr<SimulatedHandle> MakeMachine(const std::string& twin_name, const std::string& start,
                                             std::optional<uint64_t> draw) {
  Twin twin = machine::ReadTwin(twin_name, "twin");
  if (draw && twin.covariance.empty()) {
    throw BadInput("draw: expected a twin with [covariance], got none");
  }
  if (draw) {
    Rng rng(*draw, "loop: machine");
    twin = machine::DrawTwin(twin, rng);
  }
  return std::make_shared<SimulatedHandle>(twin, machine::ParsePendulumStart(start, "start"));
}

/// A stepped loop whose calls wait for each other.
class MachineLoop {
 public:
  MachineLoop(const Chosen& chosen, const SettingTexts& arguments, const std::string& start,
              std::optional<double> latency)
      : loop_(chosen.policy, chosen.twin, ConfigOf(chosen.twin, arguments, start, latency)),
        differences_(machine::DifferencesFromTwin(*chosen.policy, chosen.twin)) {}

  Joints Step(double time, const Joints& angle) {
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    return loop_.Step(time, angle);
  }
  /// Calls `work` with the loop.
  template <typename Work>
  auto With(const Work& work) {
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    return work(loop_);
  }
  const std::string& differences() const { return differences_; }

 private:
  static SteppedLoopConfig ConfigOf(const Twin& twin, const SettingTexts& arguments,
                                    const std::string& start, std::optional<double> latency) {
    SteppedLoopConfig config = SteppedLoopConfig::For(twin);
    Options options;
    config.Describe(options);
    for (const auto& [name, text] : arguments) options.Set(name, text, name);
    config.start = machine::ParsePendulumStart(start, "start");
    config.latency = latency;
    return config;
  }

  SteppedLoop loop_;
  std::string differences_;
  std::mutex mutex_;
};

}  // namespace

void BindMachine(nb::module_& m) {
  nb::class_<Chosen>(m, "MachinePolicy");
  m.def("machine_policy", &Choose, nb::arg("name"), nb::arg("settings"), nb::arg("made_for"),
        nb::arg("control_period"), nb::arg("actuated_joint"), nb::arg("twin"));
  m.def("machine_policy_of", &ChooseLoaded, nb::arg("policy"), nb::arg("actuated_joint"),
        nb::arg("twin"));
  using Handle = MachineLoop;
  nb::class_<Handle>(m, "MachineLoop")
      .def(
          nb::init<const Chosen&, const SettingTexts&, const std::string&, std::optional<double>>(),
          nb::arg("policy"), nb::arg("arguments"), nb::arg("start"), nb::arg("latency").none())
      .def("step", &Handle::Step, nb::arg("t"), nb::arg("q"))
      .def("stop", [](Handle& self) { self.With([](SteppedLoop& loop) { loop.Stop(); }); })
      .def(
          "refuse",
          [](Handle& self, const std::string& reason) {
            self.With([&](SteppedLoop& loop) { loop.Refuse(reason); });
          },
          nb::arg("reason"))
      .def_prop_ro("state",
                   [](Handle& self) {
                     return std::string(self.With(
                         [](const SteppedLoop& loop) { return machine::NameOf(loop.state()); }));
                   })
      .def_prop_ro("stopped",
                   [](Handle& self) {
                     return self.With([](const SteppedLoop& loop) { return loop.stopped(); });
                   })
      .def_prop_ro("estimate",
                   [](Handle& self) {
                     return self.With([](const SteppedLoop& loop) {
                       const PendulumState& s = loop.estimate();
                       return std::array{s.q1, s.q2, s.w1, s.w2};
                     });
                   })
      .def_prop_ro(
          "driven",
          [](Handle& self) {
            return self.With([](const SteppedLoop& loop) { return loop.summary().driven; });
          })
      .def_prop_ro(
          "upright",
          [](Handle& self) {
            return self.With([](const SteppedLoop& loop) { return loop.summary().upright; });
          })
      .def_prop_ro("name",
                   [](Handle& self) {
                     return self.With([](const SteppedLoop& loop) { return loop.policy().name; });
                   })
      .def_prop_ro("actuated_joint",
                   [](Handle& self) {
                     return self.With([](const SteppedLoop& loop) {
                       return static_cast<int>(machine::RobotOf(loop.policy()));
                     });
                   })
      .def_prop_ro("control_period",
                   [](Handle& self) {
                     return self.With(
                         [](const SteppedLoop& loop) { return loop.policy().control_period(); });
                   })
      .def_prop_ro("change_of_size",
                   [](Handle& self) {
                     return self.With([](const SteppedLoop& loop) {
                       return machine::ChangeOfSize(loop.policy());
                     });
                   })
      .def_prop_ro("differences", &Handle::differences);
  nb::class_<SimulatedHandle>(m, "SimulatedMachine")
      .def("advance", &SimulatedHandle::Advance, nb::arg("t"))
      .def("send", &SimulatedHandle::Send, nb::arg("torques"))
      .def("read", [](const SimulatedHandle& self) { return self.machine().Read().angle; })
      .def("state", [](const SimulatedHandle& self) {
        const PendulumState& s = self.machine().state();
        return std::array{s.q1, s.q2, s.w1, s.w2};
      });
  m.def("simulated_machine", &MakeMachine, nb::arg("twin"), nb::arg("start"),
        nb::arg("draw").none());
}

}  // namespace upswing

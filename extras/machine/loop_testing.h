#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "extras/machine/control_loop.h"
#include "extras/machine/testing.h"

/// Helpers for tests of control loops.
namespace upswing::machine {

/// Swings the motor's joint by a sine of the time.
inline double SineTorque(int64_t step, const PendulumState& /*state*/) {
  return 1.5 * std::sin(6 * kControlPeriod * static_cast<double>(step));
}

/// A loop on a link, cycle by cycle.
struct LoopBench {
  Twin twin = TestTwin();
  Limits limits;
  LoopConfig config{.seconds = 2};
  MachineController machine_controller = SineTorque;
  std::unique_ptr<MachineLink> link;
  std::string log_path;
  bool differences = false;  // whether the estimator goes without the twin
  std::unique_ptr<Estimator> estimator;
  std::unique_ptr<Supervisor> supervisor;
  std::unique_ptr<LogWriter> log;
  std::unique_ptr<ControlLoop> loop;

  void Make() {
    const double period = 1.0 / static_cast<double>(config.hz);
    estimator = differences ? std::make_unique<Estimator>(twin.sensors, period)
                            : std::make_unique<Estimator>(twin, period);
    supervisor =
        std::make_unique<Supervisor>(SupervisorConfig{.limits = limits,
                                                      .motor_limit = {5, 0.5},
                                                      .angle_range = twin.sensors.angle_range,
                                                      .quantum = twin.sensors.quantum,
                                                      .period = period});
    log = std::make_unique<LogWriter>(log_path);
    loop = std::make_unique<ControlLoop>(config, *link, *estimator, *supervisor, machine_controller,
                                         *log);
  }
};

}  // namespace upswing::machine

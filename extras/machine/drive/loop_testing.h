#pragma once

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "extras/machine/drive/control_loop.h"
#include "extras/machine/drive/fake_machine.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/twin/testing.h"

/// Helpers for tests of control loops.
namespace upswing::machine {

/// Swings the motor's joint by a sine of the time.
inline double SineTorque(int64_t step, const PendulumState& /*state*/) {
  return 1.5 * std::sin(6 * kControlPeriod * static_cast<double>(step));
}

/// A FakeMachine behind faulty lines in simulated time.
class FakeLink : public MachineLink {
 public:
  FakeLink(const Twin& twin, const FakeConfig& config, uint64_t seed = 1)
      : machine_(twin, {}, config), out_(config.line, seed, "out"), in_(config.line, seed, "in") {}

  double Now() const override { return now_; }
  void WaitUntil(double time) override { now_ = time; }
  bool simulated() const override { return true; }
  std::optional<LinkReading> Exchange(const Joints& torque, bool enabled,
                                      double /*until*/) override {
    enabled_ = enabled;
    torque_ = torque;
    out_.Send(*Decode(protocol_.Command(torque, enabled, now_)), now_);
    while (const auto frame = out_.Receive(now_)) {
      if (const auto answer = machine_.Answer(*frame, now_)) in_.Send(*answer, now_);
    }
    machine_.Advance(now_);
    std::optional<LinkReading> newest;
    while (const auto frame = in_.Receive(now_)) {
      if (const auto reading = protocol_.Take(Encode(*frame), now_)) newest = reading;
    }
    return newest;
  }

  const FakeMachine& machine() const { return machine_; }
  bool enabled() const { return enabled_; }
  const Joints& torque() const { return torque_; }

 private:
  FakeMachine machine_;
  FaultyLine out_, in_;
  LinkProtocol protocol_{/*datagrams=*/true};
  double now_ = 0;
  bool enabled_ = false;
  Joints torque_{};
};

/// A run of a real machine, and the usual time between its cycles.
struct RealRun {
  std::filesystem::path file;
  MachineLog log;
  double period;  // s
};

/// The runs of design C.1 with fast cycles, 10 of them with pushes. Empty without measured data.
inline std::vector<RealRun> RealRuns() {
  const std::filesystem::path real = RealData();
  std::vector<RealRun> runs;
  for (const char* kind : {"C.1/pushed", "C.1/swingup"}) {
    if (real.empty()) break;
    for (const auto& file : std::filesystem::directory_iterator(real / kind)) {
      const MachineLog log = ReadLog(file.path()).front();
      const double period = UsualCycle(std::span(&log, 1));
      if (period > 0.01) continue;  // MC-PILCO at 33 Hz
      runs.push_back({file.path(), log, period});
    }
  }
  return runs;
}

/// A loop on a link, cycle by cycle.
struct LoopBench {
  Twin twin = TestTwin();
  Limits limits;
  LoopConfig config{.seconds = 2};
  MachineController machine_controller = SineTorque;
  PendulumState start{};
  bool has_twin = true;        // else the loop knows only the encoders and the size
  Joints motor_limit{5, 0.5};  // N·m
  std::unique_ptr<MachineLink> link;
  std::string log_path;
  StateSource source = StateSource::kTwin;
  std::unique_ptr<Estimator> estimator;
  std::unique_ptr<Supervisor> supervisor;
  std::unique_ptr<LogWriter> log;
  std::unique_ptr<ControlLoop> loop;

  void Make() {
    const double period = 1.0 / static_cast<double>(config.hz);
    estimator = has_twin ? std::make_unique<Estimator>(twin, period, source)
                         : std::make_unique<Estimator>(twin.sensors, period);
    supervisor =
        std::make_unique<Supervisor>(SupervisorConfig{.limits = limits,
                                                      .scale = ScaleOverUsual(twin.plant),
                                                      .start = start,
                                                      .motor_limit = motor_limit,
                                                      .actuated_joint = config.actuated_joint,
                                                      .angle_range = twin.sensors.angle_range,
                                                      .quantum = twin.sensors.quantum});
    log = std::make_unique<LogWriter>(log_path);
    loop = std::make_unique<ControlLoop>(config, *link, *estimator, *supervisor, machine_controller,
                                         *log);
  }
};

}  // namespace upswing::machine

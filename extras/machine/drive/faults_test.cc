// What a machine does after a fault of its encoders or motors: the table of
// docs/howto/protection.md. UPSWING_FAULT_RUNS=20 prints it for 20 machines of each kind and rate.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "extras/machine/drive/loop_testing.h"
#include "extras/machine/drive/policy_controller.h"

namespace upswing::machine {
namespace {

constexpr double kNever = MachineFaults::kNever;
constexpr double kSeconds = 6;  // of a run
constexpr double kMotion =
    0.1;  // of a joint since its encoder sticks, which has to be noticed, rad

/// A fault from the beginning, or encoders that stick at a random moment.
struct FaultCase {
  const char* name;
  MachineFaults faults = {};
  bool at_random = false;
};

std::vector<FaultCase> FaultCases() {
  return {{"no fault"},
          {"both encoders dead", {.stuck_after = {0, 0}}},
          {"encoder 1 dead", {.stuck_after = {0, kNever}}},
          {"encoder 2 dead", {.stuck_after = {kNever, 0}}},
          {"encoder 1 sticks", {.stuck_after = {1, kNever}}, true},
          {"encoder 2 sticks", {.stuck_after = {kNever, 1}}, true},
          {"both encoders stick", {.stuck_after = {1, 1}}, true},
          {"encoders crossed", {.crossed = true}},
          {"encoder 1 reversed", {.encoder_scale = {-1, 1}}},
          {"encoder 2 reversed", {.encoder_scale = {1, -1}}},
          {"encoder 1 twice", {.encoder_scale = {2, 1}}},
          {"encoder 2 twice", {.encoder_scale = {1, 2}}},
          {"motor reversed", {.motor_scale = {-1, 1}}},
          {"motor without power", {.motor_scale = {0, 1}}},
          {"motor twice", {.motor_scale = {2, 1}}}};
}

/// What followed a fault.
struct Outcome {
  double energy = 0, velocity = 0;  // largest ones of the true motion; rad/s
  double torque = 0;                // time with torque, s
  double late = 0;                  // from a motion by kMotion to the end, s
  std::string reason;               // empty: not noticed
};

struct Setting {
  int64_t hz = 500;
  bool has_twin = true;
  uint64_t seed = 1;
};

/// Runs a controller on a machine drawn from the twin.
Outcome RunWithFault(const FaultCase& fault, const Setting& setting, const Twin& twin,
                     const MachinePolicy& policy) {
  Rng rng(setting.seed, "faults");
  const Twin machine = DrawTwin(twin, rng);
  FakeConfig config;
  config.machine = fault.faults;
  const double onset = fault.at_random ? rng.Uniform(0.3, kSeconds) : 0;
  for (double& after : config.machine.stuck_after) {
    if (fault.at_random && after < kNever) after = onset;
  }
  LoopBench bench;
  bench.twin = twin;
  bench.has_twin = setting.has_twin;
  bench.config.hz = setting.hz;
  bench.config.seconds = kSeconds;
  bench.config.compensation = setting.has_twin ? 0.95 : 0;
  bench.machine_controller = ControllerOf(policy);
  bench.link = std::make_unique<FakeLink>(machine, config, setting.seed);
  bench.Make();

  const auto& link = dynamic_cast<const FakeLink&>(*bench.link);
  const Manipulator body = BodyOf(machine);
  const double hanging = -body.At({}).energy;
  Outcome outcome;
  const auto see = [&](const PendulumState& s) {
    outcome.energy = std::max(outcome.energy, 1 + body.At(s).energy / hanging);
    outcome.velocity = std::max({outcome.velocity, std::abs(s.w1), std::abs(s.w2)});
  };
  PendulumState stuck;                // when the fault began
  double began = kNever, moved = -1;  // s; of the fault's clock, and of a motion by kMotion
  for (bool goes_on = true; goes_on;) {
    goes_on = bench.loop->Cycle();
    const PendulumState& s = link.machine().state();
    if (link.enabled()) began = std::min(began, link.Now());
    if (link.Now() < began + onset) {
      stuck = s;
      continue;
    }
    see(s);
    if (link.enabled() && link.torque() != Joints{}) {
      outcome.torque += 1 / static_cast<double>(setting.hz);
    }
    const Joints motion{s.q1 - stuck.q1, s.q2 - stuck.q2};
    for (int j = 0; j < 2; ++j) {
      const bool unseen = fault.faults.stuck_after[j] < kNever && std::abs(motion[j]) > kMotion;
      if (unseen && moved < 0) moved = link.Now();
    }
  }
  if (moved >= 0) outcome.late = link.Now() - moved;
  outcome.reason = bench.supervisor->reason();
  // The links go on without torque.
  FakeMachine after = link.machine();
  for (int i = 0; i < 500; ++i) {
    after.Advance(link.Now() + 0.002 * i);
    see(after.state());
  }
  return outcome;
}

TEST(Faults, LeaveLittleEnergyAndAreNoticed) {
  const char* wanted = std::getenv("UPSWING_FAULT_RUNS");
  const int runs = wanted == nullptr ? 1 : std::atoi(wanted);
  const std::vector<int64_t> rates =
      wanted == nullptr ? std::vector<int64_t>{500} : std::vector<int64_t>{250, 500, 1000};
  const Twin twin = ReadTwin("realaigym-twin", "twin");
  const MachinePolicy policy = GetMachinePolicy({"tvlqr", {}, {}}, "", twin, 500);
  for (const bool has_twin : {true, false}) {
    for (const FaultCase& fault : FaultCases()) {
      Outcome worst;
      int noticed = 0, all = 0;
      for (const int64_t hz : rates) {
        for (int i = 0; i < runs; ++i) {
          const auto seed = static_cast<uint64_t>(1000 + i);
          const Outcome o = RunWithFault(fault, {hz, has_twin, seed}, twin, policy);
          worst.energy = std::max(worst.energy, o.energy);
          worst.velocity = std::max(worst.velocity, o.velocity);
          worst.torque = std::max(worst.torque, o.torque);
          if (!o.reason.empty()) worst.late = std::max(worst.late, o.late);
          noticed += o.reason.empty() ? 0 : 1;
          ++all;
          const std::string where = std::string(fault.name) + (has_twin ? ", twin, " : ", ") +
                                    std::to_string(hz) + " Hz, seed " + std::to_string(seed);
          EXPECT_LT(o.energy, 4) << where;
          if (!has_twin) continue;
          const bool healthy = fault.name == std::string("no fault");
          const bool rests = fault.name == std::string("both encoders stick");
          EXPECT_TRUE(rests || o.reason.empty() == healthy) << where << ": " << o.reason;
        }
      }
      if (wanted == nullptr) continue;
      std::printf("| %s | %s | %d of %d | %.2f | %.1f | %.2f | %.2f |\n", fault.name,
                  has_twin ? "yes" : "no", noticed, all, worst.energy, worst.velocity, worst.torque,
                  worst.late);
      std::fflush(stdout);
    }
  }
}

TEST(Faults, RealMachinesHaveNone) {
  const std::vector<RealRun> runs = RealRuns();
  if (RealData().empty()) GTEST_SKIP() << "no measured data";
  const Twin twin = ReadTwin("realaigym-twin", "twin");
  for (const auto& [file, log, period] : runs) {
    Estimator estimator(twin, period);
    EarnedTorque earned({.limit = 5, .hangs = false, .quantum = twin.sensors.quantum});
    for (int k = 1; k < log.rows(); ++k) {
      const TimedReading reading{{log.angle[k], log.measured[k]}, log.time[k]};
      estimator.Update(log.time[k], log.commanded[k - 1], &reading);
      earned.See({log.time[k], log.angle[k], estimator.expectation(), period},
                 log.commanded[k - 1]);
      ASSERT_FALSE(earned.JudgeRun()) << file << " at " << log.time[k] << " s";
    }
  }
  EXPECT_GE(runs.size(), 23U);
}

TEST(Faults, ASlipDuringLostReadingsIsNoticed) {
  const Twin twin = TestTwin();
  for (const double slip : {0.0, 0.06, -0.1, 0.2}) {
    for (const int joint : {0, 1}) {
      for (const double at : {0.5, 0.9, 1.3}) {
        LoopBench bench;
        // A link that loses eight readings and slips meanwhile.
        class SlippingLink : public TwinLink {
         public:
          SlippingLink(const Twin& twin, int joint, double slip, double at)
              : TwinLink(twin, {}, 1), joint_(joint), slip_(slip), at_(at) {}
          std::optional<LinkReading> Exchange(const Joints& torque, bool enabled,
                                              double until) override {
            auto reading = TwinLink::Exchange(torque, enabled, until);
            if (Now() > at_ && Now() < at_ + 0.016) return {};
            if (Now() > at_) reading->angle[joint_] += slip_;
            return reading;
          }

         private:
          int joint_;
          double slip_, at_;
        };
        bench.link = std::make_unique<SlippingLink>(twin, joint, slip, at);
        bench.Make();
        bench.loop->Run();
        EXPECT_EQ(bench.supervisor->reason().empty(), slip == 0)
            << slip << " rad at " << at << " s: " << bench.supervisor->reason();
        if (slip != 0) {
          EXPECT_LT(bench.link->Now(), at + 0.03) << slip;
        }
      }
    }
  }
}

}  // namespace
}  // namespace upswing::machine

// The control loop on machines of every size: a machine and its image in other units have the same
// run, and a small machine has no false faults.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "extras/machine/drive/excitation.h"
#include "extras/machine/drive/loop_testing.h"
#include "extras/machine/drive/policy_controller.h"
#include "extras/machine/twin/testing.h"

namespace upswing::machine {
namespace {

constexpr int64_t kOriginalHz = 316;  // the images have 1000 and 100 cycles per second

/// A machine in the units of UsualPlant. Without dry friction: the slope of its arctangent (s/rad)
/// is the same for all sizes.
Twin Original() {
  Twin twin = TestTwin();
  twin.plant = UsualPlant();
  twin.plant.damping1 = twin.plant.damping2 = 0.005;
  twin.actuator.current_inertia = 0.002;
  twin.actuator.delay = 0;
  twin.actuator.lag = 0.012;
  twin.sensors.quantum = 1e-9;
  twin.sensors.torque_quantum = 0.01;
  twin.uncertain = {"zero1", "zero2"};
  twin.covariance = {4e-4, 0, 0, 4e-4};
  twin.loop.period = 1.0 / kOriginalHz;
  return twin;
}

/// The images with a tenth and ten times the length, to whole cycles per second, which changes
/// gravity by 0.1%.
std::array<Image, 2> Images() {
  return {Image{.length = 0.1, .mass = 1e-3, .time = kOriginalHz / 1000.0},
          Image{.length = 10, .mass = 500, .time = kOriginalHz / 100.0}};
}

/// A run of the machine with a fault, in its own units.
struct Story {
  const char* name;
  MachineFaults faults = {};
  bool has_twin = true;
  Joints push{};                           // torques from 1 s to 1.1 s, N·m
  double lost_at = MachineFaults::kNever;  // when 4 readings are lost, s
  Joints slip{};                           // of the encoders after them, rad
  int actuated_joint = 1;
  double velocity = 25;  // limit, rad/s
};

std::vector<Story> Stories() {
  constexpr double kNo = MachineFaults::kNever;
  constexpr double kTurn = 2 * std::numbers::pi;
  return {
      {.name = "no fault"},
      {.name = "no twin", .has_twin = false},
      {.name = "acrobot", .actuated_joint = 2},
      {.name = "push of link 1", .push = {4, 0}},
      {.name = "push of link 2", .push = {0, 1.5}},
      {.name = "lost readings", .lost_at = 0.9},
      {.name = "slip of joint 1", .lost_at = 0.9, .slip = {0.15, 0}},
      {.name = "slip of joint 2", .lost_at = 1.3, .slip = {0, -0.2}},
      {.name = "jump", .lost_at = 0.9, .slip = {kTurn, 0}},
      {.name = "jump, no twin", .has_twin = false, .lost_at = 0.9, .slip = {0, kTurn}},
      {.name = "encoder 1 sticks", .faults = {.stuck_after = {1.0016, kNo}}},
      {.name = "encoder 2 sticks", .faults = {.stuck_after = {kNo, 1.3}}},
      {.name = "both encoders dead", .faults = {.stuck_after = {0, 0}}},
      {.name = "encoder 1 dead, no twin", .faults = {.stuck_after = {0, kNo}}, .has_twin = false},
      {.name = "encoder 2 dead, no twin", .faults = {.stuck_after = {kNo, 0}}, .has_twin = false},
      {.name = "silent", .faults = {.silent_after = 0.8}},
      {.name = "encoder 1 reversed", .faults = {.encoder_scale = {-1, 1}}},
      {.name = "encoder 2 reversed", .faults = {.encoder_scale = {1, -1}}},
      {.name = "motor reversed", .faults = {.motor_scale = {-1, 1}}},
      {.name = "motor reversed, no twin", .faults = {.motor_scale = {-1, 1}}, .has_twin = false},
      {.name = "motor without power", .faults = {.motor_scale = {0, 1}}},
      {.name = "encoders crossed", .faults = {.crossed = true}},
      {.name = "too fast", .velocity = 4}};
}

/// A fake machine without a line, so that torques are no single-precision numbers. Torques push it,
/// readings are lost, and encoders slip.
class StoryLink : public MachineLink {
 public:
  StoryLink(const Story& story, const Twin& twin, const FakeConfig& config, const Image& image)
      : story_(story), image_(image), machine_(twin, {}, config) {}

  double Now() const override { return now_; }
  void WaitUntil(double time) override { now_ = time; }
  bool simulated() const override { return true; }
  std::optional<LinkReading> Exchange(const Joints& torque, bool enabled,
                                      double /*until*/) override {
    const double time = now_ / image_.time;
    Joints pushed = torque;
    if (enabled && time > 1 && time < 1.1) {
      for (int j = 0; j < 2; ++j) pushed[j] += image_.torque() * story_.push[j];
    }
    const auto answer = machine_.Answer({.flags = enabled ? Frame::kEnabled : uint16_t{0},
                                         .sequence = ++sequence_,
                                         .torque = pushed},
                                        now_);
    if (!answer || (time > story_.lost_at && time < story_.lost_at + 4.5 / kOriginalHz)) return {};
    LinkReading reading;
    reading.time = reading.received = now_;
    reading.angle = answer->angle;
    reading.torque = answer->torque;
    reading.locked = (answer->flags & Frame::kLocked) != 0;
    if (time > story_.lost_at) {
      for (int j = 0; j < 2; ++j) reading.angle[j] += story_.slip[j];
    }
    return reading;
  }
  const PendulumState& state() const { return machine_.state(); }

 private:
  Story story_;
  Image image_;
  FakeMachine machine_;
  uint32_t sequence_ = 0;
  double now_ = 0;
};

/// A cycle, in units of the original machine.
struct Moment {
  LoopState state;
  Joints torque;  // N·m
  PendulumState truth;
};
struct History {
  std::vector<Moment> moments;
  std::string reason;  // without numbers
};

/// The state in units of the original machine.
PendulumState Natural(const PendulumState& s, const Image& image) {
  return {s.q1, s.q2, s.w1 * image.time, s.w2 * image.time};
}

/// Swings the motor's joint by a sine, with a feedback of the estimate.
MachineController SwingOf(const Image& image, int actuated_joint) {
  const auto law = [=](int64_t step, const PendulumState& state) {
    const auto [q1, q2, w1, w2] = Natural(state, image);
    const double swing = 1.5 * std::sin(6 * kControlPeriod * static_cast<double>(step));
    const double damped = actuated_joint == 1 ? 0.02 * w1 + 0.5 * std::sin(q1) : 0.02 * w2 + q2;
    return image.torque() * (swing - damped);
  };
  return {law, kControlPeriod * image.time};
}

/// Runs a story on the image of a twin.
History HistoryOf(const Story& story, const Twin& original, const Image& image) {
  LoopBench bench;
  bench.twin = ImageOf(original, image);
  bench.twin.plant.actuated_joint = story.actuated_joint;
  bench.has_twin = story.has_twin;
  bench.config = {.hz = std::llround(kOriginalHz / image.time),
                  .seconds = 2 * image.time,
                  .actuated_joint = story.actuated_joint};
  bench.machine_controller = SwingOf(image, story.actuated_joint);
  for (double& limit : bench.motor_limit) limit *= image.torque();
  bench.limits = Limits::For(bench.twin);
  bench.limits.velocity *= story.velocity / 25;
  bench.limits.age *= image.time;        // the link is scaled, too
  bench.limits.brake_seconds *= 1.0001;  // ends within a cycle
  FakeConfig fake;
  fake.machine = story.faults;
  fake.watchdog *= image.time;
  for (double& after : fake.machine.stuck_after) after *= image.time;
  fake.machine.silent_after *= image.time;
  auto link = std::make_unique<StoryLink>(story, bench.twin, fake, image);
  const StoryLink& machine = *link;
  bench.link = std::move(link);
  bench.Make();
  History history;
  while (bench.loop->Cycle()) {
    const Joints& torque = bench.loop->torque();
    history.moments.push_back({bench.supervisor->state(),
                               {torque[0] / image.torque(), torque[1] / image.torque()},
                               Natural(machine.state(), image)});
  }
  for (const char c : bench.supervisor->reason()) {
    if (std::string("+-.0123456789e").find(c) == std::string::npos) history.reason += c;
  }
  return history;
}

TEST(Size, AnImageHasTheUnitsOfTheImage) {
  for (const Image& image : Images()) {
    const Scale scale = ScaleOverUsual(ImageOf(Original(), image).plant);
    EXPECT_NEAR(scale.time / image.time, 1, 1e-12);
    EXPECT_NEAR(scale.torque / image.torque(), 1, 1e-12);
  }
  EXPECT_EQ(ScaleOverUsual(Original().plant), Scale());
  EXPECT_EQ(ScaleOverUsual(TestTwin().plant), Scale());
}

TEST(Size, LimitsFollowTheMachine) {
  for (const Twin& twin : {TestTwin(), ReadTwin("realaigym-twin", "twin")}) {
    const Limits usual, limits = Limits::For(twin);
    EXPECT_EQ(limits.velocity, usual.velocity);
    EXPECT_EQ(limits.torque, usual.torque);
    EXPECT_EQ(limits.passive_torque, usual.passive_torque);
    EXPECT_EQ(limits.brake_damping, usual.brake_damping);
    EXPECT_EQ(limits.patience, usual.patience);
  }
  const Image image = Images()[1];
  const Twin large = ImageOf(Original(), image);
  const Limits limits = Limits::For(large);
  EXPECT_NEAR(limits.velocity, 25 / image.time, 1e-9);
  EXPECT_EQ(limits.torque, large.plant.torque_limit);
  EXPECT_EQ(limits.passive_torque, large.actuator.passive_limit);
  EXPECT_NEAR(limits.brake_damping, 0.2 * image.torque() * image.time, 1e-6);
  EXPECT_NEAR(limits.brake_seconds, 5 * image.time, 1e-9);
  EXPECT_NEAR(limits.patience, 10 * image.time, 1e-9);
  EXPECT_EQ(limits.age, Limits().age);
  EXPECT_EQ(Limits::For(ImageOf(Original(), Images()[0])).patience, Limits().patience);
}

TEST(Size, AMachineAndItsImagesHaveTheSameRuns) {
  const double unit = 3.9;  // of the original machine's torque, N·m: its gravity
  for (const Story& story : Stories()) {
    const History expected = HistoryOf(story, Original(), {});
    for (const Image& image : Images()) {
      const std::string where = std::string(story.name) + ", " + std::to_string(image.length);
      const History got = HistoryOf(story, Original(), image);
      EXPECT_EQ(got.reason, expected.reason) << where;
      ASSERT_EQ(got.moments.size(), expected.moments.size()) << where << ": " << got.reason;
      for (size_t k = 0; k < expected.moments.size(); ++k) {
        const Moment &a = expected.moments[k], &b = got.moments[k];
        ASSERT_EQ(NameOf(b.state), std::string(NameOf(a.state))) << where << ", cycle " << k;
        for (int j = 0; j < 2; ++j) {
          ASSERT_NEAR(b.torque[j] / unit, a.torque[j] / unit, 1e-6) << where << ", cycle " << k;
        }
        ASSERT_NEAR(b.truth.q1, a.truth.q1, 1e-5) << where << ", cycle " << k;
        ASSERT_NEAR(b.truth.q2, a.truth.q2, 1e-5) << where << ", cycle " << k;
      }
    }
  }
}

/// The small machine with which runs begin, and a machine like it: its values differ by a third of
/// the twin's standard deviations, as after an adaptation to the day.
Twin SmallTwin() {
  Twin twin = ReadTwin("cloudpendulum", "twin");
  twin.actuator.delay = 0.002;  // its logs leave out the delay of a command
  return twin;
}
Twin MachineLike(Twin twin, uint64_t seed) {
  for (double& covariance : twin.covariance) covariance /= 9;
  Rng rng(seed, "size test");
  return DrawTwin(twin, rng);
}

/// Runs a controller on the small twin behind a link to its end.
LoopBench RunOfSmall(std::unique_ptr<MachineLink> link, const MachineController& controller,
                     double age = Limits().age) {
  LoopBench bench;
  bench.twin = SmallTwin();
  bench.limits = Limits::For(bench.twin);
  bench.limits.age = age;
  bench.motor_limit = {bench.limits.torque, bench.limits.passive_torque};
  bench.config.compensation = 0.95;
  bench.machine_controller = controller;
  bench.link = std::move(link);
  bench.Make();
  bench.loop->Run();
  return bench;
}

/// A controller or torques, by name.
struct Driver {
  std::string name;
  MachineController controller;
};

/// Drivers that move the small machine up to its limits and beyond.
std::vector<Driver> SmallDrivers(uint64_t seed) {
  static const Twin twin = SmallTwin();
  static const std::vector<MachinePolicy> designed = [] {
    std::vector<MachinePolicy> policies;
    for (const char* name : {"energy", "lqr", "tvlqr"}) {
      policies.push_back(GetMachinePolicy({name, {}, {}}, "", twin, 500));
    }
    return policies;
  }();
  std::vector<Driver> drivers;
  for (const MachinePolicy& policy : designed) {
    drivers.push_back({policy->name, ControllerOf(policy)});
  }
  const auto lean = [](const PendulumState& s) { return std::abs(s.q1) / 2; };
  const Excitation torques(twin.plant.torque_limit, 1, lean, seed, ScaleOverUsual(twin.plant));
  drivers.push_back({"excitation", MachineController(torques, 0.008)});
  return drivers;
}

TEST(Size, ASmallMachineHasNoFalseFault) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    for (const auto& [name, controller] : SmallDrivers(seed)) {
      FakeConfig config;
      config.line = {.loss = 0.02, .duplicate = 0.02, .reorder = 0.02, .delay = 0.0005};
      const LoopBench bench = RunOfSmall(
          std::make_unique<FakeLink>(MachineLike(SmallTwin(), seed), config, seed), controller);
      EXPECT_FALSE(bench.supervisor->faulty())
          << name << ", seed " << seed << ": " << bench.supervisor->reason();
      EXPECT_GT(bench.loop->summary().driven, 0.1) << name << ", seed " << seed;
    }
  }
}

TEST(Size, ASmallMachineMayPauseFor70Milliseconds) {
  int gaps = 0;
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    for (const auto& [name, controller] : SmallDrivers(seed)) {
      Twin machine = MachineLike(SmallTwin(), seed);
      machine.loop = {.period = 0.002, .jitter = 0.0001, .late_share = 0.018, .late = 0.07};
      const LoopBench bench =
          RunOfSmall(std::make_unique<TwinLink>(machine, PendulumState(), seed), controller, 0.1);
      EXPECT_FALSE(bench.supervisor->faulty())
          << name << ", seed " << seed << ": " << bench.supervisor->reason();
      gaps += bench.loop->summary().latest > 0.06 ? 1 : 0;
    }
  }
  EXPECT_GT(gaps, 20);
}

/// The readings of a log that repeats each one until the next comes, with the measured torques as
/// sent ones.
std::vector<TimedReading> NewReadings(const MachineLog& log) {
  std::vector<TimedReading> readings;
  for (int k = 1; k < log.rows(); ++k) {
    const bool repeats = log.angle[k] == log.angle[k - 1] && log.velocity[k] == log.velocity[k - 1];
    if (!repeats) readings.push_back({{log.angle[k], log.measured[k]}, log.time[k]});
  }
  return readings;
}

TEST(Size, ARealSmallMachineHasNoFault) {
  if (RealData().empty()) GTEST_SKIP() << "no measured data";
  const Twin twin = ReadTwin("cloudpendulum", "twin");
  for (const char* name : {"FreeFall_00", "FreeFall_01", "FreeFall_02", "sysid_exp_data_30s"}) {
    const auto file = RealData() / "cloudpendulum" / (std::string(name) + ".csv.gz");
    const MachineLog log = ReadLog(file).front();
    const Twin own = InSession(twin, log);
    // New readings come every 2 ms, or in each cycle of a slower loop.
    const double period = std::max(0.002, UsualCycle(std::span(&log, 1)));
    const std::vector<TimedReading> readings = NewReadings(log);
    EXPECT_GT(readings.size(), 5000U);
    // The run begins in the estimated state in which the supervisor arms the machine.
    Estimator first(own, period), estimator(own, period);
    for (int k = 0; k <= Supervisor::kArmReadings; ++k) {
      first.Update(readings[k].time, readings[k].torque, &readings[k]);
    }
    Supervisor supervisor({.limits = {.angle = 1e3, .velocity = 1e3, .energy = 1e3},
                           .scale = ScaleOverUsual(own.plant),
                           .start = first.now(),
                           .angle_range = 1e3,
                           .quantum = own.sensors.quantum});
    double last = 0;
    for (const TimedReading& reading : readings) {
      estimator.Update(reading.time, reading.torque, &reading);
      supervisor.Step({.time = reading.time,
                       .fresh = true,
                       .read_at = last,
                       .received = reading.time,
                       .angle = reading.angle,
                       .torque = reading.torque,
                       .zero = estimator.zero(),
                       .state = estimator.now(),
                       .ahead = estimator.ahead(),
                       .energy = estimator.energy(),
                       .period = period,
                       .expected = estimator.expectation()});
      last = reading.time;
    }
    EXPECT_EQ(supervisor.state(), LoopState::kRunning) << name;
    EXPECT_EQ(supervisor.reason(), "") << name;
  }
}

TEST(Size, APulseWaitsForReadings) {
  // A link that loses all readings for 70 ms from the first torque on.
  class BlindLink : public TwinLink {
   public:
    using TwinLink::TwinLink;
    std::optional<LinkReading> Exchange(const Joints& torque, bool enabled, double until) override {
      const auto reading = TwinLink::Exchange(torque, enabled, until);
      if (torque[0] != 0 && begin_ < 0) begin_ = Now();
      const bool is_blind = begin_ >= 0 && Now() < begin_ + 0.07;
      if (!is_blind) return reading;
      if (Now() > begin_ + 0.015) strongest = std::max(strongest, std::abs(torque[0]));
      ++blind;
      return {};
    }
    double strongest = 0;  // torque in the gap, N·m
    int blind = 0;         // cycles

   private:
    double begin_ = -1;  // s
  };
  const auto torque = [](int64_t /*step*/, const PendulumState& /*state*/) { return 0.01; };
  auto link = std::make_unique<BlindLink>(SmallTwin(), PendulumState(), 1);
  const LoopBench bench = RunOfSmall(std::move(link), MachineController(torque), 0.1);
  const auto& blind = dynamic_cast<const BlindLink&>(*bench.link);
  EXPECT_GT(blind.blind, 30);
  EXPECT_EQ(blind.strongest, 0);
  EXPECT_EQ(bench.supervisor->reason(), "");
  EXPECT_GT(bench.loop->summary().driven, 0.1);
}

TEST(Size, FaultsOfASmallMachineAreFound) {
  constexpr double kNo = MachineFaults::kNever;
  struct Case {
    const char* name;
    MachineFaults faults;
  };
  const std::vector<Case> cases{{"encoder 1 sticks", {.stuck_after = {0.5, kNo}}},
                                {"encoder 2 sticks", {.stuck_after = {kNo, 0.5}}},
                                {"encoder 1 dead", {.stuck_after = {0, kNo}}},
                                {"encoder 2 dead", {.stuck_after = {kNo, 0}}},
                                {"encoder 1 reversed", {.encoder_scale = {-1, 1}}},
                                {"encoder 2 reversed", {.encoder_scale = {1, -1}}},
                                {"motor reversed", {.motor_scale = {-1, 1}}},
                                {"encoders crossed", {.crossed = true}}};
  for (const auto& [fault, faults] : cases) {
    for (uint64_t seed = 1; seed <= 20; ++seed) {
      FakeConfig config;
      config.machine = faults;
      const LoopBench bench =
          RunOfSmall(std::make_unique<FakeLink>(MachineLike(SmallTwin(), seed), config, seed),
                     SmallDrivers(seed)[2].controller);
      EXPECT_TRUE(bench.supervisor->faulty())
          << fault << ", seed " << seed << ": " << bench.supervisor->reason();
    }
  }
}

}  // namespace
}  // namespace upswing::machine

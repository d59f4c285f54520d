#include "extras/machine/drive/learn.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "extras/machine/drive/excitation.h"
#include "extras/machine/drive/learn_candidates.h"
#include "extras/machine/drive/learn_causes.h"
#include "extras/machine/drive/learn_trials.h"
#include "extras/machine/drive/loop_testing.h"
#include "extras/machine/drive/play_testing.h"
#include "extras/machine/twin/first_twin.h"
#include "extras/machine/twin/testing.h"
#include "os/testing.h"

namespace upswing::machine {
namespace {

/// A machine unlike RealAIGym's, with coarse encoders.
Twin StrangeTwin() {
  Twin twin;
  twin.plant.mass1 = 0.8;
  twin.plant.mass2 = 0.4;
  twin.plant.length1 = 0.27;
  twin.plant.length2 = 0.2;
  twin.plant.damping1 = twin.plant.damping2 = 0.004;
  twin.plant.coulomb1 = 0.1;
  twin.plant.coulomb2 = 0.05;
  twin.actuator.delay = 0.004;
  twin.actuator.lag = 0.002;
  twin.sensors.quantum = 6.283185307179586 / 2000;
  twin.sensors.zero1 = -0.04;
  twin.sensors.zero2 = 0.03;
  return twin;
}

LearnConfig ConfigFor(double hold) {
  LearnConfig config;
  config.encoder_counts = 2000;
  config.hold = hold;
  config.computing = 1e6;  // sanitizers take longer
  return config;
}

/// A machine in simulated time that remembers what it showed and got.
class WatchedLink : public TwinLink {
 public:
  double sign = 1;  // of the motors

  explicit WatchedLink(const Twin& twin)
      : TwinLink(twin, {}, 1), zero_{twin.sensors.zero1, twin.sensors.zero2} {}

  std::optional<LinkReading> Exchange(const Joints& torque, bool enabled, double until) override {
    const auto reading = TwinLink::Exchange({sign * torque[0], sign * torque[1]}, enabled, until);
    enabled_ = enabled;
    if (torque != Joints{}) acting += reading->time - last_;
    for (int j = 0; j < 2; ++j) {
      const double angle = reading->angle[j] - zero_[j];
      if (last_ > 0) {
        const double velocity = (angle - angle_[j]) / (reading->time - last_);
        fastest = std::max(fastest, std::abs(velocity));
      }
      largest = std::max(largest, std::abs(angle));
      angle_[j] = angle;
      strongest[j] = std::max(strongest[j], std::abs(torque[j]));
    }
    last_ = reading->time;
    const bool inverted = Inverted({angle_[0], angle_[1], 0, 0});
    if (!inverted) upright_since_ = last_;
    longest_upright = std::max(longest_upright, last_ - upright_since_);
    return reading;
  }
  bool enabled() const { return enabled_; }

  double largest = 0, fastest = 0;  // of both joints, rad and rad/s
  Joints strongest{};               // torques, N·m
  double longest_upright = 0;       // s
  double acting = 0;                // time with torques, s

 protected:
  const Joints& angle() const { return angle_; }

 private:
  Joints zero_, angle_{};
  double last_ = 0, upright_since_ = 0;
  bool enabled_ = false;
};

LearnResult LearnOn(
    MachineLink& link, const LearnConfig& config, const std::filesystem::path& out,
    const std::function<bool()>& stop = [] { return false; }) {
  return Learn(
      config, link, out, nullptr, [](const std::string&) {}, stop);
}

/// All logs of a session.
std::vector<MachineLog> LogsIn(const std::filesystem::path& folder) {
  std::vector<MachineLog> logs;
  for (int i = 1;; ++i) {
    const auto file = folder / Concat("log-0", i, ".csv");
    if (!std::filesystem::exists(file)) return logs;
    logs.push_back(ReadLog(file.string()).front());
  }
}

TEST(Learn, BalancesAMachineThatItDoesNotKnow) {
  const TempFolder folder;
  WatchedLink link(StrangeTwin());
  const LearnConfig config = ConfigFor(2);
  const LearnResult result = LearnOn(link, config, folder.path());
  EXPECT_EQ(result.reason, "");
  EXPECT_GE(link.longest_upright, 2);
  EXPECT_FALSE(link.enabled());
  EXPECT_LE(link.strongest[0], 5.0);
  EXPECT_LE(link.strongest[1], 0.5);
  EXPECT_LT(result.motion, config.MostMotion());
  const std::vector<MachineLog> logs = LogsIn(folder.path());
  const Twin twin = StrangeTwin();
  const auto causes = CausesOf({.config = config, .twin = twin, .logs = logs, .is_faulty = true});
  ASSERT_EQ(causes.size(), 1);
  EXPECT_EQ(causes[0], "play of a gear or a coupling looks like this, too");
  // The file has the machine's equations of motion.
  const Manipulator found = BodyOf(ReadTwin((folder.path() / "twin.toml").string(), "twin"));
  const Manipulator truth = BodyOf(StrangeTwin());
  EXPECT_NEAR(found.G1, truth.G1, 0.03 * truth.G1);
  EXPECT_NEAR(found.G2, truth.G2, 0.03 * truth.G2);
  EXPECT_NEAR(found.b, truth.b, 0.03 * truth.b);
}

TEST(Learn, BalancesASmallMachineOfWhichItKnowsTheLength) {
  const TempFolder folder;
  WatchedLink link(ReadTwin("cloudpendulum", "twin"));
  LearnConfig config = ConfigFor(2);
  config.encoder_counts = 131112;
  config.length = 0.1;
  config.limits = config.DefaultLimits(0.15);
  EXPECT_NEAR(config.limits.velocity, 25 / std::sqrt(0.1 / 0.5), 1e-6);
  const LearnResult result = LearnOn(link, config, folder.path());
  EXPECT_EQ(result.reason, "");
  EXPECT_GE(link.longest_upright, 2);
  EXPECT_LE(link.strongest[0], 0.15);
  EXPECT_LE(link.strongest[1], 0.0151);
  EXPECT_LT(result.motion, 30);
}

TEST(Learn, WithoutALengthTheMachineIsOfTheUsualSize) {
  LearnConfig config = ConfigFor(2);
  for (const double torque : {0.1, 1.0, 5.0, 100.0}) {
    config.limits.torque = torque;
    EXPECT_EQ(ScaleOverUsual(config.Known().plant), Scale());
    EXPECT_EQ(config.DefaultLimits(torque).velocity, Limits().velocity);
    EXPECT_EQ(config.DefaultLimits(torque).angle, 25);
    EXPECT_EQ(config.MostMotion(), 60);
  }
}

TEST(Learn, ASlowMachineHasMoreTime) {
  LearnConfig config = ConfigFor(2);
  config.limits.torque = 5 * 1000;
  config.length = 10 * 0.5;
  EXPECT_NEAR(config.MostMotion(), 60 * std::sqrt(10), 1e-6);
  config.length = 0.1 * 0.5;
  EXPECT_EQ(config.MostMotion(), 60);
  config.motion = 45;
  EXPECT_EQ(config.MostMotion(), 45);
}

TEST(Learn, ExcitationsStayWithinTheLimits) {
  const TempFolder folder;
  WatchedLink link(StrangeTwin());
  LearnConfig config = ConfigFor(2);
  config.limits.velocity = 6;
  config.limits.angle = 3.5;
  config.limits.torque = 3;
  config.motion = 10;  // for both excitations, and no try
  const LearnResult result = LearnOn(link, config, folder.path());
  EXPECT_TRUE(result.reason.starts_with("the time of motion is used up")) << result.reason;
  EXPECT_EQ(result.tries, 0);
  EXPECT_LE(result.motion, config.MostMotion());
  EXPECT_LE(link.acting, config.MostMotion());
  EXPECT_LT(link.largest, 3.5);
  // A step of the encoder in one cycle is a velocity, too.
  EXPECT_LT(link.fastest, 6 + 2 * 6.3 / 2000 / 0.002);
  EXPECT_LE(link.strongest[0], 3);
  EXPECT_GT(link.largest, 0.5);
}

TEST(Learn, AMachineThatDoesNotAnswerGetsNoMoreTorque) {
  constexpr double kNever = MachineFaults::kNever;
  const auto learn = [](const MachineFaults& faults) {
    const TempFolder folder;
    FakeConfig fault;
    fault.machine = faults;
    FakeLink link(StrangeTwin(), fault);
    LearnConfig config = ConfigFor(2);
    config.limits.velocity = 15;
    double fastest = 0;
    const LearnResult result = LearnOn(link, config, folder.path(), [&] {
      const PendulumState& s = link.machine().state();
      fastest = std::max({fastest, std::abs(s.w1), std::abs(s.w2)});
      return false;
    });
    EXPECT_LT(fastest, config.limits.velocity) << result.reason;
    EXPECT_EQ(result.reason.find("raise"), std::string::npos) << result.reason;
    EXPECT_FALSE(link.enabled());
    return result.reason;
  };
  for (const Joints& dead : {Joints{0, 0}, {0, kNever}, {kNever, 0}}) {
    EXPECT_NE(learn({.stuck_after = dead}).find("does not answer"), std::string::npos);
  }
  for (const MachineFaults& wrong :
       {MachineFaults{.encoder_scale = {-1, 1}}, {.motor_scale = {-1, 1}}, {.crossed = true}}) {
    EXPECT_NE(learn(wrong).find("the sign"), std::string::npos);
  }
}

TEST(Learn, EndsWithoutMotion) {
  const TempFolder folder;
  Twin stuck = StrangeTwin();
  stuck.plant.coulomb1 = stuck.plant.coulomb2 = 7;
  WatchedLink link(stuck);
  const LearnResult result = LearnOn(link, ConfigFor(2), folder.path());
  EXPECT_NE(result.reason.find("no motion"), std::string::npos) << result.reason;
  EXPECT_EQ(result.tries, 0);
}

/// A machine that something knocks over whenever its links have been upright for a while.
class KnockedLink : public WatchedLink {
 public:
  using WatchedLink::WatchedLink;

  std::optional<LinkReading> Exchange(const Joints& torque, bool enabled, double until) override {
    constexpr double kQuiet = 0.4, kKnock = 0.1;  // s
    if (!Inverted({angle()[0], angle()[1], 0, 0})) upright_since_ = Now();
    const bool knocks = Now() > upright_since_ + kQuiet;
    if (knocks && Now() > upright_since_ + kQuiet + kKnock) upright_since_ = Now();
    return WatchedLink::Exchange(knocks ? Joints{5, 0} : torque, enabled, until);
  }

 private:
  double upright_since_ = 0;  // s
};

TEST(Learn, ChangesSomethingAfterAFailedTryAndKeepsItsTime) {
  const TempFolder folder;
  KnockedLink link(StrangeTwin());
  LearnConfig config = ConfigFor(2);
  config.limits.brake_seconds = 1;
  config.motion = 45;
  std::vector<std::string> tries;
  const auto keep_tries = [&](const std::string& line) {
    if (line.starts_with("try ")) tries.push_back(line.substr(line.find(':')));
  };
  const LearnResult result =
      Learn(config, link, folder.path(), nullptr, keep_tries, [] { return false; });
  EXPECT_GE(result.tries, 2);
  EXPECT_LE(result.motion, config.MostMotion());
  EXPECT_LE(link.acting, config.MostMotion());
  std::ranges::sort(tries);
  EXPECT_EQ(std::ranges::adjacent_find(tries), tries.end());
  // Rounding decides whether the last twin names what no twin has.
  const std::string used_up = "the time of motion is used up: ";
  EXPECT_TRUE(result.reason.starts_with(used_up + "another try takes 5.0 s") ||
              result.reason.starts_with(used_up + "5 of 5 simulated machines of the twin balance"))
      << result.reason;
}

TEST(Learn, NamesThePlayOfACoupling) {
  const TempFolder folder;
  PlayLink link(StrangeTwin(), {0.05, 0}, PlayIn::kEncoder);
  const LearnConfig config = ConfigFor(2);
  LearnOn(link, config, folder.path());
  const std::vector<MachineLog> logs = LogsIn(folder.path());
  const Twin twin = StrangeTwin();
  const auto causes = CausesOf({.config = config, .twin = twin, .logs = logs, .is_faulty = true});
  ASSERT_FALSE(causes.empty());
  EXPECT_TRUE(causes[0].starts_with("suspect play of about 0.0")) << causes[0];
  EXPECT_NE(causes[0].find("rad at joint 1, between the link and its encoder"), std::string::npos)
      << causes[0];
}

TEST(Learn, LinksThatFrictionHoldsAreDrivenFromWhereTheyStand) {
  Twin twin = StrangeTwin();
  twin.plant.coulomb1 = 2;
  twin.plant.coulomb2 = 0.3;
  const PendulumState leaning{0.5, 0, 0, 0};
  LearnConfig config = ConfigFor(2);
  config.limits.patience = 2;
  for (const double start_angle : {kStartAngle, kAnyAngle}) {
    TwinLink link(twin, leaning, 1);
    const RunRules rules{.limits = config.limits, .seconds = 1, .start_angle = start_angle};
    const RunOutcome run = RunCycles(config, rules, twin.sensors, Estimator(twin, 1 / config.hz),
                                     SineTorque, link, [] { return false; });
    EXPECT_EQ(run.motion > 0.05, start_angle == kAnyAngle) << run.reason;
  }
}

TEST(LearnCauses, NameDryFrictionThatHoldsLinks) {
  Twin twin = StrangeTwin();  // gravity at link 2: 0.39 N·m
  twin.plant.coulomb2 = 0.15;
  LearnConfig config = ConfigFor(2);
  config.limits.passive_torque = 0.1;
  const FailedTry failure{.held = kDraws, .balanced = 0.5};
  const auto causes = CausesOf({.config = config, .twin = twin, .tries = {&failure, 1}});
  ASSERT_EQ(causes.size(), 1) << Join(causes, "; ");
  EXPECT_EQ(causes[0],
            "dry friction of joint 2 holds 0.24 N·m, so that its link stands still up to 37° from "
            "hanging, and --passive-torque compensates 0.1 N·m");
}

TEST(LearnCauses, NameWhatNoTwinHas) {
  Twin twin = StrangeTwin();
  twin.plant.coulomb1 = twin.plant.coulomb2 = 0.01;
  const LearnConfig config = ConfigFor(2);
  const FailedTry failure{.held = kDraws, .balanced = 0.5};
  const auto causes = CausesOf({.config = config, .twin = twin, .tries = {&failure, 1}});
  ASSERT_EQ(causes.size(), 1) << Join(causes, "; ");
  EXPECT_NE(causes[0].find("the machine stands for 0.5 s at most: look for play"),
            std::string::npos);
}

TEST(LearnCauses, NameLimitsThatAreTooTight) {
  LearnConfig config = ConfigFor(2);
  config.limits.velocity = 3;
  const Twin twin = StrangeTwin();
  const auto causes = CausesOf({.config = config, .twin = twin});
  ASSERT_FALSE(causes.empty());
  EXPECT_NE(causes.back().find("only without your limits of angle, velocity and energy"),
            std::string::npos)
      << causes.back();
}

TEST(LearnCandidates, AllDiffer) {
  for (const int joint : {1, 2}) {
    Plant plant = StrangeTwin().plant;
    plant.actuated_joint = joint;
    std::vector<std::string> texts;
    for (const Candidate& candidate : CandidatesFor(plant)) {
      const PolicyArguments a = ArgumentsOf(candidate, plant);
      std::string text = Concat(a.name, " ", candidate.compensation);
      for (const FlagValue& flag : a.flags) text += " " + flag.name + "=" + flag.text;
      for (const std::string& change : a.made_for) text += " " + change;
      texts.push_back(text);
    }
    std::ranges::sort(texts);
    EXPECT_EQ(std::ranges::adjacent_find(texts), texts.end());
  }
}

TEST(LearnTrials, ATwinChangesByMoreThanItsDeviation) {
  Twin before = StrangeTwin();
  before.uncertain = {"mass1", "delay"};
  before.covariance = {0.01, 0, 0, 1e-6};
  Twin now = before;
  now.plant.mass1 += 0.19;
  now.actuator.delay -= 0.0019;
  EXPECT_FALSE(HasChanged(before, now));
  now.actuator.delay -= 0.0002;
  EXPECT_TRUE(HasChanged(before, now));
}

TEST(Learn, NoticesAWrongSignOfTheMotors) {
  const TempFolder folder;
  WatchedLink link(StrangeTwin());
  link.sign = -1;
  const LearnResult result = LearnOn(link, ConfigFor(2), folder.path());
  EXPECT_NE(result.reason.find("sign"), std::string::npos) << result.reason;
  EXPECT_EQ(result.tries, 0);
}

TEST(Learn, CountsTheComputingOfAFitThatFails) {
  const TempFolder folder;
  WatchedLink link(StrangeTwin());
  const LearnConfig config = ConfigFor(2);
  const auto fail_after_the_fit = [](const std::string& line) {
    if (line.starts_with("  error")) throw Failure("no such twin");
  };
  const LearnResult result =
      Learn(config, link, folder.path(), nullptr, fail_after_the_fit, [] { return false; });
  EXPECT_TRUE(result.reason.starts_with("no such twin")) << result.reason;
  EXPECT_EQ(result.tries, 0);
  EXPECT_GT(result.computing, 0);
}

TEST(Learn, StopsWhenAsked) {
  const TempFolder folder;
  WatchedLink link(StrangeTwin());
  const LearnResult result =
      LearnOn(link, ConfigFor(2), folder.path(), [&] { return link.Now() > 2; });
  EXPECT_EQ(result.reason, "stopped");
  EXPECT_FALSE(link.enabled());
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "log-01.csv"));
}

TEST(Learn, RefusesLimitsThatForbidASwingUp) {
  const auto error = [](LearnConfig config) {
    try {
      config.Check();
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  LearnConfig config = ConfigFor(2);
  EXPECT_EQ(error(config), "accepted");
  config.limits.angle = 3;
  EXPECT_EQ(error(config), "--max-angle: expected 3.5 or more for a swing-up, got 3");
  config = ConfigFor(2);
  config.limits.energy = 1;
  EXPECT_EQ(error(config), "--max-energy: expected 1.1 or more for a swing-up, got 1");
  config = ConfigFor(2);
  config.encoder_counts = 0;
  EXPECT_EQ(error(config), "machine learn: expected --encoder-counts, got none");
}

TEST(FirstTwin, RodsKeepTheEquationsOfMotion) {
  const Manipulator m = ManipulatorOf(StrangeTwin().plant);
  const Manipulator rods = ManipulatorOf(AsRods(StrangeTwin()).plant);
  for (const auto& [got, wanted] : {std::pair(rods.G1, m.G1),
                                    {rods.G2, m.G2},
                                    {rods.b, m.b},
                                    {rods.J2, m.J2},
                                    {rods.f1, m.f1}}) {
    EXPECT_NEAR(got, wanted, 1e-9 * wanted);
  }
}

/// More armature at joint 2 than joint 1 has with link 1: the rods keep J1, the second time, too.
TEST(FirstTwin, RodsKeepAGearedElbow) {
  Twin twin = StrangeTwin();
  twin.plant.actuated_joint = 2;
  twin.plant.armature1 = 0;
  const double J1 = ManipulatorOf(twin.plant).J1;
  twin.plant.armature = 2 * J1;
  for (int time = 0; time < 2; ++time) {
    twin = AsRods(twin);
    EXPECT_EQ(twin.plant.armature1, 0);
    EXPECT_NEAR(ManipulatorOf(twin.plant).J1, J1, 1e-9 * J1);
  }
}

TEST(FirstTwin, FindsTheEquationsOfMotion) {
  const Twin truth = StrangeTwin();
  Excitation excitation(
      5, 1, [](const PendulumState& s) { return std::abs(s.q1) / 1.5; }, 1);
  int64_t step = 0;
  double torque = 0;
  const MachineLog log =
      RunLoop(truth, {.seconds = 6, .actuated_joint = 1}, [&](const CycleInput& in) -> Joints {
        if (step++ % 10 == 0) {
          torque = excitation(step, {in.angle[0], in.angle[1], in.velocity[0], in.velocity[1]});
        }
        return {torque, 0};
      });
  Twin known;
  known.loop.period = 0.002;
  const Manipulator found = BodyOf(FirstTwin({&log, 1}, known)), m = BodyOf(truth);
  // The velocities are differences over 60 ms, so the values are some percent off.
  for (const auto& [got, wanted] : {std::pair(found.G1, m.G1),
                                    {found.G2, m.G2},
                                    {found.b, m.b},
                                    {found.J2, m.J2},
                                    {found.J1, m.J1}}) {
    EXPECT_NEAR(got, wanted, 0.2 * wanted);
  }
}

}  // namespace
}  // namespace upswing::machine

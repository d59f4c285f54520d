#include "extras/machine/twin/fit.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <map>

#include "base/rng.h"
#include "extras/machine/twin/simulated_machine.h"
#include "extras/machine/twin/validate.h"

namespace upswing::machine {
namespace {

/// A plant like that of RealAIGym's machine.
Twin FirstGuess() {
  Twin twin;
  twin.plant.mass1 = 0.52;
  twin.plant.mass2 = 0.63;
  twin.plant.length1 = 0.2;
  twin.plant.length2 = 0.3;
  twin.plant.center1 = 0.17;
  twin.plant.center2 = 0.26;
  twin.plant.inertia1 = 0.01;
  twin.plant.inertia2 = 0.008;
  twin.plant.armature = 0.004;
  twin.plant.damping1 = twin.plant.damping2 = 0.002;
  twin.plant.coulomb1 = 0.12;
  twin.plant.coulomb2 = 0.1;
  twin.plant.torque_limit = 6;
  twin.actuator.passive_limit = 0.5;
  return twin;
}

/// A machine whose values differ from the guess by up to 25%.
Twin SomeMachine(Rng& rng) {
  Twin twin = FirstGuess();
  Plant& p = twin.plant;
  for (double* value : {&p.center1, &p.center2, &p.inertia1, &p.inertia2, &p.armature, &p.damping1,
                        &p.damping2, &p.coulomb1, &p.coulomb2}) {
    *value *= rng.Uniform(0.75, 1.25);
  }
  twin.actuator.delay = rng.Uniform(0, 0.005);
  twin.actuator.lag = rng.Uniform(0.002, 0.008);
  twin.actuator.current_delay = rng.Uniform(0, 0.004);
  twin.actuator.current_inertia = rng.Uniform(0.001, 0.003);
  twin.sensors.zero1 = rng.Uniform(-0.03, 0.03);
  twin.sensors.zero2 = rng.Uniform(-0.03, 0.03);
  twin.sensors.quantum = 25.0 / 65535;
  twin.sensors.torque_quantum = 24.0 / 4095;
  twin.loop = {.period = 0.002, .jitter = 0.0001, .late_share = 0.02, .late = 0.004};
  return twin;
}

/// Logs with random multi-sine torques on both joints.
std::vector<MachineLog> LogsOf(const Twin& machine, int count, double seconds, uint64_t seed) {
  std::vector<MachineLog> logs;
  for (int i = 0; i < count; ++i) {
    Rng rng(seed, "log", static_cast<uint64_t>(i));
    std::array<std::array<double, 3>, 2> amplitude{}, frequency{}, phase{};
    for (int j = 0; j < 2; ++j) {
      for (int k = 0; k < 3; ++k) {
        amplitude[j][k] = rng.Uniform(0.3, 0.9) / (1 + j);
        frequency[j][k] = rng.Uniform(2, 12);
        phase[j][k] = rng.Uniform(0, 6);
      }
    }
    const CycleController torques = [&](const CycleInput& in) {
      Joints torque{};
      for (int j = 0; j < 2; ++j) {
        for (int k = 0; k < 3; ++k) {
          torque[j] += amplitude[j][k] * std::sin(frequency[j][k] * in.time + phase[j][k]);
        }
      }
      return torque;
    };
    logs.push_back(
        RunLoop(machine, {.seconds = seconds, .seed = seed + static_cast<uint64_t>(i)}, torques));
    logs.back().name = "log";
  }
  return logs;
}

const std::vector<std::string> kValues{"center1",         "center2",  "inertia1", "inertia2",
                                       "armature",        "damping1", "damping2", "coulomb1",
                                       "coulomb2",        "delay",    "lag",      "current_delay",
                                       "current_inertia", "zero1",    "zero2"};

double ValueOf(const Twin& twin, const std::string& name) {
  const Options options = OptionsOf(twin);
  return options.Get(name)->number();
}

/// Windows that do not overlap: half as many, from the same rows.
const FitConfig kWindowsInARow{.windows = {1, 1}};

/// UPSWING_DRAWS sets the number of machines. With it, each has 12 logs of 10 s instead of 3 of 5
/// s, whose intervals are wide.
TEST(Fit, FindsTheMachineBehindItsLogs) {
  const char* given = std::getenv("UPSWING_DRAWS");
  const int draws = given != nullptr ? std::atoi(given) : 2;
  ThreadPool pool(2);
  std::map<std::string, std::vector<double>> errors;
  std::map<std::string, int> covered;
  for (int draw = 0; draw < draws; ++draw) {
    Rng rng(7, "machine", static_cast<uint64_t>(draw));
    const Twin machine = SomeMachine(rng);
    const uint64_t seed = 100 + 10 * static_cast<uint64_t>(draw);
    const auto logs =
        given != nullptr ? LogsOf(machine, 12, 10, seed) : LogsOf(machine, 3, 5, seed);
    const FitResult fit =
        Fit(logs, FirstGuess(), {"", kValues, {"coulomb1", "coulomb2", "zero1", "zero2"}},
            kWindowsInARow, &pool);
    const Manipulator truth = BodyOf(machine), found = BodyOf(fit.twin);
    const auto note = [&](const char* name, double got, double true_value) {
      errors[name].push_back(got / true_value - 1);
    };
    note("J1", found.J1, truth.J1);
    note("J2", found.J2, truth.J2);
    note("b", found.b, truth.b);
    note("a", found.a, truth.a);
    note("G1", found.G1, truth.G1);
    note("G2", found.G2, truth.G2);
    note("coulomb1", found.f1, truth.f1);
    note("coulomb2", found.f2, truth.f2);
    if (given != nullptr) {
      std::printf("%d delay %+.5f lag %+.5f current delay %+.5f\n", draw,
                  fit.twin.actuator.delay - machine.actuator.delay,
                  fit.twin.actuator.lag - machine.actuator.lag,
                  fit.twin.actuator.current_delay - machine.actuator.current_delay);
      std::fflush(stdout);
    }
    errors["delay, s"].push_back(fit.twin.actuator.delay - machine.actuator.delay);
    const size_t n = fit.twin.uncertain.size();
    for (size_t i = 0; i < n; ++i) {
      const std::string& name = fit.twin.uncertain[i];
      const double deviation = std::sqrt(fit.twin.covariance[i * n + i]);
      const double error = ValueOf(fit.twin, name) - ValueOf(machine, name);
      covered[name] += std::abs(error) <= 1.96 * deviation ? 1 : 0;
      if (name == "center1") {
        EXPECT_LT(deviation, 0.1 * machine.plant.center1);
      }
    }
  }
  double all = 0;
  for (const auto& [name, list] : errors) {
    const double limit = name == "delay, s" ? 0.0005 : name.starts_with("coulomb") ? 0.05 : 0.02;
    double worst = 0;
    for (const double error : list) worst = std::max(worst, std::abs(error));
    EXPECT_LE(worst, limit) << name;
    if (given != nullptr) std::printf("%-12s largest error %.5f\n", name.c_str(), worst);
  }
  for (const auto& [name, count] : covered) {
    all += count;
    if (given != nullptr) std::printf("%-16s %d of %d covered\n", name.c_str(), count, draws);
  }
  const double share = all / (draws * static_cast<double>(covered.size()));
  if (given != nullptr) std::printf("covered %.3f\n", share);
  EXPECT_GE(share, 0.9);
}

/// A log of a simulation has the torque of a row act from its time on, a cycle before that of a
/// machine's log. In a slow loop such a delay is long. All logs are of one session, so the
/// machine's values are that session's.
TEST(Fit, FindsTheDelayOfASlowLoop) {
  ThreadPool pool(2);
  Rng rng(19, "slow loop");
  Twin machine = SomeMachine(rng);
  machine.sensors.quantum = 1e-8;
  machine.sensors.zero1 = machine.sensors.zero2 = 0;
  machine.loop = {.period = 0.02};
  machine.actuator.delay = -0.02;
  machine.actuator.lag = 0;
  std::vector<MachineLog> logs = LogsOf(machine, 2, 5, 600);
  for (MachineLog& log : logs) log.measured.clear();
  Structure structure{"", kValues, {"coulomb1", "coulomb2", "zero1", "zero2"}};
  std::erase_if(structure.values, [](const auto& name) { return name.starts_with("current"); });
  const FitResult fit = Fit(logs, FirstGuess(), structure, kWindowsInARow, &pool);
  EXPECT_NEAR(fit.twin.actuator.delay + fit.twin.actuator.lag, -0.02, 0.001);
  for (const std::string name : {"center1", "center2", "inertia1", "inertia2", "armature",
                                 "damping1", "damping2", "coulomb1", "coulomb2"}) {
    EXPECT_NEAR(ValueOf(fit.twin, name) / ValueOf(machine, name), 1, 0.01) << name;
  }
  ASSERT_EQ(fit.twin.sessions.size(), 1u);
  for (const auto& [setting, number] : fit.twin.sessions.front().values) {
    EXPECT_NEAR(number, ValueOf(fit.twin, setting), 1e-12) << setting;
  }
}

/// Half of the machines have offsets. The fit finds them, and finds none for the others.
TEST(Fit, FindsTheTorqueOffsetsOfTheMotors) {
  constexpr int kMachines = 20;
  ThreadPool pool(2);
  Structure structure{"", kValues};
  structure.values.insert(structure.values.end(), {"torque_offset1", "torque_offset2"});
  int covered = 0;
  std::vector<double> errors;
  for (int i = 0; i < kMachines; ++i) {
    Rng rng(21, "offset", static_cast<uint64_t>(i));
    Twin machine = SomeMachine(rng);
    const double size = i % 2 == 0 ? 0.2 : 0;
    machine.actuator.torque_offset1 = size * rng.Uniform(-1, 1);
    machine.actuator.torque_offset2 = size * rng.Uniform(-1, 1);
    const auto logs = LogsOf(machine, 2, 4, 500 + 10 * static_cast<uint64_t>(i));
    const FitConfig config{.windows = {1, 1}, .iterations = 20, .tolerance = 1e-4};
    const Twin found = Fit(logs, FirstGuess(), structure, config, &pool).twin;
    for (const char* name : {"torque_offset1", "torque_offset2"}) {
      const double deviation = std::sqrt(CovarianceOf(found, name, name));
      errors.push_back(std::abs(ValueOf(found, name) - ValueOf(machine, name)));
      // Links that move little hardly tell an offset from a zero.
      EXPECT_LT(errors.back(), 4 * deviation) << i << name;
      covered += errors.back() < 2 * deviation ? 1 : 0;
    }
  }
  EXPECT_LT(Median(errors), 0.01);
  EXPECT_GE(covered, 0.8 * 2 * kMachines);
}

/// Torques of up to 0.06 N·m at harmonics that are close to each other.
TEST(Fit, FindsTheCoggingOfTheMotors) {
  ThreadPool pool(2);
  Rng rng(11, "cogging");
  Twin machine = SomeMachine(rng);
  machine.cogging.slots = 12;
  machine.cogging.poles = 14;
  for (auto& coefficients : machine.cogging.coefficients) {
    for (double& c : coefficients) c = rng.Uniform(-0.06, 0.06);
  }
  const std::vector<MachineLog> logs = LogsOf(machine, 4, 5, 300),
                                later = LogsOf(machine, 1, 5, 400);
  Twin guess = FirstGuess();
  Structure structure{"without", kValues};
  const Twin without = Fit(logs, guess, structure, kWindowsInARow, &pool).twin;
  guess.cogging.slots = 12;
  guess.cogging.poles = 14;
  const std::vector<std::string> coefficients = CoggingCoefficients();
  structure.values.insert(structure.values.end(), coefficients.begin(), coefficients.end());
  const Twin with = Fit(logs, guess, structure, kWindowsInARow, &pool).twin;
  double squares = 0;
  for (const std::string& name : coefficients) {
    const double error = ValueOf(with, name) - ValueOf(machine, name);
    EXPECT_LT(std::abs(error), 5 * std::sqrt(CovarianceOf(with, name, name)) + 0.003) << name;
    squares += error * error;
  }
  EXPECT_LT(std::sqrt(squares / std::ssize(coefficients)), 0.01);
  const auto error = [&](const Twin& twin) {
    return Median(WindowErrors(later.front(), twin, 1, /*reported=*/false));
  };
  EXPECT_LT(error(with), error(without) / 4);
}

/// The machine of today has other zeros, friction and lag. A log of 5 s shows them.
TEST(Fit, AdaptsATwinToANewSession) {
  ThreadPool pool(2);
  Rng rng(3, "machine");
  const Twin machine = SomeMachine(rng);
  Twin today = machine;
  today.sensors.zero1 += 0.04;
  today.sensors.zero2 -= 0.03;
  today.plant.coulomb1 += 0.03;
  today.actuator.lag += 0.001;
  const auto logs = LogsOf(today, 1, 5, 40), later = LogsOf(today, 1, 5, 60);
  Twin prior = machine;
  prior.uncertain = {"zero1", "coulomb1"};
  prior.covariance = {1e-3, 0, 0, 1e-3};
  const Structure structure{"", kValues};
  const auto error = [&](const Twin& twin) {
    return Median(WindowErrors(later.front(), twin, 1, false));
  };
  for (const Twin& first : {prior, FirstGuess()}) {
    FitConfig config = kWindowsInARow;
    config.adapts = true;
    const Twin found = Fit(logs, first, structure, config, &pool).twin;
    EXPECT_LT(error(found), 0.2 * error(first));
    EXPECT_NEAR(found.sensors.zero1, today.sensors.zero1, 0.005);
    EXPECT_NEAR(found.plant.coulomb1, today.plant.coulomb1, 0.01);
    EXPECT_EQ(found.covariance.size(), kValues.size() * kValues.size());
    EXPECT_TRUE(found.sessions.empty());
  }
}

/// Fits the zeros of sessions whose second zero is the opposite of the first (rad).
std::vector<double> CovarianceOfZeros(const std::vector<double>& zeros) {
  std::vector<MachineLog> logs;
  for (const double zero : zeros) {
    Twin machine = FirstGuess();
    machine.sensors.zero1 = zero;
    machine.sensors.zero2 = -zero;
    logs.push_back(LogsOf(machine, 1, 3, 50 + logs.size()).front());
    logs.back().name = std::string("session ") + "abcd"[logs.size() - 1];
  }
  ThreadPool pool(2);
  return Fit(logs, FirstGuess(), {"", {"zero1", "zero2"}, {"zero1", "zero2"}}, kWindowsInARow,
             &pool)
      .twin.covariance;
}

/// The first assumption counts as a session. A new session differs from the mean of the known ones,
/// which is uncertain itself.
TEST(Fit, EstimatesTheCovarianceBetweenSessions) {
  constexpr double kFirst = 0.05 * 0.05;
  const std::vector<double> one = CovarianceOfZeros({0.02});
  EXPECT_NEAR(one[0], 2 * kFirst, 0.1 * kFirst);
  EXPECT_NEAR(one[1], 0, 0.1 * kFirst);
  const std::vector<double> four = CovarianceOfZeros({-0.06, -0.02, 0.02, 0.06});
  constexpr double kSquares = 2 * (0.06 * 0.06 + 0.02 * 0.02);
  constexpr double kMean = 1.0 / 4;
  EXPECT_NEAR(four[0], (1 + kMean) * (kFirst + kSquares) / 4, 0.1e-3);
  EXPECT_NEAR(four[3], (1 + kMean) * (kFirst + kSquares) / 4, 0.1e-3);
  EXPECT_NEAR(four[1], -(1 + kMean) * kSquares / 4, 0.1e-3);
}

/// Simulation, prediction and fit give the times of the motors the same meaning and sign.
TEST(Fit, FindsTheTimesOfTheMotorsAndPredictsWithThemBest) {
  ThreadPool pool(2);
  for (const double delay : {-0.004, -0.002, -0.001, 0.0, 0.002, 0.004}) {
    Twin machine = FirstGuess();
    machine.loop = {.period = 0.005, .jitter = 0.0002};
    machine.actuator = {.delay = delay,
                        .lag = 0.004,
                        .passive_limit = 6,
                        .current_delay = 0.001 - delay / 2,
                        .current_inertia = 0.002};
    const std::vector<MachineLog> logs = LogsOf(machine, 1, 3, 20);
    Twin first = machine;
    first.actuator = {.passive_limit = 6, .current_inertia = 0.002};
    const Actuator found =
        Fit(logs, first, {"", {"delay", "lag", "current_delay"}}, {}, &pool).twin.actuator;
    EXPECT_NEAR(found.delay, delay, 1e-4);
    EXPECT_NEAR(found.lag, machine.actuator.lag, 1e-4);
    EXPECT_NEAR(found.current_delay, machine.actuator.current_delay, 1e-4);
    const auto error = [&](double more) {
      Twin other = machine;
      other.actuator.delay += more;
      return Median(WindowErrors(logs.front(), other, 0.5, false));
    };
    for (const double more : {-0.002, -0.001, 0.001, 0.002}) {
      EXPECT_LT(error(0), 0.1 * error(more)) << delay;
    }
  }
}

TEST(Fit, AJointWithoutReportedTorqueLeavesTheReportsUnknown) {
  ThreadPool pool(2);
  Twin machine = FirstGuess();
  machine.actuator = {.delay = 0.002,
                      .lag = 0.004,
                      .passive_limit = 6,
                      .current_delay = 0.002,
                      .current_inertia = 0.0025};
  std::vector<MachineLog> logs = LogsOf(machine, 1, 3, 20);
  for (Joints& torque : logs.front().measured) torque[1] = 0;  // as a log without the column
  Twin first = machine;
  first.actuator.current_delay = first.actuator.current_inertia = 0.001;
  const Actuator found =
      Fit(logs, first, {"", {"current_delay", "current_inertia"}}, {}, &pool).twin.actuator;
  EXPECT_NEAR(found.current_delay, machine.actuator.current_delay, 1e-4);
  EXPECT_NEAR(found.current_inertia, machine.actuator.current_inertia, 5e-5);
}

}  // namespace
}  // namespace upswing::machine

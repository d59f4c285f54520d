#include "pendulum/timestep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "base/error.h"
#include "pendulum/runge_kutta.h"
#include "pendulum/testing.h"

namespace upswing {
namespace {

std::string ProblemOf(const Plant& plant, double h = kPhysicsTimestep) {
  try {
    CheckTimestep(plant, "plant", h);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// A random number from low to high, uniform on a logarithmic scale.
double Spread(double low, double high, Rng& rng) {
  return low * std::exp(std::log(high / low) * rng.Uniform());
}

/// Energy over that of hanging at rest, J.
double EnergyOf(const Manipulator& body, const PendulumState& s) {
  return body.At(s).energy + 2 * (body.G1 + body.G2);
}

/// Whether the energy of a motion without torque grows by a tenth within 2 s. True motions lose
/// energy.
bool GainsEnergy(const Manipulator& body, PendulumState s, double h) {
  const auto acceleration = [&](const PendulumState& at, double /*share*/) {
    return body.Acceleration(at, {0, 0});
  };
  const double most = 1.1 * EnergyOf(body, s);
  for (double t = 0; t < 2; t += h) {
    s = RungeKuttaStep(s, acceleration(s, 0), h, acceleration);
    if (!(EnergyOf(body, s) < most)) return true;
  }
  return false;
}

/// Whether this happens from some state near stretched, folded or elsewhere.
bool IsUnstable(const Plant& plant, double h, Rng rng) {
  const Manipulator body = ManipulatorOf(plant);
  for (int start = 0; start < 12; ++start) {
    const auto near = [&](double angle) { return angle + rng.Uniform(-0.1, 0.1); };
    PendulumState s{near(start % 4 < 2 ? 0 : kPi), near(start % 2 == 0 ? 0 : kPi),
                    rng.Uniform(-1, 1), rng.Uniform(-1, 1)};
    if (start >= 8) s.q1 = rng.Uniform(-kPi, kPi);
    if (start >= 8) s.q2 = rng.Uniform(-kPi, kPi);
    if (GainsEnergy(body, s, h)) return true;
  }
  return false;
}

int StepsFor(const Plant& plant, const Randomization& random = {}) {
  return PhysicsStepsFor(plant, random, kControlPeriod, "plant");
}

TEST(Timestep, ThePlantsOfTheProgramHaveTheUsualSteps) {
  Randomization box;
  EXPECT_EQ(StepsFor(Plant()), kPhysicsSteps);
  box.plant.fill(0.25);
  EXPECT_EQ(StepsFor(Plant(), box), kPhysicsSteps);
  // The machine of RealAIGym: much dry friction on light links.
  Plant machine;
  machine.mass1 = 0.52;
  machine.mass2 = 0.63;
  machine.length1 = 0.2;
  machine.length2 = 0.3;
  machine.center1 = 0.2;
  machine.center2 = 0.256;
  machine.inertia1 = 0.011;
  machine.inertia2 = 0.00997;
  machine.armature = 0.00264;
  machine.damping1 = machine.damping2 = 0.001;
  machine.coulomb1 = 0.16;
  machine.coulomb2 = 0.12;
  EXPECT_EQ(StepsFor(machine), kPhysicsSteps);
}

TEST(Timestep, StrongFrictionOnALightLinkHasShorterSteps) {
  Plant light;
  light.mass2 = 0.05;
  light.length2 = 0.2;
  light.damping2 = 0.5;
  light.armature = 1e-4;
  EXPECT_NE(ProblemOf(light), "");
  EXPECT_TRUE(IsUnstable(light, kPhysicsTimestep, Rng(1, "test")));
  EXPECT_EQ(StepsFor(light), 16);
  EXPECT_FALSE(IsUnstable(light, kControlPeriod / 16, Rng(1, "test")));
  light.damping2 = 0.01;
  EXPECT_EQ(StepsFor(light), kPhysicsSteps);
  // Dry friction counts, and the worst corner of a box.
  light.coulomb2 = 0.5;
  EXPECT_GT(StepsFor(light), kPhysicsSteps);
  Plant damped;
  damped.damping2 = 4;
  EXPECT_EQ(StepsFor(damped), kPhysicsSteps);
  Randomization box;
  box.plant.fill(0.9);
  EXPECT_GT(StepsFor(damped, box), kPhysicsSteps);
}

TEST(Timestep, APlantThatIsTooStiffIsRefusedWithTheNumberThatIsWrong) {
  Plant stiff;
  stiff.damping2 = 1e5;
  try {
    (void)StepsFor(stiff);
    FAIL();
  } catch (const Error& error) {
    const std::string problem = error.what();
    EXPECT_TRUE(
        problem.starts_with("plant: expected friction that stops the joints at a rate of "
                            "at most 51200/s, because time steps of "))
        << problem;
    EXPECT_NE(problem.find("/s: damping2 = 100000 N·m·s/rad and coulomb2 = 0 N·m act on "),
              std::string::npos)
        << problem;
  }
}

TEST(Timestep, StepsFollowTheSizeOfThePlantAndThePeriod) {
  // Links of a tenth of the length swing in 0.3 of the time.
  for (const auto& [length, steps] : {std::pair(0.5, 4), {0.25, 4}, {0.05, 8}, {5.0, 4}}) {
    Plant sized;
    sized.armature = 0;
    sized.damping1 = sized.damping2 = 0;
    sized.length1 = sized.length2 = length;
    EXPECT_EQ(StepsFor(sized), steps) << length;
  }
  for (const auto& [period, steps] : {std::pair(0.001, 1), {0.005, 1}, {0.01, 2}, {0.1, 16}}) {
    EXPECT_EQ(PhysicsStepsFor(Plant(), period, "plant"), steps) << period;
  }
}

/// The state after `periods` control periods of `steps` Runge-Kutta steps each, without torque.
PendulumState After(const Manipulator& body, PendulumState s, int periods, int steps) {
  const double h = kControlPeriod / steps;
  const auto acceleration = [&](const PendulumState& at, double /*share*/) {
    return body.Acceleration(at, {0, 0});
  };
  for (int i = 0; i < periods * steps; ++i) {
    s = RungeKuttaStep(s, acceleration(s, 0), h, acceleration);
  }
  return s;
}

TEST(Timestep, StepsAreShortEnoughOverNineDecadesOfFriction) {
  Rng rng(1, "test");
  int refused = 0;
  double largest = 0;  // error of an angle, rad
  for (int n = 0; n < 1000; ++n) {
    Plant plant;
    plant.mass1 = Spread(0.01, 10, rng);
    plant.mass2 = Spread(0.01, 10, rng);
    plant.length1 = Spread(0.1, 1, rng);
    plant.length2 = Spread(0.1, 1, rng);
    plant.damping1 = Spread(1e-6, 1e3, rng);
    plant.damping2 = Spread(1e-6, 1e3, rng);
    plant.armature = Spread(1e-5, 0.1, rng);
    int steps = 0;
    try {
      steps = StepsFor(plant);
    } catch (const Error&) {
      ++refused;
      continue;
    }
    const Manipulator body = ManipulatorOf(plant);
    const PendulumState start{rng.Uniform(-kPi, kPi), rng.Uniform(-kPi, kPi), 0, 0};
    const PendulumState got = After(body, start, 10, steps);
    // The reference has steps of at most 0.1 ms, and a fourth-order error of 1/256 of the other.
    const PendulumState truth = After(body, start, 10, std::max(200, 4 * steps));
    largest = std::max({largest, std::abs(got.q1 - truth.q1), std::abs(got.q2 - truth.q2)});
  }
  EXPECT_LT(refused, 200);
  EXPECT_LT(largest, 2e-4) << refused;
}

TEST(Timestep, RefusalAndNonsenseCoincide) {
  // Near the limit, the start decides whether a plant blows up within 2 s.
  Rng rng(1, "test");
  int refused = 0, unstable = 0, wrong = 0;
  for (int n = 0; n < 300; ++n) {
    Plant plant;
    plant.mass1 = Spread(0.05, 5, rng);
    plant.mass2 = Spread(0.05, 5, rng);
    plant.length1 = Spread(0.1, 1, rng);
    plant.length2 = Spread(0.1, 1, rng);
    plant.damping1 = Spread(1e-3, 5, rng);
    plant.damping2 = Spread(1e-3, 5, rng);
    plant.gravity = Spread(1, 30, rng);
    plant.armature = Spread(1e-5, 0.1, rng);
    const bool is_refused = !ProblemOf(plant).empty();
    const bool is_unstable = IsUnstable(plant, kPhysicsTimestep, rng);
    refused += is_refused ? 1 : 0;
    unstable += is_unstable ? 1 : 0;
    if (is_refused == is_unstable) continue;
    ++wrong;
    const double decay = FastestDecayOf(ManipulatorOf(plant)).rate * kPhysicsTimestep;
    EXPECT_NEAR(decay, 2.785, 0.03) << n;
  }
  EXPECT_GT(refused, 15);
  EXPECT_GT(unstable, 15);
  EXPECT_LE(wrong, 2);
}

}  // namespace
}  // namespace upswing

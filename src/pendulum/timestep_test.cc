#include "pendulum/timestep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "base/error.h"
#include "pendulum/runge_kutta.h"
#include "pendulum/testing.h"

namespace upswing {
namespace {

std::string ProblemOf(const Plant& plant, const Randomization& random = {}) {
  try {
    CheckTimestep(plant, random, "plant");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
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

TEST(Timestep, ThePlantsOfTheProgramAreStable) {
  Randomization box;
  box.plant.fill(0.25);
  EXPECT_EQ(ProblemOf(Plant(), box), "");
  box.plant.fill(0.9);
  EXPECT_EQ(ProblemOf(Plant(), box), "");
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
  box.plant.fill(0.25);
  EXPECT_EQ(ProblemOf(machine, box), "");
}

TEST(Timestep, APlantIsRefusedWithTheNumberThatIsWrong) {
  Plant light;
  light.mass2 = 0.05;
  light.length2 = 0.2;
  light.damping2 = 0.5;
  light.armature = 1e-4;
  const std::string problem = ProblemOf(light);
  EXPECT_TRUE(
      problem.starts_with("plant: expected friction that stops the joints at a rate of at "
                          "most 557/s, because time steps of 0.005 s are unstable beyond "
                          "it, got "))
      << problem;
  EXPECT_NE(problem.find("/s: damping2 = 0.5 N·m·s/rad and coulomb2 = 0 N·m act on "),
            std::string::npos)
      << problem;
  EXPECT_TRUE(IsUnstable(light, kPhysicsTimestep, Rng(1, "test")));
  light.damping2 = 0.01;
  EXPECT_EQ(ProblemOf(light), "");
  // Dry friction counts, and the worst corner of a box.
  light.coulomb2 = 0.5;
  EXPECT_NE(ProblemOf(light).find("coulomb2 = 0.5"), std::string::npos);
  Plant damped;
  damped.damping2 = 12;
  EXPECT_EQ(ProblemOf(damped), "");
  Randomization box;
  box.plant.fill(0.9);
  EXPECT_NE(ProblemOf(damped, box), "");
  EXPECT_THROW(CheckTimestep(damped, "plant", 0.05), Error);
}

TEST(Timestep, RefusalAndNonsenseCoincide) {
  // Near the limit, the start decides whether a plant blows up within 2 s.
  Rng rng(1, "test");
  int refused = 0, unstable = 0, wrong = 0;
  for (int n = 0; n < 300; ++n) {
    const auto spread = [&](double low, double high) {
      return low * std::exp(std::log(high / low) * rng.Uniform());
    };
    Plant plant;
    plant.mass1 = spread(0.05, 5);
    plant.mass2 = spread(0.05, 5);
    plant.length1 = spread(0.1, 1);
    plant.length2 = spread(0.1, 1);
    plant.damping1 = spread(1e-3, 5);
    plant.damping2 = spread(1e-3, 5);
    plant.gravity = spread(1, 30);
    plant.armature = spread(1e-5, 0.1);
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

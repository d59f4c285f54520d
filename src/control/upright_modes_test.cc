#include "pendulum/upright_modes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "base/rng.h"
#include "control/linearize.h"
#include "control/testing.h"
#include "pendulum/randomization.h"

namespace upswing {
namespace {

TEST(UprightModes, AreEigenvaluesOfTheLinearModel) {
  Randomization box;
  box.plant.fill(0.5);
  Rng rng(1, "test");
  for (int n = 0; n < 1000; ++n) {
    Plant plant = box.Draw(Plant(), rng);
    plant.actuated_joint = n % 2 + 1;
    const UprightModes modes = ModesOf(plant);
    std::array<double, 4> rates;
    const auto eigenvalues = EigenSolver(LinearizeUpright(plant).A, false).eigenvalues();
    for (size_t i = 0; i < 4; ++i) rates[i] = eigenvalues[static_cast<Eigen::Index>(i)].real();
    std::ranges::sort(rates, std::greater<>());
    EXPECT_NEAR(modes.faster, rates[0], 1e-9);
    EXPECT_NEAR(modes.slower, rates[1], 1e-9);
  }
}

TEST(UprightModes, DeltaIsZeroWhereTheMotorLosesAMode) {
  // If δ is 0, the linear model gives a left eigenvector of a growing mode that the motor does not
  // reach. The motor's share of it changes sign there, so bisection over the damping finds the
  // plant.
  for (const int joint : {1, 2}) {
    const auto with_damping = [&](double damping) {
      Plant plant;
      plant.actuated_joint = joint;
      (joint == 1 ? plant.damping2 : plant.damping1) = damping;
      return plant;
    };
    double low = 0.01, high = 1;
    const bool sign = ModesOf(with_damping(low)).delta > 0;
    ASSERT_NE(ModesOf(with_damping(high)).delta > 0, sign);
    for (int halving = 0; halving < 50; ++halving) {
      const double middle = (low + high) / 2;
      ((ModesOf(with_damping(middle)).delta > 0) == sign ? low : high) = middle;
    }
    const auto least_reach = [](const Plant& plant) {
      const LinearModel model = LinearizeUpright(plant);
      const EigenSolver modes(model.A.transpose());
      double least = 1;
      for (int i = 0; i < 4; ++i) {
        if (modes.eigenvalues()[i].real() <= 0) continue;
        const Eigen::Vector4d left = modes.eigenvectors().col(i).real().normalized();
        least = std::min(least, std::abs(left.dot(model.B)));
      }
      return least;
    };
    EXPECT_LT(least_reach(with_damping(low)), 1e-9);
    EXPECT_GT(least_reach(with_damping(low / 2)), 1e-3);
  }
}

}  // namespace
}  // namespace upswing

#include "pendulum/regressor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/rng.h"
#include "pendulum/testing.h"

namespace upswing {
namespace {

double Dot(const std::array<double, kNumManipulatorConstants>& factors, const Manipulator& p) {
  double sum = 0;
  for (size_t k = 0; k < factors.size(); ++k) sum += factors[k] * (p.*kManipulatorConstants[k]);
  return sum;
}

PendulumState RandomMotion(Rng& rng) {
  return {rng.Uniform(-3, 3), rng.Uniform(-3, 3), rng.Uniform(-5, 5), rng.Uniform(-5, 5)};
}

TEST(Regressor, TimesTheConstantsIsTheTorque) {
  Rng rng(1, "plants");
  for (int trial = 0; trial < 200; ++trial) {
    const Manipulator m = ManipulatorOf(RandomMachine(rng));
    const PendulumState s = RandomMotion(rng);
    const std::array<double, 2> tau{rng.Uniform(-5, 5), rng.Uniform(-5, 5)};
    const auto a = m.Acceleration(s, tau);
    const auto angles = dynamics::AnglesOf<double>({s.q1, s.q2});
    const Factors Y = Regressor(angles, {s.w1, s.w2}, {a[0], a[1]});
    for (const size_t j : {0, 1}) {
      double largest = 1;
      for (size_t k = 0; k < Y[j].size(); ++k) {
        largest = std::max(largest, std::abs(Y[j][k] * (m.*kManipulatorConstants[k])));
      }
      EXPECT_NEAR(Dot(Y[j], m), tau[j], 1e-13 * largest) << trial << ", joint " << j + 1;
    }
  }
}

TEST(Regressor, MomentumChangesByTheTorqueWithoutTheForce) {
  Rng rng(2, "plants");
  for (int trial = 0; trial < 200; ++trial) {
    const PendulumState s = RandomMotion(rng);
    const dynamics::JointPair<double> a{rng.Uniform(-20, 20), rng.Uniform(-20, 20)};
    const auto at = [&](double t) {
      return MomentumRegressorOf(dynamics::AnglesOf<double>({s.q1 + t * s.w1, s.q2 + t * s.w2}),
                                 {s.w1 + t * a.one, s.w2 + t * a.two});
    };
    constexpr double h = 1e-5;
    const Factors Y = Regressor(dynamics::AnglesOf<double>({s.q1, s.q2}), {s.w1, s.w2}, a);
    const auto now = at(0), later = at(h), before = at(-h);
    for (const size_t j : {0, 1}) {
      for (size_t k = 0; k < Y[j].size() - 2; ++k) {  // without dry friction
        const double change = (later.momentum[j][k] - before.momentum[j][k]) / (2 * h);
        // Third derivatives are some 10³; h² of them, and rounding of 1e-16 / h, are below 1e-6.
        EXPECT_NEAR(change + now.force[j][k], Y[j][k], 1e-6) << trial << ", constant " << k;
      }
    }
  }
}

}  // namespace
}  // namespace upswing

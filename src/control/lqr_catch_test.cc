#include "control/lqr_catch.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "control/testing.h"

namespace upswing {
namespace {

/// Whether the limited regulator brings the plant to rest upright within 10 s.
bool Caught(const Lqr& lqr, const StateVector& deviation, PendulumModel& model) {
  StateVector x = FromUpright(deviation);
  for (int step = 0; step < 500; ++step) {
    const double limit = model.plant().torque_limit;
    const double u = std::clamp(lqr.Torque(UprightDeviation(x)), -limit, limit);
    model.Step({&x, 1}, {&u, 1});
  }
  return UprightDeviation(x).norm() < 1e-6;
}

TEST(LqrCatch, CatchesAllOfItsRegion) {
  Plant heavy;
  heavy.mass2 = 1.25;
  for (const Plant& plant : {Plant(), heavy}) {
    const LqrCatch upright(LqrConfig(), plant);
    const Eigen::Matrix4d shape = SymmetricEigenSolver(upright.lqr().P).operatorInverseSqrt();
    PendulumModel model(plant);
    Rng rng(7, "inside");
    int caught_beyond = 0;
    for (int trial = 0; trial < 300; ++trial) {
      Eigen::Vector4d d(rng.Normal(), rng.Normal(), rng.Normal(), rng.Normal());
      d = shape * d.normalized() * std::sqrt(upright.region());
      EXPECT_TRUE(Caught(upright.lqr(), rng.Uniform() * d, model));
      if (Caught(upright.lqr(), 3 * d, model)) ++caught_beyond;
    }
    EXPECT_LT(caught_beyond, 290);  // at nine times the level, some are not caught
  }
}

TEST(LqrCatch, AgreesWithALongerSimulation) {
  const Plant plant;
  const LqrCatch upright(LqrConfig(), plant);
  PendulumModel model(plant);
  Rng rng(8, "states");
  int held = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const StateVector d(rng.Normal() * 0.15, rng.Normal() * 0.15, rng.Normal() * 0.5,
                        rng.Normal() * 0.5);
    if (!upright.Holds(d)) continue;
    ++held;
    EXPECT_TRUE(Caught(upright.lqr(), d, model));
  }
  EXPECT_GT(held, 50);
  EXPECT_LT(held, 1500);
  EXPECT_FALSE(upright.Holds(StateVector(3, 0, 0, 0)));
}

}  // namespace
}  // namespace upswing

#include "control/upright_modes.h"

#include <gtest/gtest.h>

#include "core/rng.h"
#include "sim/identification.h"
#include "sim/randomization.h"

namespace upswing {
namespace {

TEST(UprightModes, AreThoseThatIdentificationFinds) {
  // Here eigenvalues of a matrix, there roots of a polynomial.
  Randomization box;
  box.plant.fill(0.5);
  Rng rng(1, "test");
  for (int n = 0; n < 1000; ++n) {
    Plant plant = box.Draw(Plant(), rng);
    plant.actuated_joint = n % 2 + 1;
    const UprightModes modes = ModesOf(plant);
    const Falling falling = FallingOf(ConstantsOf(plant), plant, {});
    EXPECT_NEAR(falling.rate[0], modes.faster, 1e-9);
    EXPECT_NEAR(falling.rate[1], modes.slower, 1e-9);
    EXPECT_NEAR(falling.delta, modes.delta, 1e-12);
  }
}

}  // namespace
}  // namespace upswing

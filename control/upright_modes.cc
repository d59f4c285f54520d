#include "control/upright_modes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <functional>

#include "control/linearize.h"
#include "sim/identification.h"

namespace upswing {

UprightModes ModesOf(const Plant& plant) {
  UprightModes modes;
  std::array<double, 4> rates;  // real: friction and gravity alone make no oscillation upright
  const Eigen::MatrixXd A = LinearizeUpright(plant).A;
  const Eigen::VectorXcd eigenvalues = A.eigenvalues();
  for (int i = 0; i < 4; ++i) rates[static_cast<size_t>(i)] = eigenvalues[i].real();
  std::ranges::sort(rates, std::greater<>());
  modes.faster = rates[0];
  modes.slower = rates[1];
  modes.decay = -rates[3];

  const PassiveJoint passive =
      PassiveJointOf(ManipulatorOf(plant), static_cast<int>(plant.actuated_joint));
  modes.pole = passive.pole;
  modes.delta = passive.delta;
  return modes;
}

}  // namespace upswing

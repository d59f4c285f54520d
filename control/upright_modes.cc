#include "control/upright_modes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "control/linearize.h"
#include "sim/closed_form.h"

namespace upswing {

UprightModes ModesOf(const Plant& plant) {
  ClosedFormBatch batch(1);
  batch.SetPlant(0, plant);
  UprightModes modes;
  std::array<double, 4> rates;  // real: friction and gravity alone make no oscillation upright
  const Eigen::Vector4cd eigenvalues = LinearizeUpright(plant).A.eigenvalues();
  for (int i = 0; i < 4; ++i) rates[static_cast<size_t>(i)] = eigenvalues[i].real();
  std::ranges::sort(rates, std::greater<>());
  modes.faster = rates[0];
  modes.slower = rates[1];
  modes.decay = -rates[3];

  if (plant.actuated_joint == 2) {
    // Of joint 1, under no torque: M11 q̈1 + d1 q̇1 - (G1 + G2) q1 = -(M12 q̈2 - G2 q2). Both sides
    // are 0 for one rate where pole and zero are the same: then no torque reaches that mode.
    const double M11 = batch.J1[0] + batch.J2[0] + 2 * batch.b[0];
    const double M12 = batch.J2[0] + batch.b[0];
    const double fall = batch.G1[0] + batch.G2[0], d1 = batch.d1[0];
    modes.pole = (std::sqrt(d1 * d1 + 4 * M11 * fall) - d1) / (2 * M11);
    const double zero = std::sqrt(batch.G2[0] / M12);
    modes.delta = (zero - modes.pole) / (zero + modes.pole);
    return modes;
  }

  // Of link 2 in absolute angles φ1, φ2: n12 φ̈1 + n22 φ̈2 + d2 (φ̇2 - φ̇1) = G2 φ2.
  const double n12 = batch.b[0] - kArmature, n22 = batch.J2[0] + kArmature;
  const double G2 = batch.G2[0], d2 = batch.d2[0];
  // Its zero is z = d2 / n12, by which delta is widened: n12 may be 0.
  modes.pole = (std::sqrt(d2 * d2 + 4 * n22 * G2) - d2) / (2 * n22);
  modes.delta = (d2 - modes.pole * n12) / (d2 + modes.pole * n12);
  return modes;
}

}  // namespace upswing

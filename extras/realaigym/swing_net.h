#pragma once

#include <array>
#include <vector>

#include "base/aligned.h"
#include "extras/realaigym/simulation.h"

/// The arithmetic of SwingNet (swing_policy.h) for a block of simulations.
namespace upswing::realaigym {

/// Largest number of units in each of the network's two layers, and number of inputs: sine and
/// cosine of q1, of q1 + q2 and of q2, w1/10 and w2/10.
inline constexpr int kSwingMostHidden = 32, kSwingInputs = 8;
/// Limit of the network's torque, N·m.
inline constexpr double kSwingTorque = 4;

/// Parameters of a block's controllers: each run of `lanes_each` consecutive simulations has its
/// own policy.
struct SwingBlock {
  int hidden;
  size_t lanes_each;             // kBoardBlock, kSwingGroup or 1
  AlignedVector<float> weights;  // (kBoardBlock / lanes_each × W), but (W × kBoardBlock) if 1
  std::array<Lanes, 4> K;        // N·m/rad, N·m·s/rad
  Lanes inverse_rho, sharpness;  //
  std::array<double, 16> P;      // (4 × 4)
  std::array<Lanes, 2> q1, q2;   // angles one and two steps ago, rad
  double mirrored_beyond;        // |q1| beyond which the network sees the mirror image, rad
};
/// Number of floats in a vector.
inline constexpr size_t kSwingGroup = 16;

/// Number of parameters of a network with `hidden` units per layer: each unit has its weights, then
/// its bias.
constexpr size_t SwingWeights(int hidden) {
  return static_cast<size_t>((kSwingInputs + 1) * hidden + (hidden + 1) * hidden + hidden + 1);
}

/// Computes the torques for the measured angles, then stores the angles as those of one step ago.
void SwingTorques(SwingBlock& block, const BoardMeasurement& measured, Lanes& torque);

}  // namespace upswing::realaigym

#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/tensors.h"
#include "realaigym/simulation.h"

namespace upswing {

/// A small network that swings up, blended with a linear regulator that holds:
///   u = (1 - s) u_net(x) + s u_lin(x),   u_lin = -K x,   s = smooth step of (1 - x' P x / ρ)
/// x is the deviation from upright. It computes the velocities itself, from the last measured
/// angles, which have no noise on the board: w = (3 q - 4 q' + q'')/(2 h).
///
/// All of it are numbers in one vector, so that it can be searched (search.h).
class SwingNet {
 public:
  /// Numbers before the network's: of K (4), log ρ, sharpness of the blend.
  static constexpr int kLinear = 6;

  SwingNet(Robot robot, int hidden);

  int hidden() const { return hidden_; }
  Robot robot() const { return robot_; }
  /// How many numbers there are.
  size_t size() const;
  /// Where a search begins: the regulator of the nominal plant, a random network.
  std::vector<double> Initial(uint64_t seed) const;

  /// A controller of a block of simulations, by one vector for all of them.
  std::unique_ptr<BoardController> Control(std::span<const double> numbers) const;
  /// By several, each for `lanes_each` simulations one after the other: kSwingGroup (swing_net.h)
  /// or 1. Where there are too few, the last one serves the rest.
  std::unique_ptr<BoardController> Control(std::span<const std::span<const double>> numbers,
                                           size_t lanes_each) const;

  /// Metadata `format` upswing-realaigym, `format_version`, `robot` and `hidden`; a tensor
  /// `numbers`, F64 (size).
  Tensors ToTensors(std::span<const double> numbers) const;

 private:
  Robot robot_;
  int hidden_;
  std::array<double, 4> K_;   // where the search begins
  std::array<double, 16> P_;  // (4 × 4), of the same regulator
};

/// A SwingNet with its numbers, as a file has it.
struct SwingPolicy {
  SwingNet net;
  std::vector<double> numbers;
};

/// Whether a file's tensors are such a policy.
bool IsSwingPolicy(const Tensors& tensors);
/// Reads it. The first six numbers are exponents: they are within 50, the others within 1e6. Throws
/// BadInput.
SwingPolicy ReadSwingPolicy(const Tensors& tensors);

}  // namespace upswing

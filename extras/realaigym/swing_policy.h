#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/tensors.h"
#include "extras/realaigym/simulation.h"

namespace upswing::realaigym {

/// A small network that swings up, blended with a linear regulator that holds upright:
///   u = (1 - s) u_net(x) + s u_lin(x),   u_lin = -K x,   s = smooth step of (1 - x' P x / ρ)
/// x is the deviation from upright. The velocities come from the last measured angles, which have
/// no noise on the board: w = (3 q - 4 q' + q'')/(2 h).
///
/// A network that mirrors sees the mirror image of the pendulum where |q1| > π, and its torque
/// changes sign. So a network that swings up in one direction swings back after a fall past
/// upright, within the range of a machine's encoders.
///
/// All parameters form one vector, so that they can be searched (search.h). In order:
///   n (4)         the gains are K exp(0.3 n). K and P solve the LQR of the plant without friction,
///                 Q = diag(1, 1, 0.1, 0.1), R = 1, x = (q1 - π, q2, w1, w2)
///   ln ρ, ln a    s = z² (3 - 2 z), z = a (1 - x' P x / ρ) + ½ clamped to 0 … 1
///   the rest      network 8 → H → H → 1: for each unit its weights, then its bias
/// Inputs: sin and cos of q1, of q1 + q2 and of q2, then w1/10, w2/10 [rad/s]. A unit computes
/// f(x) = x (27 + x²)/(27 + 9 x²), x clamped to ±3. The torque is 4 f(y/2) N·m with the last sum y.
class SwingNet {
 public:
  /// Number of parameters before the network's: K (4), log ρ, sharpness of the blend.
  static constexpr int kLinear = 6;

  SwingNet(Robot robot, int hidden, bool mirrors = false);

  int hidden() const { return hidden_; }
  Robot robot() const { return robot_; }
  bool mirrors() const { return mirrors_; }
  /// Number of parameters.
  size_t size() const;
  /// Initial parameters of a search: the regulator of the nominal plant, and a random network.
  std::vector<double> Initial(uint64_t seed) const;

  /// A controller of a block of simulations with the same parameters for all.
  std::unique_ptr<BoardController> Control(std::span<const double> numbers) const;
  /// A controller with several parameter vectors, each for `lanes_each` consecutive simulations:
  /// kSwingGroup (swing_net.h) or 1. The last vector serves any further simulations.
  std::unique_ptr<BoardController> Control(std::span<const std::span<const double>> numbers,
                                           size_t lanes_each) const;

  /// The file's tensors. Metadata: `format` upswing-realaigym, `format_version` (2; 3 mirrors),
  /// `robot` and `hidden`. Tensor: `numbers`, F64 (size).
  Tensors ToTensors(std::span<const double> numbers) const;

 private:
  Robot robot_;
  int hidden_;
  bool mirrors_;
  std::array<double, 4> K_;   // initial gain of a search
  std::array<double, 16> P_;  // (4 × 4), of the initial regulator
};

/// A SwingNet with its parameters, as stored in a file.
struct SwingPolicy {
  SwingNet net;
  std::vector<double> numbers;
};

/// Whether a file's tensors are a board policy.
bool IsSwingPolicy(const Tensors& tensors);
/// Reads a board policy. Throws BadInput unless the first six numbers, which are exponents, are
/// within 50 and the others within 1e6.
SwingPolicy ReadSwingPolicy(const Tensors& tensors);

}  // namespace upswing::realaigym

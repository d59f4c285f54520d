#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "control/pendulum_model.h"

/// Trajectory optimisation with a limited torque, by differential dynamic programming with boxes:
/// Tassa, Mansard, Todorov, "Control-limited differential dynamic programming" (ICRA 2014). It uses
/// only first derivatives of the dynamics, as the iterative linear-quadratic regulator does (Li,
/// Todorov 2004). With one motor the box is an interval, and its best point has a formula.
namespace upswing {

/// States x_0 … x_T under torques u_0 … u_{T-1} (N·m), one for each control period.
struct Trajectory {
  std::vector<StateVector> x;  // (T + 1)
  std::vector<double> u;       // (T)
  double cost = 0;

  int steps() const { return static_cast<int>(u.size()); }  // T
};

/// A cost expanded to second order about a state and a torque.
struct CostExpansion {
  StateVector x = StateVector::Zero();           // first derivatives
  double u = 0;                                  //
  Eigen::Matrix4d xx = Eigen::Matrix4d::Zero();  // second derivatives; xx ≥ 0
  double uu = 0;                                 //
};

/// The minimised cost: Σ Running(x_t, u_t) + Final(x_T). It is d' Q d + R u² for each step and
/// d' P d at the end, where d is the deviation from the nearest upright whose angles, with their
/// full turns, are within `angle_range` (rad, at least π).
class QuadraticCost {
 public:
  QuadraticCost(const Eigen::Matrix4d& Q, double R, const Eigen::Matrix4d& P,
                double angle_range = std::numeric_limits<double>::infinity());

  double Running(const StateVector& x, double u) const;
  double Final(const StateVector& x) const;
  CostExpansion ExpandRunning(const StateVector& x, double u) const;
  /// Expands the final cost, which depends only on the state.
  CostExpansion ExpandFinal(const StateVector& x) const;
  /// The largest angles of a goal, with full turns, of each joint (rad).
  std::array<double, 2> largest_uprights() const { return {largest_upright1_, largest_upright2_}; }

 private:
  StateVector Deviation(const StateVector& x) const;

  Eigen::Matrix4d Q_;
  double R_;
  Eigen::Matrix4d P_;
  double largest_upright1_, largest_upright2_;  // rad
};

/// Finds locally best torques within the plant's limit. It keeps its buffers, so one object serves
/// many problems of one plant, one after the other.
class TrajectoryOptimizer {
 public:
  explicit TrajectoryOptimizer(const DesignPlant& plant) : model_(plant) {}
  /// `steps`: see PendulumModel.
  TrajectoryOptimizer(const DesignPlant& plant, int steps) : model_(plant, steps) {}

  /// The trajectory from `start` under torques (T), N·m, cut at the limit, and its cost.
  Trajectory Follow(const QuadraticCost& cost, const StateVector& start,
                    const std::vector<double>& torques);

  /// The torques of a trajectory with feedback K (T) about it.
  struct FeedbackPlan {
    const Trajectory& planned;
    std::span<const Eigen::RowVector4d> K;
  };
  /// The trajectories from `start` under each of the plans, which have the same T. A few plans take
  /// hardly longer than one.
  std::vector<Trajectory> Follow(const QuadraticCost& cost, const StateVector& start,
                                 std::span<const FeedbackPlan> plans);

  /// The trajectory with its cost filled in.
  static Trajectory Priced(const QuadraticCost& cost, Trajectory trajectory);

  /// Improves a trajectory with its cost. Stops when an iteration gains less than `tolerance` times
  /// the cost, or after `iterations`.
  void Improve(const QuadraticCost& cost, double tolerance, int iterations, Trajectory& trajectory);

  /// Feedback (T) about the trajectory of the last iteration: u = u_t + K_t (x - x_t). K_t is 0
  /// where the best torque lies beyond the limit.
  const std::vector<Eigen::RowVector4d>& gains() const { return K_; }

  PendulumModel& model() { return model_; }

 private:
  /// Number of step sizes along the improvement that are simulated at once, and of such rounds.
  static constexpr int kTrials = 8, kRounds = 2;

  /// The torque of trajectory i at step t in state x, N·m.
  using Torque = std::function<double(size_t i, size_t t, const StateVector& x)>;
  /// The trajectories (n) under these torques.
  std::vector<Trajectory> Follow(const QuadraticCost& cost, const StateVector& start, size_t n,
                                 size_t steps, const Torque& torque);
  /// Computes k_ and K_ about the trajectory. Returns false if the cost curves down along the
  /// torque; the caller then increases the regularisation.
  bool Backward(const QuadraticCost& cost, const Trajectory& trajectory, double regularization);
  /// Tries step sizes in rounds, longest first. Replaces `trajectory` with the best one of the
  /// first round that lowers its cost.
  bool Forward(const QuadraticCost& cost, Trajectory& trajectory);
  /// Simulates the trajectory with these shares of the change k_. Returns their costs.
  std::array<double, kTrials> Try(const QuadraticCost& cost, const Trajectory& trajectory,
                                  const std::array<double, kTrials>& share);

  PendulumModel model_;
  std::vector<LinearModel> models_;    // (T) along the trajectory
  std::vector<double> k_;              // (T) change of the torque, N·m
  std::vector<Eigen::RowVector4d> K_;  // (T)
  std::vector<StateVector> trial_x_;   // (T + 1, kTrials)
  std::vector<double> trial_u_;        // (T, kTrials)
};

}  // namespace upswing

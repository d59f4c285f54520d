#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "control/pendulum_model.h"

/// Trajectory optimisation with a limited torque: differential dynamic programming with boxes,
/// Tassa, Mansard, Todorov, "Control-limited differential dynamic programming" (ICRA 2014). Of the
/// dynamics the first derivatives are taken, as in the iterative linear-quadratic regulator (Li,
/// Todorov 2004). One motor makes the box an interval, whose best point is known at once.
namespace upswing {

/// States x_0 … x_T under torques u_0 … u_{T-1} (N·m), one for each control period.
struct Trajectory {
  std::vector<StateVector> x;  // (T + 1)
  std::vector<double> u;       // (T)
  double cost = 0;

  int steps() const { return static_cast<int>(u.size()); }  // T
};

/// A cost to second order about a state and a torque.
struct CostExpansion {
  StateVector x = StateVector::Zero();           // first derivatives
  double u = 0;                                  //
  Eigen::Matrix4d xx = Eigen::Matrix4d::Zero();  // second derivatives; xx may not curve down
  double uu = 0;                                 //
};

/// What is minimised: Σ Running(x_t, u_t) + Final(x_T).
class TrajectoryCost {
 public:
  virtual ~TrajectoryCost() = default;

  virtual double Running(const StateVector& x, double u) const = 0;
  virtual double Final(const StateVector& x) const = 0;
  virtual CostExpansion ExpandRunning(const StateVector& x, double u) const = 0;
  /// Of the state alone.
  virtual CostExpansion ExpandFinal(const StateVector& x) const = 0;
};

/// d' Q d + R u² and at the end d' P d, where d is the deviation from upright, its angles in
/// [-π, π].
class QuadraticCost : public TrajectoryCost {
 public:
  QuadraticCost(const Eigen::Matrix4d& Q, double R, const Eigen::Matrix4d& P)
      : Q_(Q), R_(R), P_(P) {}

  double Running(const StateVector& x, double u) const override;
  double Final(const StateVector& x) const override;
  CostExpansion ExpandRunning(const StateVector& x, double u) const override;
  CostExpansion ExpandFinal(const StateVector& x) const override;

 private:
  Eigen::Matrix4d Q_;
  double R_;
  Eigen::Matrix4d P_;
};

/// Finds locally best torques within the plant's limit. Keeps its buffers: one object serves many
/// problems of one plant, one after the other.
class TrajectoryOptimizer {
 public:
  explicit TrajectoryOptimizer(const Plant& plant) : model_(plant) {}

  /// Where torques (T), N·m, cut at the limit, lead from `start`, and at what cost.
  Trajectory Follow(const TrajectoryCost& cost, const StateVector& start,
                    const std::vector<double>& torques);

  /// The same torques with feedback K (T) about `planned`, from another start.
  Trajectory Follow(const TrajectoryCost& cost, const StateVector& start, const Trajectory& planned,
                    std::span<const Eigen::RowVector4d> K);

  /// The same trajectory with what it costs.
  static Trajectory Priced(const TrajectoryCost& cost, Trajectory trajectory);

  /// Improves a trajectory with its cost until an iteration gains less than `tolerance` times
  /// the cost, at most so many times. Returns the number of iterations.
  int Improve(const TrajectoryCost& cost, double tolerance, int iterations, Trajectory& trajectory);

  /// Feedback about the trajectory of the last iteration, (T): u = u_t + K_t (x - x_t). Where the
  /// torque is at its limit and would go beyond, it is 0.
  const std::vector<Eigen::RowVector4d>& gains() const { return K_; }

  PendulumModel& model() { return model_; }

 private:
  /// Steps to try along the improvement, longest first; all are simulated at once.
  static constexpr int kTrials = 16;

  template <typename Torque>
  Trajectory Follow(const TrajectoryCost& cost, const StateVector& start, size_t steps,
                    const Torque& torque);
  /// Computes k_ and K_ about the trajectory. False if the cost curves down along the torque:
  /// then it wants more regularisation.
  bool Backward(const TrajectoryCost& cost, const Trajectory& trajectory, double regularization);
  /// The best of the trials, if it costs less than `trajectory`, which it then replaces.
  bool Forward(const TrajectoryCost& cost, Trajectory& trajectory);

  PendulumModel model_;
  std::vector<LinearModel> models_;    // (T) along the trajectory
  std::vector<double> k_;              // (T) change of the torque, N·m
  std::vector<Eigen::RowVector4d> K_;  // (T)
  std::vector<StateVector> trial_x_;   // (T + 1, kTrials)
  std::vector<double> trial_u_;        // (T, kTrials)
};

}  // namespace upswing

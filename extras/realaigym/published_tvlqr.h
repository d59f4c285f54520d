#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "extras/machine/log.h"
#include "extras/machine/simulated_machine.h"
#include "extras/realaigym/machine_trials.h"

/// The TVLQR controllers that ran on RealAIGym's robot, rebuilt from their published settings and
/// the logs of their runs.
namespace upswing::realaigym {

/// The law u = ū(t) - K(t) (x - x̄(t)) with friction compensation, then a constant regulator about
/// upright. To first order, any path near the reference gives the same law: ū and x̄ are means over
/// runs, and K follows from the published costs by Riccati's equation along them.
class PublishedTvlqr {
 public:
  /// Throws BadInput unless the logs are runs of this robot without pushes that stay upright.
  PublishedTvlqr(std::span<const MachineLog> logs, Robot robot);

  /// The rms difference (N·m) between a log's commanded torques at the motor's joint and this law
  /// before the regulator takes over: how well the law is rebuilt.
  double Misfit(const MachineLog& log) const;

  /// Makes controllers for trials on a twin. The law must outlive them.
  TrialController OnMachine() const;

 private:
  using State = Eigen::Vector4d;
  using Gain = Eigen::Matrix<double, 2, 4>;

  /// The torques within the law's limits, to which friction compensation is added. `upright`:
  /// whether the regulator holds.
  Eigen::Vector2d Torque(double time, const State& x, bool upright) const;
  bool Catches(double time, const State& x) const;
  void Linearise();

  Robot robot_;
  std::vector<State> x_;            // x̄, (rad, rad, rad/s, rad/s)
  std::vector<Eigen::Vector2d> u_;  // ū, N·m
  std::vector<Gain> K_;             // at each point of the reference
  Gain regulator_;                  // gain about upright
};

/// Runs like real ones (not empty) on machines drawn from the twin's posterior: in their session,
/// with their loop's timing, and with their pushes in turn.
HardwareReport RunTvlqrTrials(const Twin& twin, Robot robot, const PublishedTvlqr& law,
                              std::span<const MachineLog> runs, const TrialRules& rules,
                              ThreadPool* pool, const Progress& progress = nullptr);

}  // namespace upswing::realaigym

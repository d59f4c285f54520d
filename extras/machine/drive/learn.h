#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "base/thread_pool.h"
#include "extras/machine/drive/link.h"
#include "extras/machine/drive/supervisor.h"
#include "extras/machine/twin/twin.h"
#include "runs/find_policy.h"

/// From a machine about which nothing is known to one that balances.
namespace upswing::machine {

/// What the user knows of the machine, and limits.
struct LearnConfig {
  // torque: that of the motor. angle: links that fall make some turns until they hang.
  Limits limits{.angle = 25};
  double encoder_counts = 0;  // of a turn
  double hz = 500;            // cycles per second
  double hold = 10;           // time of balance that ends the learning, s
  double motion = 0;          // most time in which torques move the links, s; 0: see MostMotion
  double computing = 120;     // most processor time of models and controllers, s
  double length = 0;          // of both links together, m; 0: about that of RealAIGym's robot
  int actuated_joint = 1;     // 1 or 2
  uint64_t seed = 1;          // of the excitations and of simulated tries

  /// Declares each setting but the limits in `options`: name, range, unit, help.
  void Describe(Options& options);
  /// A twin with all that is known of the machine. With a length, its plant is UsualPlant in
  /// another size, which the length and the torque limit tell.
  Twin Known() const;
  /// The most time in which torques move the links, s: `motion`. If that is 0: 60 s, or more in
  /// proportion for a machine that swings more slowly than RealAIGym's robot.
  double MostMotion() const;
  /// The default limits for the length and this torque limit (N·m).
  Limits DefaultLimits(double torque) const;
  /// Throws BadInput without the encoders' steps, and for limits that forbid a swing-up.
  void Check() const;
};

/// What a session of learning came to.
struct LearnResult {
  PolicyArguments controller;        // the last one that was tried; empty: none
  double compensation = 0;           // share of the dry friction that motors compensate under it
  int tries = 0;                     // on the machine
  double balanced = 0;               // time of balance at the end of the last try, s
  double motion = 0, computing = 0;  // used, s
  std::string reason;                // why it ended; empty: the machine balanced
};

/// Excites the machine, identifies a twin, designs a controller on it and tries it. After a failed
/// try it identifies again, with twice the weight on that log, until the machine balances or a
/// budget is spent. Writes log-NN.csv and twin.toml into the folder `out`. `say` gets a line for
/// each step; `stop` asks for an end. Throws Failure if the machine does not answer, or does not
/// hang at rest.
LearnResult Learn(const LearnConfig& config, MachineLink& link, const std::filesystem::path& out,
                  ThreadPool* pool, const std::function<void(const std::string&)>& say,
                  const std::function<bool()>& stop);

}  // namespace upswing::machine

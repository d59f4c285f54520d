#pragma once

#include <cstdint>
#include <vector>

#include "base/progress.h"
#include "base/thread_pool.h"
#include "extras/machine/drive/policy_controller.h"
#include "extras/machine/twin/twin.h"
#include "extras/realaigym/plant.h"

/// The task of the AI Olympics of 2026 on CloudPendulum, on machines drawn from a twin: to swing up
/// one motor's pendulum, to hold it, and to come back after disturbances. They are those of the
/// public example (github.com/cloudpendulum/benchmarking-example). The competition's own score is
/// not public. (docs/howto/realaigym.md)
namespace upswing::realaigym {

/// The rate of the loop that a user runs, 1/s. The machine allows 500.
inline constexpr int64_t kOlympicsHz = 400;
/// Largest velocity (rad/s) and angle (rad) of a joint. A run ends beyond them.
inline constexpr double kOlympicsVelocity = 50, kOlympicsAngle = 50.27;
/// The disturbances of a run: poses to which a hand leads the links within half a second, and
/// torques of 0.02 to 0.1 N·m at joint 1 for 0.1 s, in both directions. A push follows 3 s at the
/// goal; after one from which the links do not come back, the others count as failed. A pose comes
/// in any case.
inline constexpr int kOlympicsPoses = 24, kOlympicsPushes = 10;

/// The outcome of a run.
struct OlympicsRun {
  bool held = false;           // whether the links swing up and stay for 3 s
  double swing_up = 0;         // time until they stay, if they do, s
  int poses = 0, pushes = 0;   // disturbances after which they stay again
  bool within_limits = false;  // whether the run kept the limits of the machine

  bool perfect() const {
    return held && poses == kOlympicsPoses && pushes == kOlympicsPushes && within_limits;
  }
};

/// Runs on `count` machines drawn from the posterior of `machines`, with cycles of which one in 250
/// is late by up to 67.5 ms, as in logs of the machine's users. Only the policy's motor drives; it
/// compensates most of its own joint's dry friction, and acts in the cycle nearest to the end of
/// its control period. An Estimator of `twin`, which is what the policy's user knows of the
/// machines, gives the state. Throws BadInput for a twin or machines of another size than
/// CloudPendulum's.
std::vector<OlympicsRun> RunOlympics(const Twin& twin, const MachinePolicy& policy,
                                     const Twin& machines, int count, uint64_t seed,
                                     ThreadPool* pool, const Progress& progress = nullptr);

}  // namespace upswing::realaigym

#include "extras/machine/drive/machine_controller.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/text.h"

namespace upswing::machine {

double CyclesIn(double control_period, int64_t hz) {
  constexpr double kShortest = 0.95;  // cycles
  const double cycles = control_period * static_cast<double>(hz);
  if (cycles >= kShortest) return cycles;
  throw BadInput(Concat("--hz: expected ", std::lround(std::ceil(1 / control_period)),
                        " or more, for a cycle in ", FormatNumber(control_period),
                        " s, the control period of the policy, got ", hz));
}

MachineController PerCycle(MachineController controller, int64_t hz) {
  const double cycles = CyclesIn(controller.period(), hz);
  auto per_cycle = [controller = std::move(controller), cycles, last = int64_t{-1}, torque = 0.0](
                       int64_t cycle, const PendulumState& state) mutable {
    const double half = std::min(1.0, cycles) / 2;  // the nearest cycle counts
    const auto step = static_cast<int64_t>((static_cast<double>(cycle) + half) / cycles);
    // After missed cycles only the last of the missed actions is made up.
    if (step != last) torque = controller(step, state);
    last = step;
    return torque;
  };
  return {std::move(per_cycle), 1 / static_cast<double>(hz)};
}

}  // namespace upswing::machine

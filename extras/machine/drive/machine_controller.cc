#include "extras/machine/drive/machine_controller.h"

#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/text.h"

namespace upswing::machine {

int64_t CyclesIn(double control_period, int64_t hz) {
  constexpr double kMostChange = 0.1;
  const double cycles = control_period * static_cast<double>(hz), whole = std::round(cycles);
  if (std::abs(whole - cycles) <= kMostChange * cycles) return static_cast<int64_t>(whole);
  throw BadInput(Concat("--hz: expected a rate with whole cycles in ", FormatNumber(control_period),
                        " s, the control period of the policy, such as ",
                        std::lround(std::ceil(cycles) / control_period), ", got ", hz,
                        ", which has ", FormatNumber(cycles)));
}

MachineController PerCycle(MachineController controller, int64_t hz) {
  const int64_t cycles = CyclesIn(controller.period(), hz);
  auto per_cycle = [controller = std::move(controller), cycles, last = int64_t{-1}, torque = 0.0](
                       int64_t cycle, const PendulumState& state) mutable {
    // After missed cycles only the last of the missed actions is made up.
    const int64_t step = cycle / cycles;
    if (step != last) torque = controller(step, state);
    last = step;
    return torque;
  };
  return {std::move(per_cycle), 1 / static_cast<double>(hz)};
}

}  // namespace upswing::machine

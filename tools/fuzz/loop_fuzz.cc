// Target: the faults of encoders, clock, firmware and line in a run of the control loop. Accepted:
// a run without a fault.
#include "extras/machine/drive/adverse_testing.h"
#include "tools/fuzz/target.h"

namespace upswing {

using namespace machine;

bool TryInput(std::string_view input) {
  size_t at = 0;
  // Without further bytes there are no further faults.
  const auto next = [&] { return at < input.size() ? static_cast<unsigned char>(input[at++]) : 1; };
  const Chooser choose = [&](uint32_t n) {
    const uint32_t low = next();
    return (n > 256 ? low + 256U * next() : low) % n;
  };
  const bool with_twin = choose(2) == 0;
  const AdverseRun run = RunAdversely(with_twin, 64, 600, choose);
  Expect(run.violation.empty(), "safe torques");
  return run.reason.empty();
}

}  // namespace upswing

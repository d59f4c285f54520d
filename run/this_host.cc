#include "run/this_host.h"

#include "io/machine.h"
#include "mujoco/engines.h"

namespace upswing {

Host ThisHost(int threads) { return {AllEngines(), AvailableMemory(), threads}; }

}  // namespace upswing

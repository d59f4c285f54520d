#include "run/this_host.h"

#include <utility>

#include "io/machine.h"
#include "mujoco/engines.h"

namespace upswing {

Host ThisHost(int threads, ForeignMaker make_foreign) {
  return {AllEngines(), AvailableMemory(), threads, std::move(make_foreign)};
}

}  // namespace upswing

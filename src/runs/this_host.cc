#include "runs/this_host.h"

#include <utility>

#include "mujoco/engines.h"
#include "os/host.h"

namespace upswing {

Host ThisHost(int threads, ForeignMaker make_foreign) {
  return {AllEngines(), AvailableMemory(), threads, std::move(make_foreign)};
}

}  // namespace upswing

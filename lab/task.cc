#include "lab/task.h"

#include "core/error.h"
#include "core/text.h"

namespace upswing {

std::vector<std::string> TaskNames() { return {kDoublePendulum}; }

std::unique_ptr<VectorEnv> MakeEnv(const EnvConfig& config) {
  return std::make_unique<PendulumEnv>(config);
}

EnvSpec SpecOf(const EnvConfig& config) { return PendulumSpec(config); }

}  // namespace upswing

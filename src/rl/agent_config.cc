#include "rl/agent_config.h"

namespace upswing {

void WarnOfNoRate(double begin, double end, std::vector<std::string>& warnings) {
  if (begin == 0 && end == 0) {
    warnings.emplace_back("learning_rate and learning_rate_end are 0: the agent learns nothing");
  }
}

}  // namespace upswing

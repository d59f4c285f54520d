#include "rl/agent.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/text.h"

namespace upswing {

void ExpectFinite(const StepResult& result, size_t env) {
  const size_t D = result.next_obs.size() / result.reward.size();
  const auto next_obs = std::span(result.next_obs).subspan(env * D, D);
  const bool finite = std::isfinite(result.reward[env]) &&
                      std::ranges::all_of(next_obs, [](float x) { return std::isfinite(x); });
  if (finite) return;
  throw Failure(Concat("environment ", env, " gave a reward or an observation that is not a ",
                       "finite number"));
}

}  // namespace upswing

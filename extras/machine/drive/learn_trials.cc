#include "extras/machine/drive/learn_trials.h"

#include <cmath>

namespace upswing::machine {
namespace {

/// Share of the limits that simulated machines may use: the real machine differs from them.
constexpr double kSimulatedShare = 0.95;

Twin Spread(Twin twin, double spread) {
  for (double& value : twin.covariance) value *= spread * spread;
  return twin;
}

}  // namespace

RunRules TryRules(const LearnConfig& config, const Twin& twin, double compensation) {
  const Scale scale = ScaleOverUsual(twin.plant);
  return {.limits = config.limits,
          .seconds = 2 * kLongestFall * scale.time + config.hold,
          .is_try = true,
          .compensation = compensation,
          .scale = scale,
          .start_angle = kAnyAngle};
}

int HeldBy(const LearnConfig& config, const Draws& draws, const MachinePolicy& policy,
           double compensation, const std::function<bool()>& stop) {
  RunRules rules = TryRules(config, draws.twin, compensation);
  rules.limits.angle *= kSimulatedShare;
  rules.limits.velocity *= kSimulatedShare;
  rules.limits.energy *= kSimulatedShare;
  const Twin spread = Spread(draws.twin, draws.spread);
  int held = 0;
  for (int i = 0; i < kDraws; ++i) {
    Rng rng(config.seed, "machine: draws", static_cast<uint64_t>(i));
    TwinLink link(DrawTwin(spread, rng), draws.rest, config.seed);
    const RunOutcome run =
        RunCycles(config, rules, draws.twin.sensors, Estimator(draws.twin, 1 / config.hz),
                  ControllerOf(policy), link, stop);
    if (stop()) break;
    if (run.summary.upright >= config.hold) ++held;
  }
  return held;
}

bool HasChanged(const Twin& before, const Twin& now) {
  constexpr double kDeviations = 2;
  Twin was = before, is = now;
  const Options old = OptionsOf(was), fresh = OptionsOf(is);
  for (const std::string& name : before.uncertain) {
    const double deviation = std::sqrt(std::max(0.0, CovarianceOf(before, name, name)));
    const double change = std::abs(fresh.Get(name)->number() - old.Get(name)->number());
    if (deviation > 0 && change > kDeviations * deviation) return true;
  }
  return false;
}

}  // namespace upswing::machine

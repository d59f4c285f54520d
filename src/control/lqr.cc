#include "control/lqr.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "control/linearize.h"
#include "pendulum/upright_modes.h"

namespace upswing {
namespace {

/// The error for the user, with the reason why there is no solution.
Error NoGain(const LqrConfig& config, const DesignPlant& plant) {
  const UprightModes modes = ModesOf(plant);
  if (std::max({config.q1, config.q2, config.w1, config.w2}) == 0) {
    return BadInput("lqr: expected a weight above 0 for q1, q2, w1 or w2, got only 0");
  }
  if (std::abs(modes.delta) > 1e-3) {
    return BadInput(Concat(
        "lqr: no gain exists numerically for weights so far apart: the weight of the torque is ",
        Rounded(config.torque), ", the largest weight of the state ",
        Rounded(WeightsOf(config).maxCoeff())));
  }
  return BadInput(
      Concat("lqr: found no gain that holds this plant upright: its unstable modes grow at ",
             Rounded(modes.faster), "/s and ", Rounded(modes.slower), "/s (ratio ",
             Rounded(modes.slower / modes.faster), "), and delta is ", Rounded(modes.delta),
             "; where that is 0, damping of joint ", plant.actuated_joint == 1 ? 2 : 1,
             " cancels the coupling of the links, and no torque reaches a mode"));
}

}  // namespace

Eigen::Matrix4d WeightsOf(const LqrConfig& config) {
  return Eigen::Vector4d(config.q1, config.q2, config.w1, config.w2).asDiagonal();
}

LinearModel UprightModel(const DesignPlant& plant) {
  const int steps = plant.physics_steps();
  return Discretize(LinearizeUpright(plant), plant.control_period / steps, steps);
}

Lqr SolveLqr(const LqrConfig& config, const DesignPlant& plant) {
  const auto lqr = SolveDiscreteLqr(UprightModel(plant), WeightsOf(config), config.torque);
  if (!lqr) throw NoGain(config, plant);
  return *lqr;
}

LqrPolicy::LqrPolicy(LqrConfig config, const DesignPlant& plant)
    : PendulumController("lqr", OptionsOf(config), plant),
      config_(config),
      lqr_(SolveLqr(config, plant)) {}

std::string LqrPolicy::description() const {
  const auto list = [](const auto& numbers) {
    std::vector<std::string> texts(numbers.size());
    std::ranges::transform(numbers, texts.begin(), Rounded);
    return Join(texts, ", ");
  };
  const std::array weights{config_.q1, config_.q2, config_.w1, config_.w2};
  return Concat("linear-quadratic regulator about upright, weights ", list(weights), " and ",
                Rounded(config_.torque), ", gain ", list(lqr_.K));
}

double LqrPolicy::Torque(const StateVector& deviation, size_t /*env*/, Memory& /*memory*/) const {
  return lqr_.Torque(deviation);
}

}  // namespace upswing

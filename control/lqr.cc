#include "control/lqr.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "control/linearize.h"
#include "control/riccati.h"
#include "control/upright_modes.h"
#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

/// Why there is no solution, for the user.
Error NoGain(const LqrConfig& config, const Plant& plant) {
  const UprightModes modes = ModesOf(plant);
  if (std::max({config.q1, config.q2, config.w1, config.w2}) == 0) {
    return BadInput("lqr: expected a weight above 0 of q1, q2, w1 or w2, got none");
  }
  // Where a Runge-Kutta step no longer decays: Hairer, Wanner, "Solving Ordinary Differential
  // Equations II" (1996), section IV.2.
  constexpr double kLargestDecay = 2.785 / kPhysicsTimestep;
  if (modes.decay > kLargestDecay) {
    return BadInput(Concat("lqr: expected a plant that steps of ", kPhysicsTimestep,
                           " s can follow, whose damping acts at up to ", Rounded(kLargestDecay),
                           "/s, got ", Rounded(modes.decay), "/s"));
  }
  if (std::abs(modes.delta) > 1e-3) {
    return BadInput(Concat(
        "lqr: no gain was found with these weights, which are too far apart: that of the torque "
        "is ",
        Rounded(config.torque), ", the largest of the state ", Rounded(config.Q().maxCoeff())));
  }
  return BadInput(
      Concat("lqr: no gain was found that holds this plant upright: its unstable modes grow at ",
             Rounded(modes.faster), "/s and ", Rounded(modes.slower), "/s (ratio ",
             Rounded(modes.slower / modes.faster), "), and delta is ", Rounded(modes.delta),
             "; where that is 0, damping of joint ", plant.actuated_joint == 1 ? 2 : 1,
             " cancels the coupling of the links, and no torque reaches a mode"));
}

}  // namespace

void LqrConfig::Describe(Options& o) {
  constexpr Range kWeight{0, 1e9};
  o.Section("lqr");
  // Those of Tedrake's Acrobot.
  o.Add(&q1, "lqr_q1", kWeight, "1/rad²", "weight of the angle of link 1 from upright");
  o.Add(&q2, "lqr_q2", kWeight, "1/rad²", "weight of the angle of link 2 to link 1");
  o.Add(&w1, "lqr_w1", kWeight, "s²/rad²", "weight of the velocity of q1");
  o.Add(&w2, "lqr_w2", kWeight, "s²/rad²", "weight of the velocity of q2");
  o.Add(&torque, "lqr_torque", kPositive, "1/(N·m)²", "weight of the torque");
}

Lqr SolveLqr(const LqrConfig& config, const Plant& plant) {
  const LinearModel model = Discretize(LinearizeUpright(plant), kPhysicsTimestep, kPhysicsSteps);
  const Eigen::MatrixXd R = Eigen::MatrixXd::Constant(1, 1, config.torque);
  const auto P = SolveRiccati(model.A, model.B, config.Q(), R);
  if (!P) throw NoGain(config, plant);
  return {GainOf(*P, model.A, model.B, R), *P};
}

LqrPolicy::LqrPolicy(LqrConfig config, const Plant& plant)
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

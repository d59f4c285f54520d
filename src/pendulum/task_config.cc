#include "pendulum/task_config.h"

namespace upswing {

void RewardConfig::Weigh(int env, const std::array<double, kRewardTerms>& terms,
                         StepResult& result) const {
  const auto i = static_cast<size_t>(env);
  result.reward[i] = 0;
  for (size_t k = 0; k < kRewardTerms; ++k) {
    result.reward_terms[i * kRewardTerms + k] = terms[k] * weight[k];
    result.reward[i] += terms[k] * weight[k];
  }
}

void RewardConfig::Describe(Options& o) {
  constexpr Range kWeight{0, 1000};
  auto& [energy, height, balance, velocity, torque] = weight;
  o.Section("reward");
  o.Add(&energy, "energy_weight", kWeight, "", "reward weight of the energy term");
  o.Add(&height, "height_weight", kWeight, "", "reward weight of the height term");
  o.Add(&balance, "balance_weight", kWeight, "", "reward weight of the balance term");
  o.Add(&velocity, "velocity_weight", kWeight, "", "reward weight of the velocity penalty");
  o.Add(&torque, "torque_weight", kWeight, "", "reward weight of the torque penalty");
  Option& own = o.Add(&expression, "reward",
                      "reward of the training as an expression, such as \"E + h + 5*inverted\", in "
                      "place of the built-in reward and its weights");
  own.usual = "the built-in reward";
  own.wraps = true;
}

}  // namespace upswing

#pragma once

#include <string_view>

#include "nn/gaussian.h"

namespace upswing {

/// Rule by which the outputs of a network choose an action. FactsOf describes each.
enum class ActionRule { kLevels, kSquashedGaussian, kClippedGaussian, kCategorical };

/// Meaning of a network's outputs, which ActionRules share.
enum class OutputMeaning {
  kQValues,   // a Q-value per torque
  kLogits,    // ln π up to a constant per torque
  kGaussian,  // (μ, ln σ) per component of the action
};

/// Properties of an ActionRule.
struct ActionRuleFacts {
  ActionRule rule;
  std::string_view name;  // `output` in policy files, such as "squashed-gaussian"
  OutputMeaning outputs;
  std::string_view choice;             // in descriptions, such as "mean action of a"
  std::string_view distribution;       // the noun that follows, such as "Gaussian policy"
  const ActionBound* bound = nullptr;  // of kGaussian's components

  /// Whether each action is one of a table of torques: that of the largest output.
  bool chooses_torque() const { return outputs != OutputMeaning::kGaussian; }
  /// Whether the network is an actor. The outputs of other networks are values.
  bool is_actor() const { return outputs != OutputMeaning::kQValues; }
};

const ActionRuleFacts& FactsOf(ActionRule rule);

/// The rule of this name. Throws BadInput that lists the names.
ActionRule ActionRuleCalled(std::string_view name);

}  // namespace upswing

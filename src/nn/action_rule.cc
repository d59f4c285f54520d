#include "nn/action_rule.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/text.h"

namespace upswing {

const ActionBound kSquash{[](double u) { return std::tanh(u); },
                          [](double a) { return std::atanh(a); }};
const ActionBound kClip{[](double u) { return std::clamp(u, -1.0, 1.0); },
                        [](double a) { return a; }};

namespace {

/// A row for each rule, in the order of ActionRule.
constexpr std::array kRules{
    ActionRuleFacts{ActionRule::kLevels, "levels", OutputMeaning::kQValues, "greedy policy of a",
                    "Q-network"},
    ActionRuleFacts{ActionRule::kSquashedGaussian, "squashed-gaussian", OutputMeaning::kGaussian,
                    "mean action of a", "Gaussian policy", &kSquash},
    ActionRuleFacts{ActionRule::kClippedGaussian, "clipped-gaussian", OutputMeaning::kGaussian,
                    "mean action of a", "Gaussian policy", &kClip},
    ActionRuleFacts{ActionRule::kCategorical, "categorical", OutputMeaning::kLogits,
                    "likeliest action of a", "categorical policy"},
};

constexpr bool IsInOrder() {
  for (size_t i = 0; i < kRules.size(); ++i) {
    if (kRules[i].rule != static_cast<ActionRule>(i)) return false;
  }
  return true;
}
static_assert(IsInOrder());

}  // namespace

const ActionRuleFacts& FactsOf(ActionRule rule) { return kRules.at(static_cast<size_t>(rule)); }

ActionRule ActionRuleCalled(std::string_view name) {
  const auto found = std::ranges::find(kRules, name, &ActionRuleFacts::name);
  if (found != kRules.end()) return found->rule;
  std::vector<std::string_view> names;
  for (const ActionRuleFacts& facts : kRules) names.push_back(facts.name);
  throw BadInput(Concat("expected one of ", Join(names, ", "), ", got \"", name, "\""));
}

}  // namespace upswing

#include "nn/actor_policy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/rng.h"
#include "core/safetensors.h"

namespace upswing {
namespace {

constexpr int D = 3;

std::vector<float> Random(size_t count, uint64_t seed) {
  Rng rng(seed, "actor policy test");
  std::vector<float> numbers(count);
  for (float& x : numbers) x = static_cast<float>(rng.Uniform(-1, 1));
  return numbers;
}

/// An actor of two components (one, if categorical), with a critic of these inputs.
ActorParts Parts(ActorOutput output, int critic_inputs) {
  ActorParts parts;
  parts.output = output;
  const bool categorical = output == ActorOutput::kCategorical;
  parts.actor = {D, {8, 8}, true, Activation::kTanh};
  parts.action_limit = categorical ? std::vector<double>{3} : std::vector<double>{2, 5};
  if (categorical) parts.torques = {-3, -1, 0, 1, 3};
  const Network<float> actor(parts.actor, {categorical ? 5 : 4});
  parts.parameters = Random(actor.num_parameters(), 1);
  if (critic_inputs == 0) return parts;
  parts.critic = {critic_inputs, {6}, false, Activation::kRelu};
  const Network<float> critic(parts.critic, {1});
  parts.critic_parameters = Random(critic.num_parameters(), 2);
  return parts;
}

struct Case {
  ActorOutput output;
  int critic_inputs;
};

class ActorPolicyTest : public ::testing::TestWithParam<Case> {
 protected:
  ActorParts parts = Parts(GetParam().output, GetParam().critic_inputs);
  ActorPolicy policy{parts, PolicyInfo()};

  /// What loading says after `change` has altered the file.
  template <typename Change>
  std::string ErrorAfter(const Change& change) {
    Tensors file = policy.ToTensors();
    change(file);
    try {
      ActorPolicy::From(ReadSafetensors(WriteSafetensors(file).Joined(), "changed"));
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      return error.what();
    }
    return "";
  }
};

TEST_P(ActorPolicyTest, ChoosesTheMiddleOfItsDistribution) {
  constexpr int kRows = 300;  // more than one block
  const std::vector<float> obs = Random(size_t{kRows} * D, 3);
  const int A = policy.action_size();
  const auto memory = policy.Start(kRows);
  std::vector<float> outputs(static_cast<size_t>(kRows * policy.num_outputs()));
  std::vector<double> action(static_cast<size_t>(kRows * A));
  const Matrix<float> out(outputs.data(), kRows, policy.num_outputs());
  policy.Outputs({obs.data(), kRows, D}, out, *memory);
  policy.Act({obs.data(), kRows, D}, {action.data(), kRows, A}, *memory);
  for (int i = 0; i < kRows; ++i) {
    for (int k = 0; k < A; ++k) {
      const double limit = parts.action_limit[static_cast<size_t>(k)];
      double expected = limit * std::tanh(double{out(i, k)});
      if (GetParam().output == ActorOutput::kClippedGaussian) {
        expected = limit * std::min(1.0, std::max(-1.0, double{out(i, k)}));
      }
      if (GetParam().output == ActorOutput::kCategorical) {
        int best = 0;
        for (int j = 1; j < 5; ++j) best = out(i, j) > out(i, best) ? j : best;
        expected = parts.torques[static_cast<size_t>(best)];
      }
      ASSERT_EQ(action[static_cast<size_t>(i * A + k)], expected);
    }
  }
}

TEST_P(ActorPolicyTest, SpreadHasTheCentral68PercentOfItsDraws) {
  const std::vector<float> obs = Random(D, 6);
  const Matrix<const float> row(obs.data(), 1, D);
  const auto A = static_cast<size_t>(policy.action_size());
  const auto memory = policy.Start(1);
  std::vector<float> outputs(static_cast<size_t>(policy.num_outputs()));
  std::vector<double> low(A), high(A);
  policy.Outputs(row, {outputs.data(), 1, policy.num_outputs()}, *memory);
  policy.Spread(row, {low.data(), 1, policy.action_size()}, {high.data(), 1, policy.action_size()},
                *memory);
  constexpr int kDraws = 40000;
  Rng rng(7, "actor policy test: draws");
  for (size_t k = 0; k < A; ++k) {
    int below = 0, above = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      double action = 0;
      if (GetParam().output == ActorOutput::kCategorical) {
        // The largest of the logits with Gumbel noise.
        double best = -1e9;
        for (size_t i = 0; i < outputs.size(); ++i) {
          const double noisy = outputs[i] - std::log(-std::log(1 - rng.Uniform()));
          if (noisy > best) action = parts.torques[i];
          best = std::max(best, noisy);
        }
      } else {
        const double u = outputs[k] + std::exp(double{outputs[A + k]}) * rng.Normal();
        const bool squashed = GetParam().output == ActorOutput::kSquashedGaussian;
        action = parts.action_limit[k] * (squashed ? std::tanh(u) : std::clamp(u, -1.0, 1.0));
      }
      below += action < low[k] ? 1 : 0;
      above += action > high[k] ? 1 : 0;
    }
    // 16% at either end, or less where many draws are equal to that end; 5 standard errors.
    constexpr double kTail = 0.1587, kError = 0.0092;
    EXPECT_LT(below, kDraws * (kTail + kError));
    EXPECT_LT(above, kDraws * (kTail + kError));
    if (GetParam().output != ActorOutput::kSquashedGaussian) continue;
    EXPECT_GT(below, kDraws * (kTail - kError));
    EXPECT_GT(above, kDraws * (kTail - kError));
  }
}

TEST_P(ActorPolicyTest, ValuesAreTheCriticsAtTheChosenAction) {
  ASSERT_EQ(policy.num_values(), GetParam().critic_inputs > 0 ? 1 : 0);
  if (GetParam().critic_inputs == 0) return;
  const std::vector<float> obs = Random(D, 4);
  const Matrix<const float> row(obs.data(), 1, D);
  const auto memory = policy.Start(1);
  std::vector<double> action(static_cast<size_t>(policy.action_size()));
  float value = 0;
  policy.Act(row, {action.data(), 1, policy.action_size()}, *memory);
  policy.Values(row, {&value, 1, 1}, *memory);

  std::vector<float> inputs = obs;
  if (GetParam().critic_inputs > D) {
    for (size_t k = 0; k < action.size(); ++k) {
      inputs.push_back(static_cast<float>(action[k] / parts.action_limit[k]));
    }
  }
  const Network<float> critic(parts.critic, {1});
  auto activations = critic.MakeActivations(1, false);
  float expected = 0;
  critic.Forward({parts.critic_parameters}, {inputs.data(), 1, GetParam().critic_inputs}, {0, 1},
                 activations, {&expected, 1, 1});
  EXPECT_EQ(value, expected);
}

TEST_P(ActorPolicyTest, AFileActsAsThePolicyThatWroteIt) {
  const Tensors file = ReadSafetensors(WriteSafetensors(policy.ToTensors()).Joined(), "file");
  const ActorPolicy loaded = ActorPolicy::From(file);
  EXPECT_EQ(loaded.self_check().error, 0);
  EXPECT_EQ(loaded.parts().parameters, parts.parameters);
  EXPECT_EQ(loaded.parts().critic_parameters, parts.critic_parameters);
  EXPECT_EQ(loaded.description(), policy.description());
  const std::vector<float> obs = Random(D * 4, 5);
  const int A = policy.action_size();
  std::vector<double> a(static_cast<size_t>(4 * A)), b = a;
  policy.Act({obs.data(), 4, D}, {a.data(), 4, A}, *policy.Start(4));
  loaded.Act({obs.data(), 4, D}, {b.data(), 4, A}, *loaded.Start(4));
  EXPECT_EQ(a, b);
}

TEST_P(ActorPolicyTest, ADamagedFileIsRefused) {
  EXPECT_EQ(ErrorAfter([](Tensors&) {}), "");
  const std::string moved = ErrorAfter([&](Tensors& file) {
    std::vector<float> bias(static_cast<size_t>(policy.num_outputs()), 0.5F);
    file.AddCopy<float>("output.bias", bias);
  });
  EXPECT_NE(moved.find("changed: self-check: expected output"), std::string::npos) << moved;
  const std::string output =
      ErrorAfter([](Tensors& file) { file.metadata["output"] = "telepathy"; });
  EXPECT_NE(output.find("output: expected one of squashed-gaussian"), std::string::npos) << output;
  const std::string shape = ErrorAfter([](Tensors& file) {
    file.metadata["network"] =
        R"({"inputs":3,"hidden":[4096,4096],"layer_norm":true,"activation":"tanh"})";
  });
  EXPECT_NE(shape.find("feature.0.weight"), std::string::npos) << shape;
  const std::string activation = ErrorAfter([](Tensors& file) {
    file.metadata["network"] = R"({"inputs":3,"hidden":[8,8],"layer_norm":true})";
  });
  EXPECT_NE(activation.find(R"(expected "relu" or "tanh")"), std::string::npos) << activation;
  const std::string limit = ErrorAfter([&](Tensors& file) {
    file.AddCopy<double>("action_limit", std::vector<double>(parts.action_limit.size(), -1.0));
  });
  EXPECT_NE(limit.find("numbers above 0"), std::string::npos) << limit;
}

INSTANTIATE_TEST_SUITE_P(All, ActorPolicyTest,
                         ::testing::Values(Case{ActorOutput::kSquashedGaussian, D + 2},
                                           Case{ActorOutput::kClippedGaussian, D},
                                           Case{ActorOutput::kClippedGaussian, 0},
                                           Case{ActorOutput::kCategorical, D}));

TEST(ActorParts, PartsThatDoNotFitAreRefused) {
  ActorParts parts = Parts(ActorOutput::kClippedGaussian, D);
  parts.critic.inputs = D + 1;
  EXPECT_THROW(ActorPolicy(parts, PolicyInfo()), Error);
  parts = Parts(ActorOutput::kCategorical, D);
  parts.torques.clear();
  EXPECT_THROW(ActorPolicy(parts, PolicyInfo()), Error);
  parts = Parts(ActorOutput::kSquashedGaussian, 0);
  parts.parameters.pop_back();
  EXPECT_THROW(ActorPolicy(parts, PolicyInfo()), Error);
}

}  // namespace
}  // namespace upswing

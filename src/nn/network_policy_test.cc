#include "nn/network_policy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/argmax.h"
#include "base/error.h"
#include "base/rng.h"
#include "base/safetensors.h"

namespace upswing {
namespace {

constexpr int D = 3;

AlignedVector<float> Random(size_t count, uint64_t seed) {
  Rng rng(seed, "actor policy test");
  AlignedVector<float> numbers(count);
  for (float& x : numbers) x = static_cast<float>(rng.Uniform(-1, 1));
  return numbers;
}

/// Parts of an actor with two action components (one if categorical) and a critic with
/// `critic_inputs` inputs.
NetworkPolicyParts Parts(ActionRule rule, int critic_inputs) {
  NetworkPolicyParts parts;
  parts.rule = rule;
  const bool categorical = rule == ActionRule::kCategorical;
  parts.shape = {D, {8, 8}, categorical ? 5 : 4, true, Activation::kTanh};
  parts.action_limit = categorical ? std::vector<double>{3} : std::vector<double>{2, 5};
  if (categorical) parts.torques = {-3, -1, 0, 1, 3};
  parts.parameters = Random(Network(parts.shape).num_parameters(), 1);
  if (critic_inputs == 0) return parts;
  parts.critic = {critic_inputs, {6}, 1};
  parts.critic_parameters = Random(Network(parts.critic).num_parameters(), 2);
  return parts;
}

struct Case {
  ActionRule rule;
  int critic_inputs;
};

class ActorTest : public ::testing::TestWithParam<Case> {
 protected:
  NetworkPolicyParts parts = Parts(GetParam().rule, GetParam().critic_inputs);
  NetworkPolicy policy{parts, PolicyInfo()};

  /// The error message of loading the file after `change` has altered it.
  template <typename Change>
  std::string ErrorAfter(const Change& change) {
    Tensors file = policy.ToTensors();
    change(file);
    try {
      NetworkPolicy::From(ReadSafetensors(WriteSafetensors(file).Joined(), "changed"));
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      return error.what();
    }
    return "";
  }
};

TEST_P(ActorTest, ChoosesTheMiddleOfItsDistribution) {
  constexpr int kRows = 300;  // more than one block
  const AlignedVector<float> obs = Random(size_t{kRows} * D, 3);
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
      if (GetParam().rule == ActionRule::kClippedGaussian) {
        expected = limit * std::min(1.0, std::max(-1.0, double{out(i, k)}));
      }
      if (GetParam().rule == ActionRule::kCategorical) {
        int best = 0;
        for (int j = 1; j < 5; ++j) best = out(i, j) > out(i, best) ? j : best;
        expected = parts.torques[static_cast<size_t>(best)];
      }
      ASSERT_EQ(action[static_cast<size_t>(i * A + k)], expected);
    }
  }
}

TEST_P(ActorTest, SpreadHasTheCentral68PercentOfItsDraws) {
  const AlignedVector<float> obs = Random(D, 6);
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
      if (GetParam().rule == ActionRule::kCategorical) {
        // A sample by the Gumbel trick: the largest of the logits plus Gumbel noise.
        double best = -1e9;
        for (size_t i = 0; i < outputs.size(); ++i) {
          const double noisy = outputs[i] - std::log(-std::log(1 - rng.Uniform()));
          if (noisy > best) action = parts.torques[i];
          best = std::max(best, noisy);
        }
      } else {
        const double u = outputs[k] + std::exp(double{outputs[A + k]}) * rng.Normal();
        const bool squashed = GetParam().rule == ActionRule::kSquashedGaussian;
        action = parts.action_limit[k] * (squashed ? std::tanh(u) : std::clamp(u, -1.0, 1.0));
      }
      below += action < low[k] ? 1 : 0;
      above += action > high[k] ? 1 : 0;
    }
    // Tails of 16%, or less where many draws equal the end of the spread. Tolerance: 5 standard
    // errors.
    constexpr double kTail = 0.1587, kError = 0.0092;
    EXPECT_LT(below, kDraws * (kTail + kError));
    EXPECT_LT(above, kDraws * (kTail + kError));
    if (GetParam().rule != ActionRule::kSquashedGaussian) continue;
    EXPECT_GT(below, kDraws * (kTail - kError));
    EXPECT_GT(above, kDraws * (kTail - kError));
  }
}

TEST_P(ActorTest, ValuesAreTheCriticsAtTheChosenAction) {
  ASSERT_EQ(policy.num_values(), GetParam().critic_inputs > 0 ? 1 : 0);
  if (GetParam().critic_inputs == 0) return;
  const AlignedVector<float> obs = Random(D, 4);
  const Matrix<const float> row(obs.data(), 1, D);
  const auto memory = policy.Start(1);
  std::vector<double> action(static_cast<size_t>(policy.action_size()));
  float value = 0;
  policy.Act(row, {action.data(), 1, policy.action_size()}, *memory);
  policy.Values(row, {&value, 1, 1}, *memory);

  AlignedVector<float> inputs = obs;
  if (GetParam().critic_inputs > D) {
    for (size_t k = 0; k < action.size(); ++k) {
      inputs.push_back(static_cast<float>(action[k] / parts.action_limit[k]));
    }
  }
  const Network critic(parts.critic);
  auto activations = critic.MakeActivations(1, false);
  float expected = 0;
  critic.Forward(parts.critic_parameters, {inputs.data(), 1, GetParam().critic_inputs}, {0, 1},
                 activations, {&expected, 1, 1});
  EXPECT_EQ(value, expected);
}

TEST_P(ActorTest, AFileActsAsThePolicyThatWroteIt) {
  const Tensors file = ReadSafetensors(WriteSafetensors(policy.ToTensors()).Joined(), "file");
  const NetworkPolicy loaded = NetworkPolicy::From(file);
  EXPECT_EQ(loaded.self_check().error, 0);
  EXPECT_EQ(loaded.parts().parameters, parts.parameters);
  EXPECT_EQ(loaded.parts().critic_parameters, parts.critic_parameters);
  EXPECT_EQ(loaded.description(), policy.description());
  const AlignedVector<float> obs = Random(D * 4, 5);
  const int A = policy.action_size();
  std::vector<double> a(static_cast<size_t>(4 * A)), b = a;
  policy.Act({obs.data(), 4, D}, {a.data(), 4, A}, *policy.Start(4));
  loaded.Act({obs.data(), 4, D}, {b.data(), 4, A}, *loaded.Start(4));
  EXPECT_EQ(a, b);
}

TEST_P(ActorTest, ADamagedFileIsRefused) {
  EXPECT_EQ(ErrorAfter([](Tensors&) {}), "");
  const std::string moved = ErrorAfter([&](Tensors& file) {
    std::vector<float> bias(static_cast<size_t>(policy.num_outputs()), 0.5F);
    file.AddCopy<float>("output.bias", bias);
  });
  EXPECT_NE(moved.find("changed: self-check: expected output"), std::string::npos) << moved;
  const std::string output =
      ErrorAfter([](Tensors& file) { file.metadata["output"] = "telepathy"; });
  EXPECT_NE(output.find("output: expected one of levels, squashed-gaussian"), std::string::npos)
      << output;
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

INSTANTIATE_TEST_SUITE_P(All, ActorTest,
                         ::testing::Values(Case{ActionRule::kSquashedGaussian, D + 2},
                                           Case{ActionRule::kClippedGaussian, D},
                                           Case{ActionRule::kClippedGaussian, 0},
                                           Case{ActionRule::kCategorical, D}));

TEST(NetworkPolicy, PartsThatDoNotFitAreRefused) {
  NetworkPolicyParts parts = Parts(ActionRule::kClippedGaussian, D);
  parts.critic.inputs = D + 1;
  EXPECT_THROW(NetworkPolicy(parts, PolicyInfo()), Error);
  parts = Parts(ActionRule::kCategorical, D);
  parts.torques.clear();
  EXPECT_THROW(NetworkPolicy(parts, PolicyInfo()), Error);
  parts = Parts(ActionRule::kSquashedGaussian, 0);
  parts.parameters.pop_back();
  EXPECT_THROW(NetworkPolicy(parts, PolicyInfo()), Error);
}

// ---- Q-networks.

const NetworkShape kShape{8, {16, 16}, 3, true, Activation::kRelu, 4};

class QNetworkTest : public ::testing::Test {
 protected:
  static NetworkPolicy MakePolicy() {
    NetworkPolicyParts parts{ActionRule::kLevels, kShape};
    parts.parameters.resize(Network(kShape).num_parameters());
    parts.torques = {-2, 0, 2};
    Rng rng(1, "policy test");
    Network(kShape).Initialize(rng, parts.parameters);
    PolicyInfo info;
    info.agent = "tested";
    info.plant = {{"gravity", 9.81}};
    return {parts, info};
  }

  /// Saves a policy, alters the file's tensors and metadata with `change`, and loads it. Returns
  /// the error message.
  template <typename Change>
  std::string ErrorAfter(const Change& change) {
    const Tensors file = MakePolicy().ToTensors();
    Tensors changed;
    changed.metadata = file.metadata;
    std::map<std::string, std::vector<float>> floats;
    for (const auto& [name, tensor] : file.all()) {
      if (tensor.dtype != Dtype::kF32) continue;
      auto& values = floats[name];
      values.resize(tensor.bytes.size() / sizeof(float));
      file.Read(name, std::span(values));
    }
    std::vector<double> torques(3), sample_torque(file.Count<double>("sample.torque"));
    file.Read("torques", std::span(torques));
    file.Read("sample.torque", std::span(sample_torque));
    std::map<std::string, std::vector<int64_t>> shapes;
    for (const auto& [name, tensor] : file.all()) shapes[name] = tensor.shape;
    change(floats, shapes, changed.metadata);
    for (const auto& [name, values] : floats) changed.Add<float>(name, values, shapes[name]);
    changed.Add<double>("torques", torques);
    changed.Add<double>("sample.torque", sample_torque);
    try {
      NetworkPolicy::From(ReadSafetensors(WriteSafetensors(changed).Joined(), "changed"));
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      return error.what();
    }
    return "";
  }
};

TEST_F(QNetworkTest, LoadsASavedPolicyToTheBit) {
  const NetworkPolicy policy = MakePolicy();
  const NetworkPolicy loaded =
      NetworkPolicy::From(ReadSafetensors(WriteSafetensors(policy.ToTensors()).Joined(), "saved"));
  EXPECT_EQ(loaded.parts().shape, kShape);
  EXPECT_EQ(loaded.info().agent, "tested");
  EXPECT_EQ(loaded.info().plant.at("gravity"), 9.81);
  EXPECT_TRUE(loaded.self_check().has_checksum);
  EXPECT_EQ(loaded.self_check().error, 0);
  Rng rng(2, "obs");
  std::vector<float> obs(300 * 8), q(300 * 3), q_loaded(300 * 3);  // more than one block of rows
  for (float& x : obs) x = static_cast<float>(rng.Normal());
  const Matrix<const float> rows(obs.data(), 300, 8);
  policy.Values(rows, Matrix<float>(q.data(), 300, 3), *policy.Start(300));
  loaded.Values(rows, Matrix<float>(q_loaded.data(), 300, 3), *loaded.Start(300));
  EXPECT_EQ(q, q_loaded);
  std::vector<double> torque(300);
  loaded.Act(rows, Matrix<double>(torque.data(), 300, 1), *loaded.Start(300));
  for (size_t i = 0; i < 300; ++i) {
    const int best = ArgMax(std::span(q).subspan(3 * i, 3));
    EXPECT_EQ(torque[i], (std::vector<double>{-2, 0, 2})[static_cast<size_t>(best)]);
  }
}

TEST_F(QNetworkTest, RoundedItsFileHasAboutHalfTheSizeAndTheValuesAreNearlyTheSame) {
  const NetworkPolicy policy = MakePolicy();
  Tensors file = policy.Rounded().ToTensors();
  const size_t before = WriteSafetensors(file).Joined().size();
  file.Narrow();
  for (const auto& [name, tensor] : file.all()) {
    const bool is_parameter = name.ends_with(".weight") || name.ends_with(".bias");
    EXPECT_EQ(tensor.dtype == Dtype::kBF16, is_parameter) << name;
  }
  const std::vector<std::byte> bytes = WriteSafetensors(file).Joined();
  // The sizes differ by the parameters and a few bytes of the header, which names their type.
  EXPECT_NEAR(before - bytes.size(), 2 * policy.num_parameters(), 64);

  const NetworkPolicy loaded = NetworkPolicy::From(ReadSafetensors(bytes, "saved"));
  EXPECT_EQ(loaded.self_check().error, 0);
  const std::vector<float> obs(8, 0.5F);
  std::vector<float> q(3), rounded(3);
  policy.Values({obs.data(), 1, 8}, {q.data(), 1, 3}, *policy.Start(1));
  loaded.Values({obs.data(), 1, 8}, {rounded.data(), 1, 3}, *loaded.Start(1));
  EXPECT_NE(q, rounded);
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(q[i], rounded[i], 0.03);
}

TEST_F(QNetworkTest, AnUnchangedCopyLoads) {
  EXPECT_EQ(ErrorAfter([](auto&, auto&, auto&) {}), "");
}

TEST_F(QNetworkTest, RefusesAnotherFormatVersionOrOutput) {
  for (const char* key : {"format", "format_version", "output"}) {
    const std::string error =
        ErrorAfter([&](auto&, auto&, auto& metadata) { metadata[key] = "other"; });
    EXPECT_NE(error.find(key), std::string::npos) << error;
    EXPECT_NE(ErrorAfter([&](auto&, auto&, auto& metadata) { metadata.erase(key); }), "");
  }
  EXPECT_NE(ErrorAfter([](auto&, auto&, auto& metadata) { metadata["network"] = "{}"; }), "");
  EXPECT_NE(ErrorAfter([](auto&, auto&, auto& metadata) { metadata["network"] = "x"; }), "");
}

TEST_F(QNetworkTest, RefusesWrongShapesMissingTensorsAndNumbersThatAreNotFinite) {
  const std::string shape = ErrorAfter(
      [](auto&, auto& shapes, auto&) { std::ranges::reverse(shapes["feature.0.weight"]); });
  EXPECT_NE(shape.find("expected F32 [16, 8], got F32 [8, 16]"), std::string::npos) << shape;
  EXPECT_NE(ErrorAfter([](auto& floats, auto&, auto&) { floats.erase("value.bias"); }), "");
  const std::string nan = ErrorAfter([](auto& floats, auto&, auto&) {
    floats["feature.1.weight"][7] = std::numeric_limits<float>::quiet_NaN();
  });
  EXPECT_NE(nan.find("feature.1.weight"), std::string::npos) << nan;
}

TEST_F(QNetworkTest, TheSelfCheckFindsAParameterThatIsNotTheOneThatWasSaved) {
  const std::string error =
      ErrorAfter([](auto& floats, auto&, auto&) { floats["value.bias"][0] += 0.01F; });
  EXPECT_NE(error.find("self-check"), std::string::npos) << error;
}

TEST_F(QNetworkTest, ANumberThatIsNotFiniteIsNotSaved) {
  NetworkPolicyParts parts = MakePolicy().parts();
  parts.parameters[9] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(NetworkPolicy(parts, {}).ToTensors(), Error);
}

}  // namespace
}  // namespace upswing

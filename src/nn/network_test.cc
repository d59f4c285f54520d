#include "nn/network.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "base/error.h"

namespace upswing {
namespace {

constexpr Real kUnwritten = Real(1e30);  // marks numbers that a gradient did not write
constexpr double kRounding = std::numeric_limits<Real>::epsilon();

struct NetworkCase {
  const char* name;
  NetworkShape shape;
};

class NetworkTest : public ::testing::TestWithParam<NetworkCase> {};

/// f = Σ dy · y as a function of parameters and inputs. B rows, D inputs, A outputs.
struct Objective {
  Network network;
  Network::Activations activations;
  AlignedVector<Real> parameters, x, dy, y;
  int B, D, A;

  Objective(const NetworkCase& c, int batch)
      : network(c.shape),
        activations(network.MakeActivations(batch, true)),
        parameters(network.num_parameters()),
        x(static_cast<size_t>(batch * c.shape.inputs)),
        dy(static_cast<size_t>(batch * c.shape.outputs)),
        y(dy.size()),
        B(batch),
        D(c.shape.inputs),
        A(c.shape.outputs) {
    Rng rng(3, "network test");
    network.Initialize(rng, parameters);
    // Move gains and biases of the layer norm away from 1 and 0, so that they affect the result.
    for (const ParameterBlock& block : network.blocks()) {
      if (block.name.find("norm") == std::string::npos) continue;
      for (size_t i = 0; i < block.size(); ++i) {
        parameters[block.offset + i] += static_cast<Real>(0.3 * rng.Normal());
      }
    }
    for (Real& value : x) value = static_cast<Real>(rng.Normal());
    for (Real& value : dy) value = static_cast<Real>(rng.Normal());
  }

  Matrix<const Real> X() const { return {x.data(), B, D}; }
  Matrix<const Real> DY() const { return {dy.data(), B, A}; }

  Real Value() {
    network.Forward(parameters, X(), {0, B}, activations, Matrix<Real>(y, B, A));
    return std::inner_product(y.begin(), y.end(), dy.begin(), Real{0});
  }

  /// Gradient of f with respect to the parameters, and with respect to the inputs if there is a
  /// `dx` (B × D).
  AlignedVector<Real> Gradient(Matrix<Real> dx = {}) {
    Value();
    AlignedVector<Real> gradient(parameters.size(), kUnwritten);
    network.Backward(parameters, X(), activations, DY(), gradient, dx);
    return gradient;
  }

  /// df/dp by central difference, where p is a parameter or an input. With h = 1e-6, the truncation
  /// error is ~h² and the rounding error ~1e-16/h.
  double Numeric(Real& p) {
    constexpr double h = 1e-6;
    const Real before = p;
    p = before + h;
    const double above = Value();
    p = before - h;
    const double below = Value();
    p = before;
    return (above - below) / (2 * h);
  }
};

#ifdef UPSWING_DOUBLE  // in float, roundings hide what a finite difference shows
TEST_P(NetworkTest, GradientMatchesFiniteDifferences) {
  Objective f(GetParam(), 7);
  const AlignedVector<Real> gradient = f.Gradient();
  // Compare the norm of the difference with the norm of the gradient, for each array. In a large
  // network, check every 37th number; 37 is coprime to all widths.
  const size_t stride = f.parameters.size() > 5000 ? 37 : 1;
  for (const ParameterBlock& block : f.network.blocks()) {
    double error = 0, norm = 0;
    for (size_t i = block.offset; i < block.offset + block.size(); i += stride) {
      const double numeric = f.Numeric(f.parameters[i]);
      error += std::pow(gradient[i] - numeric, 2);
      norm += std::pow(numeric, 2);
    }
    EXPECT_GT(norm, 0) << block.name;
    EXPECT_LE(std::sqrt(error), 1e-6 * std::sqrt(norm)) << block.name;
  }
}

TEST_P(NetworkTest, GradientOfTheInputsMatchesFiniteDifferences) {
  Objective f(GetParam(), 7);
  AlignedVector<Real> dx(f.x.size(), kUnwritten);
  const AlignedVector<Real> gradient = f.Gradient(Matrix<Real>(dx, f.B, f.D));
  EXPECT_EQ(gradient, f.Gradient());  // a request for dx changes nothing else
  double error = 0, norm = 0;
  for (size_t i = 0; i < dx.size(); ++i) {
    const double numeric = f.Numeric(f.x[i]);
    error += std::pow(dx[i] - numeric, 2);
    norm += std::pow(numeric, 2);
  }
  EXPECT_GT(norm, 0);
  EXPECT_LE(std::sqrt(error), 1e-6 * std::sqrt(norm));
}
#endif

/// y of one row x by the definition in docs/reference/policy-format.md, in double.
std::vector<double> Definition(const Network& network, std::span<const Real> parameters,
                               std::span<const Real> x) {
  const auto after = [](const LayerView& layer, const std::vector<double>& input) {
    std::vector<double> y(layer.b.begin(), layer.b.end());
    for (int i = 0; i < layer.out(); ++i) {
      for (int j = 0; j < layer.in(); ++j) y[i] += layer.W(j, i) * input[j];
    }
    double mean = 0, variance = 0;
    for (const double value : y) mean += value / layer.out();
    for (const double value : y) variance += (value - mean) * (value - mean) / layer.out();
    for (int i = 0; i < layer.out(); ++i) {
      if (layer.layer_norm()) {
        y[i] = (y[i] - mean) / std::sqrt(variance + 1e-5) * layer.gain[i] + layer.norm_bias[i];
      }
      if (layer.activation == Activation::kRelu) y[i] = std::max(y[i], 0.0);
      if (layer.activation == Activation::kTanh) y[i] = std::tanh(y[i]);
    }
    return y;
  };
  const std::vector<LayerView> layers = network.Views(parameters);
  const size_t hidden = network.shape().hidden.size();
  std::vector<double> features(x.begin(), x.end());
  for (size_t i = 0; i < hidden; ++i) features = after(layers[i], features);
  if (!network.shape().dueling()) return after(layers[hidden], features);
  const double V = after(layers[hidden + 1], after(layers[hidden], features))[0];
  std::vector<double> y = after(layers[hidden + 3], after(layers[hidden + 2], features));
  const double mean = std::accumulate(y.begin(), y.end(), 0.0) / static_cast<double>(y.size());
  for (double& A : y) A += V - mean;
  return y;
}

TEST_P(NetworkTest, OutputsFollowTheDefinitionAndRowsDoNotDependOnTheirBatch) {
  Objective f(GetParam(), 5);
  f.Value();
  const AlignedVector<Real> together = f.y;
  for (int i = 0; i < f.B; ++i) {
    f.network.Forward(f.parameters, f.X().Rows(i, 1), {0, 1}, f.activations,
                      Matrix<Real>(f.y, 1, f.A));
    const std::vector<double> expected = Definition(f.network, f.parameters, f.X().row(i));
    for (int k = 0; k < f.A; ++k) {
      EXPECT_EQ(f.y[k], together[i * f.A + k]);
      EXPECT_NEAR(f.y[k], expected[k], 800 * kRounding);
    }
  }
}

TEST_P(NetworkTest, SlicesOfTheBatchGiveTheSameBits) {
  Objective f(GetParam(), 7);
  AlignedVector<Real> whole_dx(f.x.size()), dx(f.x.size(), kUnwritten);
  const AlignedVector<Real> whole = f.Gradient(Matrix<Real>(whole_dx, f.B, f.D));
  const AlignedVector<Real> y = f.y;
  f.activations = f.network.MakeActivations(7, true);
  std::ranges::fill(f.y, Real{0});
  AlignedVector<Real> gradient(whole.size());
  AlignedVector<Real> transposed(f.parameters.size());
  for (int task = f.network.num_tasks() - 1; task >= 0; --task) {
    f.network.TransposeWeights(task, f.parameters, transposed);
  }
  for (const RowRange rows : {RowRange{4, 3}, RowRange{0, 4}}) {
    f.network.Forward(f.parameters, f.X(), rows, f.activations, Matrix<Real>(f.y, f.B, f.A));
    f.network.BackwardInputs(f.parameters, transposed, f.DY(), rows, f.activations,
                             Matrix<Real>(dx, f.B, f.D));
  }
  double squares = 0;
  for (int task = f.network.num_tasks() - 1; task >= 0; --task) {
    squares += f.network.BackwardWeights(task, f.X(), f.activations, gradient);
  }
  EXPECT_EQ(f.y, y);
  EXPECT_EQ(gradient, whole);
  EXPECT_EQ(dx, whole_dx);
  const double norm = std::inner_product(whole.begin(), whole.end(), whole.begin(), 0.0);
  EXPECT_NEAR(squares, norm, 4500 * kRounding * norm);
}

TEST_P(NetworkTest, PreferencesDifferFromOutputsByAConstantOfTheRow) {
  Objective f(GetParam(), 5);
  f.Value();
  AlignedVector<Real> preferences(f.y.size());
  f.network.ForwardPreferences(f.parameters, f.X(), {0, f.B}, f.activations,
                               Matrix<Real>(preferences, f.B, f.A));
  for (size_t i = 0; i < f.y.size(); ++i) {
    const size_t first = i / static_cast<size_t>(f.A) * static_cast<size_t>(f.A);
    EXPECT_NEAR(preferences[i] - preferences[first], f.y[i] - f.y[first], 4500 * kRounding);
  }
}

constexpr Activation kRelu = Activation::kRelu, kTanh = Activation::kTanh;
INSTANTIATE_TEST_SUITE_P(
    Shapes, NetworkTest,
    ::testing::Values(NetworkCase{"plain", {8, {16, 12}, 9}},
                      NetworkCase{"plain_norm", {8, {16, 12}, 9, true}},
                      NetworkCase{"plain_tanh", {8, {16, 12}, 9, false, kTanh}},
                      NetworkCase{"plain_tanh_norm", {8, {16, 12}, 9, true, kTanh}},
                      NetworkCase{"one_output", {8, {16, 12}, 1}},
                      NetworkCase{"dueling", {8, {16, 12}, 9, false, kRelu, 10}},
                      NetworkCase{"dueling_norm", {8, {16, 12}, 9, true, kRelu, 10}},
                      NetworkCase{"dueling_tanh", {8, {16, 12}, 9, false, kTanh, 10}},
                      NetworkCase{"one_layer", {3, {5}, 2, true, kRelu, 4}},
                      NetworkCase{"three_layers", {3, {5, 17, 6}, 2, true, kRelu, 9}},
                      // Layers of 130 and 70 inputs have three and two tasks.
                      NetworkCase{"split_layers", {8, {130}, 9, true, kRelu, 70}}),
    [](const auto& info) { return info.param.name; });

TEST_P(NetworkTest, AShiftMovesAllOutputs) {
  Objective f(GetParam(), 5);
  f.Value();
  const AlignedVector<Real> before = f.y;
  f.network.ShiftOutputs(Real(0.75), f.parameters);
  f.Value();
  for (size_t i = 0; i < f.y.size(); ++i) EXPECT_NEAR(f.y[i], before[i] + Real(0.75), 1e-5);
}

TEST(Network, InitialWeightsFillTheirRange) {
  const Network network({8, {64}, 9, true, kRelu, 16});
  AlignedVector<Real> parameters(network.num_parameters());
  Rng rng(1, "init");
  network.Initialize(rng, parameters);
  for (const ParameterBlock& block : network.blocks()) {
    const auto values = std::span(parameters).subspan(block.offset, block.size());
    if (block.name.find("norm") != std::string::npos) {
      EXPECT_EQ(values[5], block.name.ends_with("weight") ? 1 : 0);
    }
    if (block.name != "feature.0.weight") continue;
    const auto [low, high] = std::ranges::minmax(values);
    EXPECT_GE(low, -1 / std::sqrt(8.0F));
    EXPECT_LT(low, -0.9F / std::sqrt(8.0F));
    EXPECT_LE(high, 1 / std::sqrt(8.0F));
    EXPECT_GT(high, 0.9F / std::sqrt(8.0F));
  }
}

TEST(Network, ParameterCountsOfThePublishedNetworks) {
  EXPECT_EQ(Network({8, {256, 256}, 9}).num_parameters(),
            8U * 256 + 256 + 256 * 256 + 256 + 256 * 9 + 9);
  EXPECT_EQ(Network({8, {256, 256}, 9, false, kRelu, 128}).num_parameters(),
            8U * 256 + 256 + 256 * 256 + 256 + 2 * (256 * 128 + 128) + 128 + 1 + 128 * 9 + 9);
}

TEST(Network, ParametersHaveTheNamesAndTheOrderOfPolicyFiles) {
  const auto names = [](const NetworkShape& shape) {
    std::vector<std::string> all;
    const Network network(shape);
    for (const ParameterBlock& block : network.blocks()) all.push_back(block.name);
    return all;
  };
  EXPECT_EQ(names({8, {7, 6}, 9}),
            (std::vector<std::string>{"feature.0.weight", "feature.0.bias", "feature.1.weight",
                                      "feature.1.bias", "output.weight", "output.bias"}));
  EXPECT_EQ(names({8, {7}, 9, true, kRelu, 5}),
            (std::vector<std::string>{"feature.0.weight", "feature.0.bias", "feature.0.norm.weight",
                                      "feature.0.norm.bias", "streams.weight", "streams.bias",
                                      "value.weight", "value.bias", "advantage.weight",
                                      "advantage.bias"}));
}

TEST(Network, DuelingIsTheValuePlusAdvantagesAboutTheirMean) {
  // With all weights zero, V and A are the last biases. V = 3, A = 1, 2, 6 → Q = 3 + (-2, -1, 3).
  const Network network({2, {4}, 3, false, kRelu, 2});
  AlignedVector<Real> parameters(network.num_parameters());
  for (const ParameterBlock& block : network.blocks()) {
    if (block.name == "value.bias") parameters[block.offset] = 3;
    if (block.name == "advantage.bias") {
      parameters[block.offset] = 1;
      parameters[block.offset + 1] = 2;
      parameters[block.offset + 2] = 6;
    }
  }
  auto activations = network.MakeActivations(1, false);
  const AlignedVector<Real> x{0.5, -0.5};
  AlignedVector<Real> q(3);
  network.Forward(parameters, Matrix<const Real>(x.data(), 1, 2), {0, 1}, activations,
                  Matrix<Real>(q, 1, 3));
  EXPECT_EQ(q, (AlignedVector<Real>{1, 2, 6}));  // mean(Q) = 3 = V
}

TEST(Network, RefusesInvalidSizes) {
  EXPECT_THROW(Network({0, {4}, 9}), Error);
  EXPECT_THROW(Network({8, {}, 9}), Error);
  EXPECT_THROW(Network({8, std::vector<int64_t>(17, 4), 9}), Error);
  EXPECT_THROW(Network({8, {1 << 20}, 9}), Error);
  EXPECT_THROW(Network({8, {4}, 0}), Error);
  EXPECT_THROW(Network({8, {4}, 9, false, kRelu, -1}), Error);
  EXPECT_THROW(Network({8, {4}, 9, false, kRelu, 1 << 20}), Error);
}

}  // namespace
}  // namespace upswing

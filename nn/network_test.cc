#include "nn/network.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "core/error.h"

namespace upswing {
namespace {

struct NetworkCase {
  const char* name;
  MlpShape trunk;
  HeadShape head;
};

class NetworkTest : public ::testing::TestWithParam<NetworkCase> {};

/// f = Σ dy · y as a function of parameters and inputs, in double. B rows, D inputs, A outputs.
struct Objective {
  Network<double> network;
  Network<double>::Activations activations;
  AlignedVector<double> parameters, x, dy, y;
  int B, D, A;

  Objective(const NetworkCase& c, int batch)
      : network(c.trunk, c.head),
        activations(network.MakeActivations(batch, true)),
        parameters(network.num_parameters()),
        x(static_cast<size_t>(batch * c.trunk.inputs)),
        dy(static_cast<size_t>(batch * c.head.outputs)),
        y(dy.size()),
        B(batch),
        D(c.trunk.inputs),
        A(c.head.outputs) {
    Rng rng(3, "network test");
    network.Initialize(rng, parameters);
    // Gains and biases of the layer norm away from 1 and 0, so that their part shows.
    for (const ParameterBlock& block : network.blocks()) {
      if (block.name.find("norm") == std::string::npos) continue;
      for (size_t i = 0; i < block.size(); ++i) parameters[block.offset + i] += 0.3 * rng.Normal();
    }
    for (double& value : x) value = rng.Normal();
    for (double& value : dy) value = rng.Normal();
  }

  Matrix<const double> X() const { return {x.data(), B, D}; }
  Matrix<const double> DY() const { return {dy.data(), B, A}; }

  double Value() {
    network.Forward({parameters}, X(), {0, B}, activations, Matrix<double>(y, B, A));
    return std::inner_product(y.begin(), y.end(), dy.begin(), 0.0);
  }

  /// With respect to the parameters, and to the inputs if there is a `dx` (B × D).
  AlignedVector<double> Gradient(Matrix<double> dx = {}) {
    Value();
    AlignedVector<double> gradient(parameters.size(), 1e300);  // all of it must be written
    network.Backward(parameters, X(), activations, DY(), gradient, dx);
    return gradient;
  }

  /// df/dp, where p is one of the parameters or inputs. Central difference with h = 1e-6:
  /// truncation ~h², rounding ~1e-16/h.
  double Numeric(double& p) {
    constexpr double h = 1e-6;
    const double before = p;
    p = before + h;
    const double above = Value();
    p = before - h;
    const double below = Value();
    p = before;
    return (above - below) / (2 * h);
  }
};

TEST_P(NetworkTest, GradientMatchesFiniteDifferences) {
  Objective f(GetParam(), 7);
  const AlignedVector<double> gradient = f.Gradient();
  // The norm of the difference is compared with that of the gradient, array by array; of a large
  // network, over every 37th number, which is coprime to all widths.
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
  AlignedVector<double> dx(f.x.size(), 1e300);
  const AlignedVector<double> gradient = f.Gradient(Matrix<double>(dx, f.B, f.D));
  EXPECT_EQ(gradient, f.Gradient());  // to ask for dx changes nothing else
  double error = 0, norm = 0;
  for (size_t i = 0; i < dx.size(); ++i) {
    const double numeric = f.Numeric(f.x[i]);
    error += std::pow(dx[i] - numeric, 2);
    norm += std::pow(numeric, 2);
  }
  EXPECT_GT(norm, 0);
  EXPECT_LE(std::sqrt(error), 1e-6 * std::sqrt(norm));
}

TEST_P(NetworkTest, FloatAgreesWithDoubleAndRowsWithTheirBatch) {
  Objective f(GetParam(), 5);
  f.Value();
  const Network<float> network(GetParam().trunk, GetParam().head);
  const AlignedVector<float> parameters(f.parameters.begin(), f.parameters.end());
  const AlignedVector<float> x(f.x.begin(), f.x.end());
  auto activations = network.MakeActivations(1, false);
  AlignedVector<float> y(static_cast<size_t>(f.A));
  const Matrix<const float> rows(x.data(), f.B, f.D);
  for (int i = 0; i < f.B; ++i) {
    network.Forward({parameters}, rows.Rows(i, 1), {0, 1}, activations, Matrix<float>(y, 1, f.A));
    for (size_t k = 0; k < y.size(); ++k) {
      EXPECT_NEAR(y[k], f.y[static_cast<size_t>(i) * y.size() + k], 1e-4);
    }
  }
}

TEST_P(NetworkTest, SlicesOfTheBatchGiveTheSameBits) {
  Objective f(GetParam(), 7);
  AlignedVector<double> whole_dx(f.x.size()), dx(f.x.size(), 1e300);
  const AlignedVector<double> whole = f.Gradient(Matrix<double>(whole_dx, f.B, f.D));
  const AlignedVector<double> y = f.y;
  f.activations = f.network.MakeActivations(7, true);
  std::ranges::fill(f.y, 0.0);
  AlignedVector<double> gradient(whole.size());
  auto prepared = f.network.MakePrepared();
  for (int task = f.network.num_tasks() - 1; task >= 0; --task) {
    f.network.Prepare(task, f.parameters, prepared);
  }
  for (const RowRange rows : {RowRange{4, 3}, RowRange{0, 4}}) {
    f.network.Forward({f.parameters}, f.X(), rows, f.activations, Matrix<double>(f.y, f.B, f.A));
    f.network.BackwardInputs({f.parameters, &prepared}, f.DY(), rows, f.activations,
                             Matrix<double>(dx, f.B, f.D));
  }
  double squares = 0;
  for (int task = f.network.num_tasks() - 1; task >= 0; --task) {
    squares += f.network.BackwardWeights(task, f.X(), f.activations, gradient);
  }
  EXPECT_EQ(f.y, y);
  EXPECT_EQ(gradient, whole);
  EXPECT_EQ(dx, whole_dx);
  const double norm = std::inner_product(whole.begin(), whole.end(), whole.begin(), 0.0);
  EXPECT_NEAR(squares, norm, 1e-12 * norm);
}

TEST_P(NetworkTest, PreferencesDifferFromOutputsByAConstantOfTheRow) {
  Objective f(GetParam(), 5);
  f.Value();
  AlignedVector<double> preferences(f.y.size());
  f.network.ForwardPreferences(f.parameters, f.X(), {0, f.B}, f.activations,
                               Matrix<double>(preferences, f.B, f.A));
  for (size_t i = 0; i < f.y.size(); ++i) {
    const size_t first = i / static_cast<size_t>(f.A) * static_cast<size_t>(f.A);
    EXPECT_NEAR(preferences[i] - preferences[first], f.y[i] - f.y[first], 1e-12);
  }
}

constexpr Activation kTanh = Activation::kTanh;
INSTANTIATE_TEST_SUITE_P(
    Shapes, NetworkTest,
    ::testing::Values(NetworkCase{"plain", {8, {16, 12}}, {9}},
                      NetworkCase{"plain_norm", {8, {16, 12}, true}, {9}},
                      NetworkCase{"plain_tanh", {8, {16, 12}, false, kTanh}, {9}},
                      NetworkCase{"plain_tanh_norm", {8, {16, 12}, true, kTanh}, {9}},
                      NetworkCase{"one_output", {8, {16, 12}}, {1}},
                      NetworkCase{"dueling", {8, {16, 12}}, {9, 10}},
                      NetworkCase{"dueling_norm", {8, {16, 12}, true}, {9, 10}},
                      NetworkCase{"dueling_tanh", {8, {16, 12}, false, kTanh}, {9, 10}},
                      NetworkCase{"one_layer", {3, {5}, true}, {2, 4}},
                      NetworkCase{"three_layers", {3, {5, 17, 6}, true}, {2, 9}},
                      // Layers of 130 and 70 inputs, which are three tasks and two.
                      NetworkCase{"split_layers", {8, {130}, true}, {9, 70}}),
    [](const auto& info) { return info.param.name; });

TEST(Network, InitialWeightsFillTheirRange) {
  const Network<float> network({8, {64}, true}, {9, 16});
  AlignedVector<float> parameters(network.num_parameters());
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

TEST(Network, RefusesInvalidSizes) {
  EXPECT_THROW(Network<float>({0, {4}}, {9}), Error);
  EXPECT_THROW(Network<float>({8, {}}, {9}), Error);
  EXPECT_THROW(Network<float>({8, std::vector<int64_t>(17, 4)}, {9}), Error);
  EXPECT_THROW(Network<float>({8, {1 << 20}}, {9}), Error);
  EXPECT_THROW(Network<float>({8, {4}}, {0}), Error);
  EXPECT_THROW(Network<float>({8, {4}}, {9, -1}), Error);
  EXPECT_THROW(Network<float>({8, {4}}, {9, 1 << 20}), Error);
}

}  // namespace
}  // namespace upswing

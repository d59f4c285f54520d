#include "nn/q_network.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "core/error.h"
#include "nn/bfloat16.h"

namespace upswing {
namespace {

struct NetworkCase {
  const char* name;
  QNetworkShape shape;
};

class QNetworkTest : public ::testing::TestWithParam<NetworkCase> {};

/// f = Σ dq · q as a function of the parameters, in double.
struct Objective {
  QNetwork<double> network;
  QNetwork<double>::Activations activations;
  AlignedVector<double> parameters, x, dq, q;
  int B;

  Objective(const QNetworkShape& shape, int batch)
      : network(shape),
        activations(network.MakeActivations(batch, true)),
        parameters(network.num_parameters()),
        x(static_cast<size_t>(batch * shape.inputs)),
        dq(static_cast<size_t>(batch * shape.actions)),
        q(dq.size()),
        B(batch) {
    Rng rng(3, "q network test");
    network.Initialize(rng, parameters);
    // Gains and biases of the layer norm away from 1 and 0, so that their part shows.
    for (const ParameterBlock& block : network.blocks()) {
      if (block.name.find("norm") == std::string::npos) continue;
      for (size_t i = 0; i < block.size(); ++i) parameters[block.offset + i] += 0.3 * rng.Normal();
    }
    for (double& value : x) value = rng.Normal();
    for (double& value : dq) value = rng.Normal();
  }

  double Value() {
    network.Forward({parameters}, Matrix<const double>(x.data(), B, network.shape().inputs), {0, B},
                    activations, Matrix<double>(q, B, network.shape().actions));
    return std::inner_product(q.begin(), q.end(), dq.begin(), 0.0);
  }

  AlignedVector<double> Gradient() {
    Value();
    AlignedVector<double> gradient(parameters.size(), 1e300);  // all of it must be written
    network.Backward(parameters, Matrix<const double>(x.data(), B, network.shape().inputs),
                     activations, Matrix<const double>(dq.data(), B, network.shape().actions),
                     gradient);
    return gradient;
  }
};

TEST_P(QNetworkTest, GradientMatchesFiniteDifferences) {
  Objective f(GetParam().shape, 7);
  const AlignedVector<double> gradient = f.Gradient();
  // Central differences with h = 1e-6: truncation ~h², rounding ~1e-16/h. The norm of the
  // difference is compared with that of the gradient, array by array; of a large network, over
  // every 37th number, which is coprime to all widths.
  constexpr double h = 1e-6;
  const size_t stride = f.parameters.size() > 5000 ? 37 : 1;
  for (const ParameterBlock& block : f.network.blocks()) {
    double error = 0, norm = 0;
    for (size_t i = block.offset; i < block.offset + block.size(); i += stride) {
      const double p = f.parameters[i];
      f.parameters[i] = p + h;
      const double above = f.Value();
      f.parameters[i] = p - h;
      const double below = f.Value();
      f.parameters[i] = p;
      const double numeric = (above - below) / (2 * h);
      error += std::pow(gradient[i] - numeric, 2);
      norm += std::pow(numeric, 2);
    }
    EXPECT_LE(std::sqrt(error), 1e-6 * std::sqrt(norm)) << block.name;
  }
}

TEST_P(QNetworkTest, FloatAgreesWithDoubleAndRowsWithTheirBatch) {
  Objective f(GetParam().shape, 5);
  f.Value();
  const QNetwork<float> network(GetParam().shape);
  const AlignedVector<float> parameters(f.parameters.begin(), f.parameters.end());
  const AlignedVector<float> x(f.x.begin(), f.x.end());
  auto activations = network.MakeActivations(1, false);
  AlignedVector<float> q(static_cast<size_t>(network.shape().actions));
  const Matrix<const float> rows(x.data(), 5, network.shape().inputs);
  for (int i = 0; i < 5; ++i) {
    network.Forward({parameters}, rows.Rows(i, 1), {0, 1}, activations,
                    Matrix<float>(q, 1, network.shape().actions));
    for (size_t a = 0; a < q.size(); ++a) {
      EXPECT_NEAR(q[a], f.q[static_cast<size_t>(i) * q.size() + a], 1e-4);
    }
  }
}

TEST_P(QNetworkTest, SlicesOfTheBatchGiveTheSameBits) {
  Objective f(GetParam().shape, 7);
  const AlignedVector<double> whole = f.Gradient();
  const AlignedVector<double> q = f.q;
  const Matrix<const double> x(f.x.data(), 7, f.network.shape().inputs);
  const Matrix<const double> dq(f.dq.data(), 7, f.network.shape().actions);
  auto prepared = f.network.MakePrepared(true);
  AlignedVector<double> gradient(whole.size());
  for (int task = f.network.num_tasks() - 1; task >= 0; --task) {
    f.network.Prepare(task, f.parameters, prepared);
  }
  for (const RowRange rows : {RowRange{3, 4}, RowRange{0, 1}, RowRange{1, 2}}) {
    f.network.Forward({f.parameters}, x, rows, f.activations, Matrix<double>(f.q, 7, dq.cols()));
    f.network.BackwardInputs({f.parameters, &prepared}, dq, rows, f.activations);
  }
  double squares = 0;
  for (int task = f.network.num_tasks() - 1; task >= 0; --task) {
    squares += f.network.BackwardWeights(task, x, f.activations, gradient);
  }
  EXPECT_EQ(f.q, q);
  EXPECT_EQ(gradient, whole);
  const double norm = std::inner_product(whole.begin(), whole.end(), whole.begin(), 0.0);
  EXPECT_NEAR(squares, norm, 1e-12 * norm);
}

TEST_P(QNetworkTest, PreferencesDifferFromQValuesByAConstantOfTheRow) {
  Objective f(GetParam().shape, 5);
  f.Value();
  AlignedVector<double> preferences(f.q.size());
  const Matrix<const double> x(f.x.data(), 5, f.network.shape().inputs);
  const auto A = static_cast<size_t>(f.network.shape().actions);
  f.network.ForwardPreferences(f.parameters, x, {0, 5}, f.activations,
                               Matrix<double>(preferences, 5, static_cast<int>(A)));
  for (size_t i = 0; i < f.q.size(); ++i) {
    const size_t first = i / A * A;
    EXPECT_NEAR(preferences[i] - preferences[first], f.q[i] - f.q[first], 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, QNetworkTest,
    ::testing::Values(NetworkCase{"plain", {8, 9, {16, 12}, 0, false, false}},
                      NetworkCase{"plain_norm", {8, 9, {16, 12}, 0, false, true}},
                      NetworkCase{"dueling", {8, 9, {16, 12}, 10, true, false}},
                      NetworkCase{"dueling_norm", {8, 9, {16, 12}, 10, true, true}},
                      NetworkCase{"one_layer", {3, 2, {5}, 4, true, true}},
                      NetworkCase{"three_layers", {3, 2, {5, 17, 6}, 9, true, true}},
                      // Layers of 130 and 70 inputs, which are three tasks and two.
                      NetworkCase{"split_layers", {8, 9, {130}, 70, true, true}}),
    [](const auto& info) { return info.param.name; });

TEST(QNetwork, Bfloat16FollowsFloatAndSlicesGiveTheSameBits) {
  if (Bfloat16Paths().empty()) GTEST_SKIP() << "no bfloat16 instructions on this processor";
  // 130 rows, 100 units: whole tiles and margins. The last slice has an odd number of rows.
  const QNetworkShape shape{8, 9, {100, 96}, 40, true, true};
  constexpr int B = 129;
  const QNetwork<float> network(shape, true);
  AlignedVector<float> parameters(network.num_parameters()), x(B * 8), dq(B * 9), q(B * 9);
  Rng rng(3, "bfloat16");
  network.Initialize(rng, parameters);
  for (float& value : x) value = static_cast<float>(rng.Normal());
  for (float& value : dq) value = static_cast<float>(rng.Normal());
  const Matrix<const float> X(x.data(), B, 8), DQ(dq.data(), B, 9);
  auto activations = network.MakeActivations(B, true);
  auto prepared = network.MakePrepared(true);
  for (int task = 0; task < network.num_tasks(); ++task) {
    network.Prepare(task, parameters, prepared);
  }
  const auto gradient_by = [&](const std::vector<RowRange>& slices) {
    AlignedVector<float> gradient(parameters.size());
    for (const RowRange rows : slices) {
      network.Forward({parameters, &prepared}, X, rows, activations, Matrix<float>(q, B, 9));
      network.BackwardInputs({parameters, &prepared}, DQ, rows, activations);
    }
    for (int task = 0; task < network.num_tasks(); ++task) {
      network.BackwardWeights(task, X, activations, gradient);
    }
    return gradient;
  };
  const auto gradient = gradient_by({{0, 64}, {64, 65}});
  const AlignedVector<float> q_bfloat16 = q;
  EXPECT_EQ(gradient_by({{64, 65}, {0, 64}}), gradient);

  // A bfloat16 has 8 bits: relative 2^-9 each. What is nearly 0 may pass a ReLU or not.
  const QNetwork<float> exact(shape);
  AlignedVector<float> exact_gradient(parameters.size());
  exact.Forward({parameters}, X, {0, B}, activations, Matrix<float>(q, B, 9));
  exact.Backward(parameters, X, activations, DQ, exact_gradient);
  const auto distance = [](const AlignedVector<float>& a, const AlignedVector<float>& b) {
    double error = 0, norm = 0;
    for (size_t i = 0; i < a.size(); ++i) {
      error += std::pow(a[i] - b[i], 2);
      norm += std::pow(b[i], 2);
    }
    return std::sqrt(error / norm);
  };
  EXPECT_LT(distance(q_bfloat16, q), 0.02);
  EXPECT_LT(distance(gradient, exact_gradient), 0.1);
  EXPECT_GT(distance(gradient, exact_gradient), 1e-5);  // it is rounded
}

TEST(QNetwork, ParameterCountsOfThePublishedNetworks) {
  EXPECT_EQ(QNetwork<float>({8, 9, {256, 256}, 0, false, false}).num_parameters(),
            8U * 256 + 256 + 256 * 256 + 256 + 256 * 9 + 9);
  EXPECT_EQ(QNetwork<float>({8, 9, {256, 256}, 128, true, false}).num_parameters(),
            8U * 256 + 256 + 256 * 256 + 256 + 2 * (256 * 128 + 128) + 128 + 1 + 128 * 9 + 9);
}

TEST(QNetwork, DuelingIsTheValuePlusAdvantagesAboutTheirMean) {
  // All weights zero: V and A are the last biases. V = 3, A = 1, 2, 6 → Q = 3 + (-2, -1, 3).
  const QNetwork<double> network({2, 3, {4}, 2, true, false});
  AlignedVector<double> parameters(network.num_parameters());
  for (const ParameterBlock& block : network.blocks()) {
    if (block.name == "value.bias") parameters[block.offset] = 3;
    if (block.name == "advantage.bias") {
      parameters[block.offset] = 1;
      parameters[block.offset + 1] = 2;
      parameters[block.offset + 2] = 6;
    }
  }
  auto activations = network.MakeActivations(1, false);
  const AlignedVector<double> x{0.5, -0.5};
  AlignedVector<double> q(3);
  network.Forward({parameters}, Matrix<const double>(x.data(), 1, 2), {0, 1}, activations,
                  Matrix<double>(q, 1, 3));
  EXPECT_EQ(q, (AlignedVector<double>{1, 2, 6}));  // mean(Q) = 3 = V
  EXPECT_DOUBLE_EQ((q[0] + q[1] + q[2]) / 3, 3);
}

TEST(QNetwork, InitialWeightsFillTheirRange) {
  const QNetwork<float> network({8, 9, {64}, 16, true, true});
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

TEST(QNetwork, RefusesInvalidSizes) {
  EXPECT_THROW(QNetwork<float>({0, 9, {4}, 0, false, false}), Error);
  EXPECT_THROW(QNetwork<float>({8, 9, {}, 0, false, false}), Error);
  EXPECT_THROW(QNetwork<float>({8, 9, {1 << 20}, 0, false, false}), Error);
  EXPECT_THROW(QNetwork<float>({8, 9, {4}, 0, true, false}), Error);
}

}  // namespace
}  // namespace upswing

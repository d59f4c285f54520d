#include "nn/q_policy.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/argmax.h"
#include "core/error.h"
#include "core/safetensors.h"
#include "core/testing.h"

namespace upswing {
namespace {

const QNetworkShape kShape{8, 3, {16, 16}, 4, true, true};

class QPolicyTest : public ::testing::Test {
 protected:
  static QPolicy MakePolicy() {
    const QNetwork<float> network(kShape);
    std::vector<float> parameters(network.num_parameters());
    Rng rng(1, "policy test");
    network.Initialize(rng, parameters);
    PolicyInfo info;
    info.agent = "tested";
    info.plant = {{"gravity", 9.81}};
    return {kShape, parameters, {-2, 0, 2}, info};
  }

  /// Saves a policy, lets `change` alter the file's tensors and metadata, and loads it.
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
      QPolicy::From(ReadSafetensors(WriteSafetensors(changed).Joined(), "changed"));
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      return error.what();
    }
    return "";
  }
};

TEST_F(QPolicyTest, LoadsWhatItSavedToTheBit) {
  const QPolicy policy = MakePolicy();
  const QPolicy loaded =
      QPolicy::From(ReadSafetensors(WriteSafetensors(policy.ToTensors()).Joined(), "saved"));
  EXPECT_EQ(loaded.shape(), kShape);
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

TEST_F(QPolicyTest, RoundedItsFileHasAboutHalfTheSizeAndTheValuesAreNearlyTheSame) {
  const QPolicy policy = MakePolicy();
  Tensors file = policy.Rounded().ToTensors();
  const size_t before = WriteSafetensors(file).Joined().size();
  file.Narrow();
  for (const auto& [name, tensor] : file.all()) {
    const bool is_parameter = name.ends_with(".weight") || name.ends_with(".bias");
    EXPECT_EQ(tensor.dtype == Dtype::kBF16, is_parameter) << name;
  }
  const std::vector<std::byte> bytes = WriteSafetensors(file).Joined();
  // But for the header, which says it.
  EXPECT_NEAR(before - bytes.size(), 2 * policy.num_parameters(), 64);

  const QPolicy loaded = QPolicy::From(ReadSafetensors(bytes, "saved"));
  EXPECT_EQ(loaded.self_check().error, 0);
  const std::vector<float> obs(8, 0.5F);
  std::vector<float> q(3), rounded(3);
  policy.Values({obs.data(), 1, 8}, {q.data(), 1, 3}, *policy.Start(1));
  loaded.Values({obs.data(), 1, 8}, {rounded.data(), 1, 3}, *loaded.Start(1));
  EXPECT_NE(q, rounded);
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(q[i], rounded[i], 0.03);
}

TEST_F(QPolicyTest, AnUnchangedCopyLoads) {
  EXPECT_EQ(ErrorAfter([](auto&, auto&, auto&) {}), "");
}

TEST_F(QPolicyTest, RefusesAnotherFormatVersionOrOutput) {
  for (const char* key : {"format", "format_version", "output"}) {
    const std::string error =
        ErrorAfter([&](auto&, auto&, auto& metadata) { metadata[key] = "other"; });
    EXPECT_NE(error.find(key), std::string::npos) << error;
    EXPECT_NE(ErrorAfter([&](auto&, auto&, auto& metadata) { metadata.erase(key); }), "");
  }
  EXPECT_NE(ErrorAfter([](auto&, auto&, auto& metadata) { metadata["network"] = "{}"; }), "");
  EXPECT_NE(ErrorAfter([](auto&, auto&, auto& metadata) { metadata["network"] = "x"; }), "");
}

TEST_F(QPolicyTest, RefusesWrongShapesMissingTensorsAndNumbersThatAreNotFinite) {
  const std::string shape = ErrorAfter(
      [](auto&, auto& shapes, auto&) { std::ranges::reverse(shapes["feature.0.weight"]); });
  EXPECT_NE(shape.find("expected F32 [16, 8], got F32 [8, 16]"), std::string::npos) << shape;
  EXPECT_NE(ErrorAfter([](auto& floats, auto&, auto&) { floats.erase("value.bias"); }), "");
  const std::string nan = ErrorAfter([](auto& floats, auto&, auto&) {
    floats["feature.1.weight"][7] = std::numeric_limits<float>::quiet_NaN();
  });
  EXPECT_NE(nan.find("feature.1.weight"), std::string::npos) << nan;
}

TEST_F(QPolicyTest, TheSelfCheckFindsAParameterThatIsNotTheOneThatWasSaved) {
  const std::string error =
      ErrorAfter([](auto& floats, auto&, auto&) { floats["value.bias"][0] += 0.01F; });
  EXPECT_NE(error.find("self-check"), std::string::npos) << error;
}

TEST_F(QPolicyTest, ANumberThatIsNotFiniteIsNotSaved) {
  const QNetwork<float> network(kShape);
  std::vector<float> parameters(network.num_parameters());
  parameters[9] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(QPolicy(kShape, parameters, {-2, 0, 2}, {}).ToTensors(), Error);
}

}  // namespace
}  // namespace upswing

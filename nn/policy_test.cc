#include "nn/policy.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "core/error.h"
#include "core/tensor_file.h"
#include "core/testing.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

const QNetworkShape kShape{8, 3, {16, 16}, 4, true, true};

class PolicyTest : public ::testing::Test {
 protected:
  static Policy MakePolicy() {
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
    MakePolicy().Save(path_);
    const TensorFile file = TensorFile::Load(path_);
    TensorFile changed;
    changed.metadata = file.metadata;
    std::map<std::string, std::vector<float>> floats;
    for (const auto& [name, tensor] : file.tensors()) {
      if (tensor.dtype != Dtype::kF32) continue;
      auto& values = floats[name];
      values.resize(tensor.bytes.size() / sizeof(float));
      file.Read(name, std::span(values));
    }
    std::vector<double> torques(3), sample_torque(file.Count<double>("sample.torque"));
    file.Read("torques", std::span(torques));
    file.Read("sample.torque", std::span(sample_torque));
    std::map<std::string, std::vector<int64_t>> shapes;
    for (const auto& [name, tensor] : file.tensors()) shapes[name] = tensor.shape;
    change(floats, shapes, changed.metadata);
    for (const auto& [name, values] : floats) changed.Add<float>(name, values, shapes[name]);
    changed.Add<double>("torques", torques);
    changed.Add<double>("sample.torque", sample_torque);
    changed.Save(path_);
    try {
      Policy::Load(path_);
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      return error.what();
    }
    return "";
  }

  TempFolder folder_;
  fs::path path_ = folder_ / "policy.safetensors";
};

TEST_F(PolicyTest, LoadsWhatItSavedToTheBit) {
  const Policy policy = MakePolicy();
  policy.Save(path_);
  const Policy loaded = Policy::Load(path_);
  EXPECT_EQ(loaded.shape(), kShape);
  EXPECT_EQ(loaded.info().agent, "tested");
  EXPECT_EQ(loaded.info().plant.at("gravity"), 9.81);
  EXPECT_TRUE(loaded.self_check().has_checksum);
  EXPECT_EQ(loaded.self_check().error, 0);
  Rng rng(2, "obs");
  std::vector<float> obs(300 * 8), q(300 * 3), q_loaded(300 * 3);  // more than one block of rows
  for (float& x : obs) x = static_cast<float>(rng.Normal());
  const Matrix<const float> rows(obs.data(), 300, 8);
  policy.QValues(rows, Matrix<float>(q.data(), 300, 3));
  loaded.QValues(rows, Matrix<float>(q_loaded.data(), 300, 3));
  EXPECT_EQ(q, q_loaded);
  std::vector<double> torque(300);
  loaded.Act(rows, torque);
  for (size_t i = 0; i < 300; ++i) {
    const int best = ArgMax(std::span(q).subspan(3 * i, 3));
    EXPECT_EQ(torque[i], (std::vector<double>{-2, 0, 2})[static_cast<size_t>(best)]);
  }
}

TEST_F(PolicyTest, AnUnchangedCopyLoads) {
  EXPECT_EQ(ErrorAfter([](auto&, auto&, auto&) {}), "");
}

TEST_F(PolicyTest, RefusesAnotherFormatVersionOrOutput) {
  for (const char* key : {"format", "format_version", "output"}) {
    const std::string error =
        ErrorAfter([&](auto&, auto&, auto& metadata) { metadata[key] = "other"; });
    EXPECT_NE(error.find(key), std::string::npos) << error;
    EXPECT_NE(ErrorAfter([&](auto&, auto&, auto& metadata) { metadata.erase(key); }), "");
  }
  EXPECT_NE(ErrorAfter([](auto&, auto&, auto& metadata) { metadata["network"] = "{}"; }), "");
  EXPECT_NE(ErrorAfter([](auto&, auto&, auto& metadata) { metadata["network"] = "x"; }), "");
}

TEST_F(PolicyTest, RefusesWrongShapesMissingTensorsAndNumbersThatAreNotFinite) {
  const std::string shape = ErrorAfter(
      [](auto&, auto& shapes, auto&) { std::ranges::reverse(shapes["feature.0.weight"]); });
  EXPECT_NE(shape.find("expected F32 [16, 8], got F32 [8, 16]"), std::string::npos) << shape;
  EXPECT_NE(ErrorAfter([](auto& floats, auto&, auto&) { floats.erase("value.bias"); }), "");
  const std::string nan = ErrorAfter([](auto& floats, auto&, auto&) {
    floats["feature.1.weight"][7] = std::numeric_limits<float>::quiet_NaN();
  });
  EXPECT_NE(nan.find("feature.1.weight"), std::string::npos) << nan;
}

TEST_F(PolicyTest, TheSelfCheckFindsAParameterThatIsNotTheOneThatWasSaved) {
  const std::string error =
      ErrorAfter([](auto& floats, auto&, auto&) { floats["value.bias"][0] += 0.01F; });
  EXPECT_NE(error.find("self-check"), std::string::npos) << error;
}

TEST_F(PolicyTest, ANumberThatIsNotFiniteIsNotSaved) {
  const QNetwork<float> network(kShape);
  std::vector<float> parameters(network.num_parameters());
  parameters[9] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(Policy(kShape, parameters, {-2, 0, 2}, {}).Save(path_), Error);
  EXPECT_FALSE(fs::exists(path_));
}

}  // namespace
}  // namespace upswing

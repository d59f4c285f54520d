#include "extras/deploy/onnx.h"

#include <gtest/gtest.h>
#include <onnx.pb.h>

#include <array>
#include <cstring>

namespace upswing::deploy {
namespace {

onnx::ModelProto Parse(const OnnxModel& model) {
  onnx::ModelProto parsed;
  EXPECT_TRUE(parsed.ParseFromString(model.Bytes()));
  return parsed;
}

TEST(Onnx, HoldsTheAddedParts) {
  OnnxModel model("graph", "1.2.3", "what it is");
  model.AddInput("x", 2, "in");
  model.AddOutput("y", 3, "out");
  const std::array<float, 6> values{1, -2, 0.5F, 0, 1e-30F, 6};
  EXPECT_EQ(model.AddConstant("W", values, {3, 2}), "W");
  EXPECT_EQ(model.AddNode(
                "y", "Gemm", {"x", "W"},
                {{"transB", int64_t{1}}, {"alpha", 0.0F}, {"axes", std::vector<int64_t>{0, -1}}}),
            "y");
  model.AddMetadata("key", "täxt");

  const onnx::ModelProto parsed = Parse(model);
  EXPECT_EQ(parsed.ir_version(), 8);
  ASSERT_EQ(parsed.opset_import_size(), 1);
  EXPECT_EQ(parsed.opset_import(0).version(), 17);
  EXPECT_EQ(parsed.producer_name(), "upswing");
  EXPECT_EQ(parsed.producer_version(), "1.2.3");
  ASSERT_EQ(parsed.metadata_props_size(), 1);
  EXPECT_EQ(parsed.metadata_props(0).value(), "täxt");

  const onnx::GraphProto& graph = parsed.graph();
  EXPECT_EQ(graph.name(), "graph");
  const auto& shape = graph.input(0).type().tensor_type().shape();
  EXPECT_EQ(shape.dim(0).dim_param(), "batch");
  EXPECT_EQ(shape.dim(1).dim_value(), 2);
  EXPECT_EQ(graph.output(0).type().tensor_type().shape().dim(1).dim_value(), 3);
  const onnx::TensorProto& W = graph.initializer(0);
  EXPECT_EQ(W.dims(0), 3);
  EXPECT_EQ(W.data_type(), onnx::TensorProto::FLOAT);
  ASSERT_EQ(W.raw_data().size(), sizeof(values));
  EXPECT_EQ(std::memcmp(W.raw_data().data(), values.data(), sizeof(values)), 0);

  // Attributes with the value 0 are written too.
  const onnx::NodeProto& node = graph.node(0);
  EXPECT_EQ(node.op_type(), "Gemm");
  EXPECT_EQ(node.output(0), "y");
  EXPECT_EQ(node.attribute(0).i(), 1);
  EXPECT_TRUE(node.attribute(1).has_f());
  EXPECT_EQ(node.attribute(1).type(), onnx::AttributeProto::FLOAT);
  EXPECT_EQ(node.attribute(2).ints(1), -1);
}

TEST(Onnx, IsTheSameEveryTime) {
  const auto bytes = [] {
    OnnxModel model("graph", "1", "");
    model.AddMetadata("b", "1");
    model.AddMetadata("a", "2");
    return model.Bytes();
  };
  EXPECT_EQ(bytes(), bytes());
}

}  // namespace
}  // namespace upswing::deploy

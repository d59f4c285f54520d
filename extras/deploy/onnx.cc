#include "extras/deploy/onnx.h"

#include <onnx.pb.h>  // generated from extras/deploy/onnx.proto

#include <bit>
#include <limits>

#include "base/error.h"

namespace upswing::deploy {
namespace {

constexpr int64_t kOpset = 17;     // first opset with LayerNormalization
constexpr int64_t kIrVersion = 8;  // IR version of opset 17
constexpr const char* kBatch = "batch";

static_assert(std::endian::native == std::endian::little, "raw_data is little-endian");

void SetMatrix(onnx::ValueInfoProto& value, const std::string& name, int size,
               const std::string& description) {
  value.set_name(name);
  value.set_doc_string(description);
  auto& tensor = *value.mutable_type()->mutable_tensor_type();
  tensor.set_elem_type(onnx::TensorProto::FLOAT);
  tensor.mutable_shape()->add_dim()->set_dim_param(kBatch);
  tensor.mutable_shape()->add_dim()->set_dim_value(size);
}

}  // namespace

struct OnnxModel::Proto {
  onnx::ModelProto model;
};

OnnxModel::OnnxModel(const std::string& name, const std::string& version,
                     const std::string& description)
    : proto_(std::make_unique<Proto>()) {
  onnx::ModelProto& model = proto_->model;
  model.set_ir_version(kIrVersion);
  model.set_producer_name("upswing");
  model.set_producer_version(version);
  model.set_doc_string(description);
  model.mutable_graph()->set_name(name);
  auto& opset = *model.add_opset_import();
  opset.set_domain("");
  opset.set_version(kOpset);
}

OnnxModel::~OnnxModel() = default;

void OnnxModel::AddInput(const std::string& name, int size, const std::string& description) {
  SetMatrix(*proto_->model.mutable_graph()->add_input(), name, size, description);
}

void OnnxModel::AddOutput(const std::string& name, int size, const std::string& description) {
  SetMatrix(*proto_->model.mutable_graph()->add_output(), name, size, description);
}

std::string OnnxModel::AddConstant(const std::string& name, std::span<const float> values,
                                   const std::vector<int64_t>& shape) {
  auto& tensor = *proto_->model.mutable_graph()->add_initializer();
  tensor.set_name(name);
  tensor.set_data_type(onnx::TensorProto::FLOAT);
  for (const int64_t size : shape) tensor.add_dims(size);
  tensor.set_raw_data(values.data(), values.size_bytes());
  return name;
}

std::string OnnxModel::AddNode(const std::string& name, const std::string& op,
                               const std::vector<std::string>& inputs,
                               const Attributes& attributes) {
  auto& node = *proto_->model.mutable_graph()->add_node();
  node.set_name(name);
  node.set_op_type(op);
  for (const std::string& input : inputs) node.add_input(input);
  node.add_output(name);
  for (const auto& [key, value] : attributes) {
    auto& attribute = *node.add_attribute();
    attribute.set_name(key);
    if (const auto* i = std::get_if<int64_t>(&value)) {
      attribute.set_type(onnx::AttributeProto::INT);
      attribute.set_i(*i);
    } else if (const auto* f = std::get_if<float>(&value)) {
      attribute.set_type(onnx::AttributeProto::FLOAT);
      attribute.set_f(*f);
    } else {
      attribute.set_type(onnx::AttributeProto::INTS);
      for (const int64_t i : std::get<std::vector<int64_t>>(value)) attribute.add_ints(i);
    }
  }
  return name;
}

void OnnxModel::AddMetadata(const std::string& key, const std::string& text) {
  auto& entry = *proto_->model.add_metadata_props();
  entry.set_key(key);
  entry.set_value(text);
}

std::string OnnxModel::Bytes() const {
  // Limit of protobuf.
  if (proto_->model.ByteSizeLong() > size_t{std::numeric_limits<int32_t>::max()}) {
    throw BadInput("ONNX: expected a policy of less than 2 GiB");
  }
  return proto_->model.SerializeAsString();
}

}  // namespace upswing::deploy

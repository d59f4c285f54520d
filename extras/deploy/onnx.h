#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace upswing::deploy {

/// A model in the ONNX format (https://onnx.ai) with operators of opset 17, built node by node.
/// Inputs and outputs are float matrices (batch × size) with any number of rows. Texts must be
/// UTF-8.
class OnnxModel {
 public:
  /// Begins a model of this name. `version` is the version of this program.
  OnnxModel(const std::string& name, const std::string& version, const std::string& description);
  ~OnnxModel();

  /// Adds an input, or an output that is made by the node of the same name.
  void AddInput(const std::string& name, int size, const std::string& description);
  void AddOutput(const std::string& name, int size, const std::string& description);

  /// Adds a row-major array of constants and returns its name.
  std::string AddConstant(const std::string& name, std::span<const float> values,
                          const std::vector<int64_t>& shape);

  using Attribute = std::variant<int64_t, float, std::vector<int64_t>>;
  using Attributes = std::vector<std::pair<std::string, Attribute>>;
  /// Adds an operator on the arrays called `inputs`. Returns `name`, the name of its result.
  std::string AddNode(const std::string& name, const std::string& op,
                      const std::vector<std::string>& inputs, const Attributes& attributes = {});

  void AddMetadata(const std::string& key, const std::string& text);

  /// The bytes of the file. Throws BadInput if they exceed the format's limit of 2 GiB.
  std::string Bytes() const;

 private:
  struct Proto;  // protobuf message, defined in onnx.cc
  std::unique_ptr<Proto> proto_;
};

}  // namespace upswing::deploy

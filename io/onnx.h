#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace upswing {

/// A model in ONNX's format (https://onnx.ai), operators of opset 17, made node by node. Inputs and
/// outputs are matrices of float (batch × size), with any number of rows. Texts have to be UTF-8.
class OnnxModel {
 public:
  /// A model of this name, made by this version of the program.
  OnnxModel(const std::string& name, const std::string& version, const std::string& description);
  ~OnnxModel();

  /// Adds an input, or an output that a node of this name makes.
  void AddInput(const std::string& name, int size, const std::string& description);
  void AddOutput(const std::string& name, int size, const std::string& description);

  /// Adds an array of constants, row-major; returns its name.
  std::string AddConstant(const std::string& name, std::span<const float> values,
                          const std::vector<int64_t>& shape);

  using Attribute = std::variant<int64_t, float, std::vector<int64_t>>;
  using Attributes = std::vector<std::pair<std::string, Attribute>>;
  /// Adds an operator on what these names stand for; returns the name of what it makes, `name`.
  std::string AddNode(const std::string& name, const std::string& op,
                      const std::vector<std::string>& inputs, const Attributes& attributes = {});

  void AddMetadata(const std::string& key, const std::string& text);

  /// The file. Throws BadInput if it would be larger than the format allows, 2 GiB.
  std::string Bytes() const;

 private:
  struct Proto;  // protobuf's message, which only the .cc knows
  std::unique_ptr<Proto> proto_;
};

}  // namespace upswing

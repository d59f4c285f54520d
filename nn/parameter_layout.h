#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "nn/layer.h"

namespace upswing {

/// A named parameter array within a network's flat parameters.
struct ParameterBlock {
  std::string name;  // such as "feature.0.weight"
  size_t offset;     // first number
  int in, out;       // a weight is (in × out); in is 0 for a vector of `out` numbers
  size_t size() const { return static_cast<size_t>(std::max(1, in)) * static_cast<size_t>(out); }
};

/// The flat parameters of a network: its layers one after another, and the tasks that they are cut
/// into.
template <typename T>
struct ParameterLayout {
  /// Some rows of one layer's weight. The first of a layer's tasks has its vectors too.
  struct Task {
    size_t layer;
    RowRange rows;
  };
  static constexpr int kTaskRows = 64;

  size_t size = 0;  // how many numbers the parameters are
  std::vector<ParameterBlock> blocks;
  std::vector<Layer<T>> layers;
  std::vector<Task> tasks;

  /// Adds a layer's NAME.weight, NAME.bias and, if layer_norm, NAME.norm.weight, NAME.norm.bias.
  Layer<T> Add(const std::string& name, const LayerShape& shape) {
    for (int first = 0; first < shape.in; first += kTaskRows) {
      tasks.push_back({layers.size(), {first, std::min(kTaskRows, shape.in - first)}});
    }
    layers.emplace_back(shape, size);
    AddBlock(name + ".weight", shape.in, shape.out);
    AddBlock(name + ".bias", 0, shape.out);
    if (shape.layer_norm) {
      AddBlock(name + ".norm.weight", 0, shape.out);
      AddBlock(name + ".norm.bias", 0, shape.out);
    }
    return layers.back();
  }

 private:
  void AddBlock(const std::string& name, int in, int out) {
    blocks.push_back({name, size, in, out});
    size += blocks.back().size();
  }
};

}  // namespace upswing

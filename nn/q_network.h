#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/text.h"
#include "nn/network.h"

namespace upswing {

/// The shape of a Q-network. D = observation size, A = number of actions.
struct QNetworkShape {
  static constexpr int64_t kMaxWidth = MlpShape::kMaxWidth;   // units of a layer, inputs, actions
  static constexpr size_t kMaxLayers = MlpShape::kMaxLayers;  // feature layers

  int inputs = 0;               // D
  int actions = 0;              // A
  std::vector<int64_t> hidden;  // widths of the feature layers, each with ReLU
  int64_t head = 0;             // width of each dueling stream's hidden layer
  bool dueling = false;     // Q = V + A - mean(A) (Wang et al., 2016, Eq 9) instead of one layer
  bool layer_norm = false;  // layer normalisation between each feature layer and its ReLU

  bool operator==(const QNetworkShape&) const = default;
};

/// A network from observations to Q-values.
///
///   plain:    D → hidden… → A
///   dueling:  D → hidden… → { head → 1,  head → A },  Q = V + A - mean(A)
template <typename T>
class QNetwork : public Network<T> {
 public:
  /// Throws BadInput on invalid sizes, and as Network does.
  explicit QNetwork(QNetworkShape shape)
      : Network<T>({shape.inputs, shape.hidden, shape.layer_norm}, {shape.actions, shape.head}),
        shape_(std::move(shape)) {
    if (shape_.dueling != (shape_.head > 0)) {
      throw BadInput(Concat("network: expected a head of at least one unit if it is dueling, and ",
                            "none else, got ", shape_.head));
    }
  }

  const QNetworkShape& shape() const { return shape_; }

 private:
  QNetworkShape shape_;
};

}  // namespace upswing

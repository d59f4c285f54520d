#pragma once

#include <span>
#include <vector>

namespace upswing {

/// A categorical critic. K logits represent a value: the mean of the centres of K equal bins,
/// weighted by the softmax. It learns the histogram of a Gaussian about the target (HL-Gauss;
/// Farebrother et al., 2024, Section 3.1). The standard deviation is 0.75 bins. Targets beyond the
/// ends are clamped.
class ValueBins {
 public:
  /// `count` bins from `low` to `high`. 0: no bins; the critic's one output is the value.
  ValueBins(int count, double low, double high);

  /// Number of outputs of a critic: K, or 1 without bins.
  int outputs() const { return count_ == 0 ? 1 : count_; }

  /// The value that the outputs (K) represent.
  float Value(std::span<const float> outputs) const;

  /// Loss for a target: cross-entropy, or half of the squared error without bins. Writes its
  /// gradient with respect to the outputs (K).
  float Loss(std::span<const float> outputs, float target, std::span<float> gradient) const;

  /// Writes the gradient of Value with respect to the outputs (K), times `scale`.
  void ValueGradient(std::span<const float> outputs, float scale, std::span<float> gradient) const;

 private:
  double Centre(size_t bin) const { return low_ + width_ * (static_cast<double>(bin) + 0.5); }

  int count_;
  double low_, width_;
};

}  // namespace upswing

#pragma once

#include <span>
#include <vector>

namespace upswing {

/// A categorical critic: K logits stand for a value, the mean of the centres of K equal bins under
/// their softmax. It learns the histogram of a Gaussian about the target (HL-Gauss; Farebrother et
/// al., 2024, Section 3.1), whose standard deviation is 0.75 bins. Targets beyond the ends are
/// clamped.
class ValueBins {
 public:
  /// `count` bins from `low` to `high`; 0: there is none, and one output is the value itself.
  ValueBins(int count, double low, double high);

  /// How many outputs a critic has: K, or 1.
  int outputs() const { return count_ == 0 ? 1 : count_; }

  /// The value that these outputs (K) stand for.
  float Value(std::span<const float> outputs) const;

  /// The loss for a target: cross-entropy, or half of the squared error; writes its gradient with
  /// respect to the outputs (K).
  float Loss(std::span<const float> outputs, float target, std::span<float> gradient) const;

  /// d Value / d outputs (K), times `scale`.
  void ValueGradient(std::span<const float> outputs, float scale, std::span<float> gradient) const;

 private:
  double Centre(size_t bin) const { return low_ + width_ * (static_cast<double>(bin) + 0.5); }

  int count_;
  double low_, width_;
};

}  // namespace upswing

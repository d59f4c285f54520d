#include "rl/ppo/normalizer.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace upswing {
namespace {

constexpr int64_t kMost = 1'000'000'000'000'000;  // more observations than any training makes

}  // namespace

Normalizer::Normalizer(int obs_size)
    : mean_(obs_size), squares_(mean_.size()), center_(mean_.size()), scale_(mean_.size(), 1.0F) {}

void Normalizer::Add(Matrix<const float> obs) {
  if (obs.rows() == 0) return;
  const double before = static_cast<double>(count_);
  const double added = obs.rows();
  for (int k = 0; k < obs.cols(); ++k) {
    double sum = 0, squares = 0;
    for (int i = 0; i < obs.rows(); ++i) sum += obs(i, k);
    const double mean = sum / added;
    for (int i = 0; i < obs.rows(); ++i) squares += (obs(i, k) - mean) * (obs(i, k) - mean);
    const auto column = static_cast<size_t>(k);
    const double difference = mean - mean_[column];
    mean_[column] += difference * added / (before + added);
    squares_[column] += squares + difference * difference * before * added / (before + added);
  }
  count_ += obs.rows();
  Update();
}

std::vector<double> Normalizer::deviation() const {
  std::vector<double> deviation(mean_.size(), 1.0);
  if (count_ == 0) return deviation;
  for (size_t k = 0; k < mean_.size(); ++k) {
    const double variance = squares_[k] / static_cast<double>(count_);
    deviation[k] = std::max(kLeastDeviation, std::sqrt(variance));
  }
  return deviation;
}

void Normalizer::Update() {
  const std::vector<double> deviations = deviation();
  for (size_t k = 0; k < mean_.size(); ++k) {
    center_[k] = static_cast<float>(mean_[k]);
    scale_[k] = static_cast<float>(1 / deviations[k]);
  }
}

void Normalizer::State(const Archive& archive) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  archive.Scalar("count", count_, {0, kMost});
  archive.Array("mean", std::span(mean_), {-kLargest, kLargest});
  archive.Array("squares", std::span(squares_), {0, std::numeric_limits<double>::max()});
  if (archive.loading()) Update();
}

}  // namespace upswing

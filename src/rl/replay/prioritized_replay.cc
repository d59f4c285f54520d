// Prioritised replay (Schaul et al., 2016).
#include <algorithm>
#include <cmath>

#include "rl/replay/replay.h"
#include "rl/replay/slices.h"

namespace upswing {

void Replay::SamplePrioritized(Rng& rng, double beta, ThreadPool& pool, Minibatch& batch) const {
  const size_t B = batch.reward.size();
  const double part = priorities_->total() / static_cast<double>(B);
  double smallest = largest_priority_;
  std::vector<double> masses(B);
  for (size_t i = 0; i < B; ++i) masses[i] = part * (static_cast<double>(i) + rng.Uniform());
  ForSlices(pool, batch.size(), [&](RowRange rows) {
    priorities_->Find(Part(masses, rows), Part(batch.index, rows));
    Gather(rows, batch);
  });
  for (const int64_t index : batch.index) smallest = std::min(smallest, priority(index));
  // N and Σ p cancel in the ratio to the largest weight, which belongs to the smallest priority.
  for (size_t i = 0; i < B; ++i) {
    batch.weight[i] = static_cast<float>(std::pow(smallest / priority(batch.index[i]), beta));
  }
}

void Replay::Prioritize(const Minibatch& batch, std::span<const float> td_error, double alpha) {
  for (size_t i = 0; i < td_error.size(); ++i) {
    const double p = std::pow(std::abs(td_error[i]) + 1e-6, alpha);
    largest_priority_ = std::max(largest_priority_, p);
    priorities_->Set(batch.index[i], p);
  }
}

}  // namespace upswing

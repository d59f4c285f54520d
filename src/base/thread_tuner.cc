#include "base/thread_tuner.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

namespace upswing {
namespace {

constexpr int kBlock = 4;            // number of calls that are timed together
constexpr int kRounds = 5;           // blocks of each choice in a trial; the fastest counts
constexpr double kWorthwhile = .95;  // ratio of times below which more threads are worth it
constexpr double kTrialShare = .01;  // share of the time that goes into trials
constexpr double kNever = std::numeric_limits<double>::infinity();

double SteadySeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

ThreadTuner::ThreadTuner(ThreadPool* pool, std::function<double()> clock)
    : pool_(pool != nullptr && pool->adapts() && pool->threads() > 1 ? pool : nullptr),
      clock_(clock ? std::move(clock) : SteadySeconds) {
  if (pool_ == nullptr) return;
  for (int threads = 2; threads < pool_->threads(); threads *= 2) choices_.push_back(threads);
  choices_.push_back(pool_->threads());
  fastest_.assign(choices_.size(), kNever);
}

size_t ThreadTuner::candidate() const {
  return static_cast<size_t>(calls_ / kBlock) % choices_.size();
}

void ThreadTuner::Begin() {
  pool_->Use(choices_[until_trial_ > 0 ? chosen_ : candidate()]);
  begin_ = clock_();
}

void ThreadTuner::End() {
  const double seconds = clock_() - begin_;
  if (until_trial_ > 0) {
    until_trial_ -= seconds;
    return;
  }
  trial_seconds_ += seconds;
  block_seconds_ += seconds;
  double& fastest = fastest_[candidate()];
  if (++calls_ % kBlock != 0) return;
  fastest = std::min(fastest, block_seconds_);
  block_seconds_ = 0;
  if (calls_ < kBlock * kRounds * static_cast<int>(choices_.size())) return;
  // The trial ends. Fewer threads are enough if they are nearly as fast as the fastest number.
  const double enough = *std::ranges::min_element(fastest_) / kWorthwhile;
  const auto first = std::ranges::find_if(fastest_, [&](double x) { return x <= enough; });
  chosen_ = static_cast<size_t>(first - fastest_.begin());
  std::ranges::fill(fastest_, kNever);
  calls_ = 0;
  until_trial_ = trial_seconds_ / kTrialShare;
  trial_seconds_ = 0;
}

}  // namespace upswing

#include "base/thread_tuner.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace upswing {
namespace {

constexpr int kBlock = 4;   // number of calls that are timed together
constexpr int kRounds = 7;  // pairs of blocks per trial; the median of their ratios decides
// A ratio above this, or below its inverse for more threads, decides in one round.
constexpr double kClear = 1.3;
constexpr double kWorthwhile = .95;  // ratio below which more threads are worth it
constexpr double kTrialShare = .01;  // share of the time that goes into trials

double SteadySeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

ThreadTuner::ThreadTuner(ThreadPool* pool, std::function<double()> clock)
    : pool_(pool != nullptr && pool->adapts() && pool->threads() > 1 ? pool : nullptr),
      clock_(clock ? std::move(clock) : SteadySeconds) {
  if (pool_ == nullptr) return;
  for (int threads = 1; threads < pool_->threads(); threads *= 2) choices_.push_back(threads);
  choices_.push_back(pool_->threads());
  candidate_ = 1;
}

int ThreadTuner::threads() const { return choices_.empty() ? 1 : choices_[chosen_]; }

void ThreadTuner::Begin() {
  const bool tries_candidate = candidate_ != chosen_ && calls_ >= kBlock;
  pool_->Use(choices_[tries_candidate ? candidate_ : chosen_]);
  begin_ = clock_();
}

void ThreadTuner::End() {
  const double seconds = clock_() - begin_;
  if (candidate_ == chosen_) {
    until_trial_ -= seconds;
    if (until_trial_ > 0) return;
    upwards_ = chosen_ + 1 < choices_.size();
    candidate_ = upwards_ ? chosen_ + 1 : chosen_ - 1;
    return;
  }
  trial_seconds_ += seconds;
  seconds_[calls_ < kBlock ? 0 : 1] += seconds;
  if (++calls_ == 2 * kBlock) Compare();
}

void ThreadTuner::Compare() {
  ratios_.push_back(seconds_[1] / seconds_[0]);
  seconds_ = {};
  calls_ = 0;
  const double ratio = ratios_.back();
  const bool clear = ratio > kClear || (upwards_ && ratio < 1 / kClear);
  if ((clear && ratios_.size() == 1) || ratios_.size() == kRounds) NextCandidate();
}

void ThreadTuner::NextCandidate() {
  std::ranges::nth_element(ratios_, ratios_.begin() + static_cast<int>(ratios_.size()) / 2);
  const double ratio = ratios_[ratios_.size() / 2];
  ratios_.clear();
  // More threads must be faster by a margin. Fewer threads must only not be slower by that margin.
  const bool better = ratio < (upwards_ ? kWorthwhile : 1 / kWorthwhile);
  if (better) chosen_ = candidate_;
  if (better && upwards_ && chosen_ + 1 < choices_.size()) {
    candidate_ = chosen_ + 1;
    return;
  }
  if (!better && upwards_ && chosen_ > 0) {
    upwards_ = false;
    candidate_ = chosen_ - 1;
    return;
  }
  if (better && !upwards_ && chosen_ > 0) {
    candidate_ = chosen_ - 1;
    return;
  }
  candidate_ = chosen_;
  until_trial_ = trial_seconds_ / kTrialShare;
  trial_seconds_ = 0;
}

}  // namespace upswing

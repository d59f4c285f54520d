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

/// 1, 2, 4, … and `most` threads.
std::vector<int> ChoicesUpTo(int most) {
  std::vector<int> choices;
  for (int threads = 1; threads < most; threads *= 2) choices.push_back(threads);
  choices.push_back(most);
  return choices;
}

double SteadySeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

ThreadTuner::ThreadTuner(ThreadPool* pool, std::function<double()> clock)
    : pool_(pool != nullptr && pool->adapts() && pool->threads() > 1 ? pool : nullptr),
      clock_(clock ? std::move(clock) : SteadySeconds) {}

size_t ThreadTuner::Choice::candidate() const {
  return static_cast<size_t>(calls / kBlock) % choices.size();
}

void ThreadTuner::Begin() {
  Choice& now = current();
  if (now.fastest.empty()) {
    now.choices = ChoicesUpTo(std::max(1, pool_->threads() - pool_->lent()));
    now.fastest.assign(now.choices.size(), kNever);
  }
  pool_->Use(now.choices[now.until_trial > 0 ? now.chosen : now.candidate()]);
  begin_ = clock_();
}

void ThreadTuner::End() {
  Choice& now = current();
  const double seconds = clock_() - begin_;
  if (now.until_trial > 0) {
    now.until_trial -= seconds;
    return;
  }
  now.trial_seconds += seconds;
  now.block_seconds += seconds;
  double& fastest = now.fastest[now.candidate()];
  if (++now.calls % kBlock != 0) return;
  fastest = std::min(fastest, now.block_seconds);
  now.block_seconds = 0;
  if (now.calls < kBlock * kRounds * static_cast<int>(now.choices.size())) return;
  // The trial ends. Fewer threads are enough if they are nearly as fast as the fastest number.
  const double enough = *std::ranges::min_element(now.fastest) / kWorthwhile;
  const auto first = std::ranges::find_if(now.fastest, [&](double x) { return x <= enough; });
  now.chosen = static_cast<size_t>(first - now.fastest.begin());
  std::ranges::fill(now.fastest, kNever);
  now.calls = 0;
  now.until_trial = now.trial_seconds / kTrialShare;
  now.trial_seconds = 0;
}

}  // namespace upswing

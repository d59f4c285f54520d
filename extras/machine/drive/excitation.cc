#include "extras/machine/drive/excitation.h"

#include <algorithm>
#include <cmath>

namespace upswing::machine {

double Excitation::operator()(int64_t /*step*/, const PendulumState& state) {
  constexpr double kGrowth = 1.035, kDecay = 0.7;  // of the amplitude in a step; beyond the level
  constexpr double kEnough = 0.7;                  // level up to which the amplitude grows
  constexpr int kShortest = 3, kLongest = 15;      // time for which a share is held, steps
  constexpr double kAlong = 0.6;                   // probability of a push along with the motion
  const double level = level_(state);
  const double w = joint_ == 1 ? state.w1 : state.w2;
  --held_;
  if (held_ < 0) {
    held_ = kShortest + static_cast<int>(rng_.Uniform(0, kLongest - kShortest));
    share_ = rng_.Uniform(-1, 1);
    along_ = rng_.Uniform() < kAlong;
  }
  // Beyond the level, brake with the amplitude that led there, and push less from then on.
  if (level >= 1) {
    if (!braking_) amplitude_ = std::max(kDecay * amplitude_, kFirst * limit_);
    braking_ = true;
    return -amplitude_ * std::tanh(w / slow_);
  }
  braking_ = false;
  if (level < kEnough) amplitude_ = std::min(kGrowth * amplitude_, limit_);
  const double share = along_ && std::abs(w) > slow_ ? std::copysign(share_, w) : share_;
  return share * amplitude_;
}

}  // namespace upswing::machine

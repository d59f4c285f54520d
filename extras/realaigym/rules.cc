#include "extras/realaigym/rules.h"

#include <numbers>
#include <numeric>

#include "base/rng.h"

namespace upswing::realaigym {
namespace {

/// Draws six pushes with growing times, and keeps three random ones for the motor's joint. Pushes
/// about the other joint have no effect there (docs/howto/realaigym.md).
std::array<BoardPush, 3> RandomPushes(Rng& rng) {
  std::array<int, 6> order;
  std::iota(order.begin(), order.end(), 0);
  for (size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[rng.Below(i + 1)]);
  std::array<BoardPush, 6> all;
  double time = 0;
  for (BoardPush& push : all) {
    time += 1 + rng.Uniform(0, 0.5);
    push.time = time;
    push.width = rng.Uniform(0.05, 0.1);
    push.amplitude = rng.Uniform(0.5, 5) * (rng.Uniform() < 0.5 ? -1 : 1);
  }
  std::array<BoardPush, 3> ours;
  for (size_t k = 0; k < 3; ++k) ours[k] = all[order[k]];
  return ours;
}

}  // namespace

bool AtGoal(const PendulumState& state) {
  const auto [q1, q2, w1, w2] = state;
  return std::abs(Wrapped(q1 - std::numbers::pi)) < kBoardGoalAngle &&
         std::abs(Wrapped(q2)) < kBoardGoalAngle && std::abs(w1) < kBoardGoalVelocity &&
         std::abs(w2) < kBoardGoalVelocity;
}

std::array<double, 5> PerformancePenalties(const BoardOutcome& o, const ScoreScales& n) {
  const std::array<double, 5> scales{n.swing_up_seconds, n.energy, n.torque_cost, n.smoothness,
                                     n.velocity_cost};
  const std::array<double, 5> costs{o.swing_up_seconds, o.energy, o.torque_cost, o.smoothness,
                                    o.velocity_cost};
  std::array<double, 5> penalties;
  for (size_t i = 0; i < 5; ++i) {
    penalties[i] = std::tanh(std::numbers::pi * costs[i] / scales[i]);
  }
  return penalties;
}

double PerformanceScore(const BoardOutcome& outcome, const ScoreScales& scales) {
  if (!outcome.above_line) return 0;
  const auto penalties = PerformancePenalties(outcome, scales);
  return 1 - std::accumulate(penalties.begin(), penalties.end(), 0.0) / 5;
}

std::vector<RobustnessCase> RobustnessCases(uint64_t seed) {
  using enum RobustnessRow;
  std::vector<RobustnessCase> cases;
  Rng rng(seed, "realaigym: cases");
  const auto add = [&](RobustnessRow row, int parameter) -> RobustnessCase& {
    BoardEpisode episode;
    episode.seed = rng.Next();
    return cases.emplace_back(RobustnessCase{row, parameter, 0, episode});
  };
  // `vary` changes an episode by a level from 0 to 1, and returns the value of the varied quantity.
  const auto add_levels = [&](RobustnessRow row, int parameter, int repeats, const auto& vary) {
    for (int i = 0; i < kBoardLevels * repeats; ++i) {
      RobustnessCase& made = add(row, parameter);
      const int level = i / repeats;
      made.value = vary(made.episode, static_cast<double>(level) / (kBoardLevels - 1));
    }
  };
  for (int parameter = 0; parameter < static_cast<int>(kBoardVariations.size()); ++parameter) {
    const BoardVariation& varied = kBoardVariations.at(parameter);
    add_levels(kModel, parameter, 1, [&](BoardEpisode& e, double level) {
      const double value = varied.low + (varied.high - varied.low) * level;
      double& number = e.plant.*varied.parameter;
      number = varied.is_factor ? number * value : value;
      return value;
    });
  }
  add_levels(kVelocityNoise, 0, kBoardRepeats,
             [](BoardEpisode& e, double level) { return e.velocity_noise = 0.5 * level; });
  add_levels(kTorqueNoise, 0, kBoardRepeats,
             [](BoardEpisode& e, double level) { return e.torque_noise = 1.1 * level; });
  add_levels(kResponse, 0, 1,
             [](BoardEpisode& e, double level) { return e.response = 0.1 + (2 - 0.1) * level; });
  add_levels(kDelay, 0, 1, [](BoardEpisode& e, double level) {
    e.delay = static_cast<int>(std::lround(level * (kBoardLevels - 1)));
    return e.delay * kBoardTimestep;
  });
  for (int i = 0; i < kBoardPushCases; ++i) {
    BoardEpisode& episode = add(kPush, 0).episode;
    Rng pushes(episode.seed, "realaigym: pushes");
    episode.pushes = RandomPushes(pushes);
  }
  return cases;
}

double Robustness::score() const {
  return std::accumulate(rows.begin(), rows.end(), 0.0) / kRobustnessRows;
}

Robustness JudgeRobustness(const std::vector<RobustnessCase>& cases,
                           const std::vector<PendulumState>& ends) {
  Robustness result;
  std::vector<RobustnessCurve>& curves = result.curves;
  int count = 0;  // simulations at the last value
  for (size_t i = 0; i < cases.size(); ++i) {
    const auto& [row, parameter, value, episode] = cases[i];
    const char* name = row == RobustnessRow::kModel
                           ? kBoardVariations.at(parameter).name
                           : kRobustnessRowNames.at(static_cast<size_t>(row));
    if (curves.empty() || curves.back().name != name) curves.push_back({row, name, {}, {}});
    RobustnessCurve& curve = curves.back();
    if (curve.values.empty() || curve.values.back() != value) {
      curve.values.push_back(value);
      curve.share.push_back(0);
      count = 0;
    }
    curve.share.back() += ((AtGoal(ends[i]) ? 1 : 0) - curve.share.back()) / ++count;
  }
  // A noise level passes if more than half of its repeats do. Each push counts.
  std::array<int, kRobustnessRows> levels{};
  for (const RobustnessCurve& curve : curves) {
    const auto row = static_cast<size_t>(curve.row);
    for (const double share : curve.share) {
      const double passed = share > 0.5 ? 1 : 0;
      result.rows.at(row) += curve.row == RobustnessRow::kPush ? share : passed;
      ++levels.at(row);
    }
  }
  for (size_t row = 0; row < kRobustnessRows; ++row) result.rows.at(row) /= levels.at(row);
  return result;
}

}  // namespace upswing::realaigym

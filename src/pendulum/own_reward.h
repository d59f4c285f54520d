#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/archive.h"
#include "base/env.h"
#include "base/rng.h"
#include "pendulum/plant.h"

namespace upswing {

/// The reward of N environments as an expression of your own: terms, separated by `;`, whose sum is
/// the reward. A term may begin with a name and a colon, as in `energy: E; effort: -0.01*tau^2`.
///
/// An expression has numbers, the operators + - * / ^ ( ) < <= > >= == != && || and ?:, and the
/// names of docs/howto/reward.md: quantities of a control step, parameters of the plant, functions.
/// It has no side effects. The parser is muParser.
class OwnReward {
 public:
  /// Parses an expression and tries it on a pendulum that hangs at rest. `control_period`: length
  /// of a control step, s. Throws BadInput.
  explicit OwnReward(const std::string& expression, int num_envs = 1,
                     double control_period = kControlPeriod);
  ~OwnReward();

  /// The names of the terms (K); a term without a name is called `term1`, by its place.
  const std::vector<std::string>& names() const { return names_; }

  /// Compares the reward at random states and torques with the reward at their mirror images, in
  /// which angles, velocities and torques have the other sign. `draw` draws a plant. Returns the
  /// first difference as a text such as `0.2 at q1 = …, but -0.2 at the mirror image`; empty: none.
  std::string Asymmetry(const std::function<Plant(Rng&)>& draw);

  /// Begins an episode of an environment.
  void Begin(int env);
  /// Swaps the terms (N × K) of `result` with the terms (N × kRewardTerms) of the built-in reward,
  /// for the physics to write. A second call swaps them back.
  void SwapTerms(StepResult& result) { result.reward_terms.swap(built_in_); }
  /// Replaces an environment's built-in reward by the expression. `s` is the state at the end of
  /// the control step. Throws Failure with the state if a term is not a number within ±1e9.
  void Judge(int env, const Plant& plant, const PendulumState& s, StepResult& result);

  /// Saves or loads what the expression remembers of the running episodes.
  void State(const Archive& archive);

 private:
  struct Parsed;  // the terms and their variables

  std::unique_ptr<Parsed> parsed_;
  std::vector<std::string> names_;       // (K)
  std::vector<double> built_in_;         // (N, kRewardTerms)
  std::vector<double> last_torque_;      // (N) N·m, in the last step; 0 at the start
  std::vector<int64_t> inverted_steps_;  // (N) control steps in a row, until now, inverted
};

}  // namespace upswing

#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "extras/machine/drive/policy_controller.h"
#include "extras/realaigym/plant.h"

/// The rules of RealAIGym's simulation boards, version 2 (docs/howto/realaigym.md): the
/// simulations, and the scores of performance and robustness.
namespace upswing::realaigym {

/// A short disturbing torque, also beyond the motor's limit.
struct BoardPush {
  double amplitude = 0;        // N·m
  double time = 0, width = 0;  // s

  /// amplitude · exp(-(t - time)²/(2 width²)), N·m.
  double Torque(double t) const {
    const double z = (t - time) / width;
    return amplitude * std::exp(-z * z / 2);
  }
};

/// The conditions of a simulation.
struct BoardEpisode {
  BoardPlant plant;
  double velocity_noise = 0;          // of the measured velocities, rad/s
  double torque_noise = 0;            // N·m
  double response = 1;                // k of u = u_before + k (u_wanted - u_before)
  int delay = 0;                      // of the measured state, steps
  std::array<BoardPush, 3> pushes{};  // about the motor's joint
  uint64_t seed = 0;                  // of the noise
};

/// Largest angle and velocity errors, of both joints, at an end that counts for robustness.
inline constexpr double kBoardGoalAngle = 0.35, kBoardGoalVelocity = 1;  // rad, rad/s
bool AtGoal(const PendulumState& state);

/// The measures of a run.
struct BoardOutcome {
  // Start of the last stretch above the line, s; the end if there is none.
  double swing_up_seconds = 0;
  double energy = 0;         // J
  double max_torque = 0;     // N·m
  double torque_cost = 0;    // N²m²s
  double smoothness = 0;     // N·m
  double velocity_cost = 0;  // rad²/s
  bool above_line = false;   // swung up at the end: criterion of performance
};

/// The normaliser n of each measure c in the performance score, whose penalties are tanh(π c/n).
/// The defaults are those of the simulation boards.
struct ScoreScales {
  double swing_up_seconds = 20;  // s
  double energy = 60;            // J
  double torque_cost = 20;       // N²m²s
  double smoothness = 0.1;       // N·m
  double velocity_cost = 400;    // rad²/s
};

/// The performance score, version 2, from 0 to 1.
double PerformanceScore(const BoardOutcome& outcome, const ScoreScales& scales = {});
/// The five penalties of the performance score, each from 0 to 1: time, energy, torque cost,
/// smoothness, velocity cost.
std::array<double, 5> PerformancePenalties(const BoardOutcome& outcome,
                                           const ScoreScales& scales = {});

/// The rows of the robustness score.
enum class RobustnessRow { kModel, kVelocityNoise, kTorqueNoise, kResponse, kDelay, kPush };
inline constexpr int kRobustnessRows = 6;
inline constexpr std::array<const char*, kRobustnessRows> kRobustnessRowNames{
    "model", "velocity noise", "torque noise", "response", "delay", "pushes"};
/// The range of a varied model parameter; the other parameters are the board's. `low` and `high`
/// are in units of the board's value if the variation is a factor.
struct BoardVariation {
  const char* name;
  double BoardPlant::*parameter;
  double low, high;
  bool is_factor;
};
inline constexpr std::array<BoardVariation, 10> kBoardVariations{
    {{"Ir", &BoardPlant::rotor_inertia, 0, 1e-4, false},
     {"m1 r1", &BoardPlant::center1, 0.75, 1.25, true},
     {"I1", &BoardPlant::inertia1, 0.75, 1.25, true},
     {"m2 r2", &BoardPlant::center2, 0.75, 1.25, true},
     {"m2", &BoardPlant::mass2, 0.75, 1.25, true},
     {"I2", &BoardPlant::inertia2, 0.75, 1.25, true},
     {"b1", &BoardPlant::damping1, -0.1, 0.1, false},
     {"b2", &BoardPlant::damping2, -0.1, 0.1, false},
     {"cf1", &BoardPlant::friction1, -0.2, 0.2, false},
     {"cf2", &BoardPlant::friction2, -0.2, 0.2, false}}};
inline constexpr int kBoardLevels = 21;     // levels of a row's variation
inline constexpr int kBoardRepeats = 10;    // repeats of a noise level
inline constexpr int kBoardPushCases = 50;  // random push profiles

/// Number of simulations in a report: the nominal one and those of the robustness rows.
inline constexpr int kBoardSimulations =
    1 + kBoardLevels * (static_cast<int>(kBoardVariations.size()) + 2 * kBoardRepeats + 1 + 1) +
    kBoardPushCases;

/// A simulation of the robustness score with its row and parameter.
struct RobustnessCase {
  RobustnessRow row;
  int parameter;  // index in kBoardVariations
  double value;   // value of the varied quantity
  BoardEpisode episode;
};

/// All robustness cases, in the order of the rows.
std::vector<RobustnessCase> RobustnessCases(uint64_t seed);

/// The result of a row, or of one model parameter: for each level, the share of successes.
struct RobustnessCurve {
  RobustnessRow row;
  std::string name;
  std::vector<double> values;  // of the varied quantity
  std::vector<double> share;   // share of simulations that end at the goal
};

struct Robustness {
  std::array<double, kRobustnessRows> rows{};  // share of passed levels, or of pushes
  std::vector<RobustnessCurve> curves;         // ten of the model, then the other rows
  double score() const;
};

/// Computes the robustness scores from the final states of all cases.
Robustness JudgeRobustness(const std::vector<RobustnessCase>& cases,
                           const std::vector<PendulumState>& ends);

}  // namespace upswing::realaigym

#include "extras/realaigym/simulation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>

#include "base/rng.h"
#include "pendulum/closed_form.h"

namespace upswing::realaigym {
namespace {

constexpr int kMostDelay = 32;  // steps, more than the longest delay of the rules
static_assert(kBoardLevels - 1 < kMostDelay);
constexpr int kHeldSteps = 1000;  // the last 2 s
constexpr int kNoted = 8;         // steps between two measurements of the nearness
constexpr int kHeldLooks = kHeldSteps / kNoted;

/// Nearness to the goal, the fitness of a search: 1 upright at rest; 1/2 if the angles are off by
/// 0.35 rad (their squares sum to 0.24), or each velocity by `velocity`.
double Nearness(double e1, double e2, double w1, double w2, double velocity) {
  const double angles = (e1 * e1 + e2 * e2) / 0.12;
  return 1 / (1 + 0.5 * (angles + (w1 * w1 + w2 * w2) / (velocity * velocity)));
}

/// Running sums of a simulation, and the other inputs of its outcome.
struct Sums {
  Lanes energy{}, torque_cost{}, velocity_cost{}, max_torque{};
  Lanes change{}, changes_squared{};  // of the torque
  Lanes last_below;                   // last step below the line
  Lanes nearest{}, held{};
  Lanes largest_angle{};  // measured, rad
};

/// A push of a simulation, active after step `first` up to step `last`.
struct LanePush {
  int first, last;
  size_t lane;
  BoardPush push;
  Manipulator body;
};

/// A running block of simulations. Loops over kBoardBlock are written for the compiler's
/// vectorisation. Lists hold features that few simulations have.
class Run {
 public:
  Run(Robot robot, std::span<const BoardEpisode> episodes)
      : episodes_(episodes),
        steps_(episodes.front().steps),
        block_(kBoardBlock),
        past_(kMostDelay) {
    sums_.last_below.fill(-1);
    std::ranges::fill(block_.joint, static_cast<double>(robot));
    constexpr BoardPlant kPlant;  // no rule varies the lengths
    constexpr double kLength = kPlant.length1 + kPlant.length2;
    std::ranges::fill(block_.share1, kPlant.length1 / kLength);
    std::ranges::fill(block_.share2, kPlant.length2 / kLength);
    for (size_t lane = 0; lane < episodes.size(); ++lane) {
      const BoardEpisode& episode = episodes[lane];
      const Manipulator body = episode.body ? *episode.body : ManipulatorOf(episode.plant);
      block_.SetManipulator(lane, body);
      if (episode.zero != std::array<double, 2>{}) shifted_.push_back(lane);
      rngs_.emplace_back(episode.seed, "realaigym: noise");
      if (episode.velocity_noise > 0) velocity_noise_.push_back(lane);
      if (episode.torque_noise > 0) torque_noise_.push_back(lane);
      if (episode.delay > 0) delayed_.push_back(lane);
      if (std::isfinite(episode.angle_range)) ranged_.push_back(lane);
      if (episode.response != 1) responding_.push_back(lane);
      for (const BoardPush& push : episode.pushes) {
        if (push.amplitude == 0) continue;
        constexpr double kWidths = 6;  // negligible beyond this
        pushes_.push_back({static_cast<int>((push.time - kWidths * push.width) / kBoardTimestep),
                           static_cast<int>((push.time + kWidths * push.width) / kBoardTimestep),
                           lane, push, body});
      }
    }
  }

  std::vector<BoardOutcome> Go(BoardController& controller, std::vector<BoardSample>* trace) {
    for (int step = 0; step < steps_; ++step) {
      controller.Act(step, Measure(step), episodes_.size(), wanted_);
      Drive(step);
      if (trace != nullptr) {
        const double torque = torque_[0];
        trace->push_back({step * kBoardTimestep, StateOf(0),
                          block_.joint[0] == 1 ? Joints{torque, 0} : Joints{0, torque}});
      }
      NoteAngles();
      if (step % kNoted == 0) NoteNearness(step);
      if (step < steps_ - 1) NoteVelocities();
      Advance(block_, 1, 0, kBoardBlock, kBoardTimestep);
      Note(step);
    }
    std::vector<BoardOutcome> outcomes;
    for (size_t lane = 0; lane < episodes_.size(); ++lane) outcomes.push_back(OutcomeOf(lane));
    return outcomes;
  }

 private:
  BoardState StateOf(size_t lane) const {
    return {block_.q1[lane], block_.q2[lane], block_.w1[lane], block_.w2[lane]};
  }

  const BoardMeasurement& Measure(int step) {
    std::ranges::copy(block_.q1, seen_.q1.begin());
    std::ranges::copy(block_.q2, seen_.q2.begin());
    std::ranges::copy(block_.w1, seen_.w1.begin());
    std::ranges::copy(block_.w2, seen_.w2.begin());
    for (const size_t lane : shifted_) {
      seen_.q1[lane] += episodes_[lane].zero[0];
      seen_.q2[lane] += episodes_[lane].zero[1];
    }
    if (!delayed_.empty()) past_[static_cast<size_t>(step % kMostDelay)] = seen_;
    for (const size_t lane : delayed_) {
      const int then = std::max(0, step - episodes_[lane].delay);
      const BoardMeasurement& past = past_[static_cast<size_t>(then % kMostDelay)];
      seen_.q1[lane] = past.q1[lane];
      seen_.q2[lane] = past.q2[lane];
      seen_.w1[lane] = past.w1[lane];
      seen_.w2[lane] = past.w2[lane];
    }
    for (const size_t lane : velocity_noise_) {
      const auto [n1, n2] = rngs_[lane].NormalPair();
      seen_.w1[lane] += episodes_[lane].velocity_noise * n1;
      seen_.w2[lane] += episodes_[lane].velocity_noise * n2;
    }
    return seen_;
  }

  /// Computes the acting torques from the torques that the controller wants.
  void Drive(int step) {
    const double time = step * kBoardTimestep;
    previous_ = torque_;
    torque_ = wanted_;
    for (const size_t lane : torque_noise_) {
      torque_[lane] += episodes_[lane].torque_noise * rngs_[lane].Normal();
    }
    for (const size_t lane : responding_) {
      torque_[lane] =
          previous_[lane] + episodes_[lane].response * (torque_[lane] - previous_[lane]);
    }
    for (size_t i = 0; i < kBoardBlock; ++i) {
      const double below = torque_[i] < kBoardTorqueLimit ? torque_[i] : kBoardTorqueLimit;
      block_.tau[i] = torque_[i] = below > -kBoardTorqueLimit ? below : -kBoardTorqueLimit;
    }
    for (const auto& [first, last, lane, push, body] : pushes_) {
      if (step <= first || step > last) continue;
      if (push.passive) {
        Kick(lane, body, push.Torque(time));
      } else {
        block_.tau[lane] += push.Torque(time);
      }
    }
  }

  /// Adds the effect of a torque (N·m) about the joint without the motor to the velocities in a
  /// step.
  void Kick(size_t lane, const Manipulator& body, double torque) {
    const MassMatrix M = body.Mass(std::cos(block_.q2[lane]));
    const double impulse = torque * kBoardTimestep / M.det();
    const bool first = block_.joint[lane] != 1;
    block_.w1[lane] += impulse * (first ? M.M22 : -M.M12);
    block_.w2[lane] += impulse * (first ? -M.M12 : M.M11);
  }

  /// Records the largest measured angle of both joints, where encoders have a range.
  void NoteAngles() {
    for (const size_t lane : ranged_) {
      double& largest = sums_.largest_angle[lane];
      largest = std::max({largest, std::abs(seen_.q1[lane]), std::abs(seen_.q2[lane])});
    }
  }

  void NoteNearness(int step) {
    const bool holds = step >= steps_ - kHeldSteps;
    for (size_t lane = 0; lane < episodes_.size(); ++lane) {
      const double e1 = Wrapped(block_.q1[lane] - std::numbers::pi), e2 = Wrapped(block_.q2[lane]);
      const double w1 = block_.w1[lane], w2 = block_.w2[lane];
      sums_.nearest[lane] = std::max(sums_.nearest[lane], Nearness(e1, e2, w1, w2, 5));
      if (holds) sums_.held[lane] += Nearness(e1, e2, w1, w2, 1) / kHeldLooks;
    }
  }

  void NoteVelocities() {
    for (size_t i = 0; i < kBoardBlock; ++i) {
      const double w1 = block_.w1[i], w2 = block_.w2[i];
      sums_.velocity_cost[i] += (w1 * w1 + w2 * w2) * kBoardTimestep;
    }
  }

  /// Records, after a step, the work of its torque at the motor's joint, and the tip's position
  /// before the step.
  void Note(int step) {
    constexpr double kLine = 0.9;  // share of the length of both links
    const auto& angle = block_.joint[0] == 1 ? block_.q1 : block_.q2;
    for (size_t i = 0; i < kBoardBlock; ++i) {
      const double torque = torque_[i], size = std::abs(torque);
      sums_.max_torque[i] = sums_.max_torque[i] > size ? sums_.max_torque[i] : size;
      const double change = step > 0 ? torque - previous_[i] : 0;
      sums_.change[i] += change;
      sums_.changes_squared[i] += change * change;
    }
    if (step == steps_ - 1) return;  // N samples have N - 1 differences
    for (size_t i = 0; i < kBoardBlock; ++i) {
      const double torque = torque_[i];
      sums_.energy[i] += std::abs((angle[i] - block_.angle_before[i]) * torque);
      sums_.torque_cost[i] += torque * torque * kBoardTimestep;
      sums_.last_below[i] = block_.height_before[i] > kLine ? sums_.last_below[i] : step;
    }
  }

  BoardOutcome OutcomeOf(size_t lane) const {
    BoardOutcome o;
    o.energy = sums_.energy[lane];
    o.torque_cost = sums_.torque_cost[lane];
    o.velocity_cost = sums_.velocity_cost[lane];
    o.max_torque = sums_.max_torque[lane];
    o.nearest = sums_.nearest[lane];
    o.held = sums_.held[lane];
    const double mean = sums_.change[lane] / (kBoardSteps - 1);
    o.smoothness =
        std::sqrt(std::max(0.0, sums_.changes_squared[lane] / (kBoardSteps - 1) - mean * mean));
    const int first = static_cast<int>(sums_.last_below[lane]) + 1;
    o.above_line = first < steps_ - 1;
    o.swing_up_seconds = std::min(first, steps_ - 1) * kBoardTimestep;
    const BoardState end = StateOf(lane);
    o.at_goal = AtGoal(end);
    if (sums_.largest_angle[lane] >= episodes_[lane].angle_range) {
      o.above_line = o.at_goal = false;
      o.held = 0;
      o.swing_up_seconds = (steps_ - 1) * kBoardTimestep;
    }
    // A simulation that has blown up gets the worst outcome.
    const auto [q1, q2, w1, w2] = end;
    if (!std::isfinite(q1 + q2 + w1 + w2 + o.energy + o.velocity_cost)) {
      constexpr double kWorst = std::numeric_limits<double>::infinity();
      o = {(steps_ - 1) * kBoardTimestep, kWorst, kWorst, kWorst, kWorst, kWorst};
    }
    return o;
  }

  std::span<const BoardEpisode> episodes_;
  int steps_;
  ClosedFormBatch block_;
  std::vector<Rng> rngs_;
  // Simulations with shifted zeros, velocity noise, torque noise, delay, slow response and a range:
  std::vector<size_t> shifted_, velocity_noise_, torque_noise_, delayed_, responding_, ranged_;
  std::vector<LanePush> pushes_;
  std::vector<BoardMeasurement> past_;  // ring of the last kMostDelay states
  BoardMeasurement seen_{};
  Lanes wanted_{}, torque_{}, previous_{};  // N·m: wanted; acting, without pushes; acting before
  Sums sums_;
};

}  // namespace

std::vector<BoardOutcome> SimulateOnBoard(Robot robot, std::span<const BoardEpisode> episodes,
                                          const BoardControllerMaker& make, ThreadPool* pool,
                                          std::vector<BoardSample>* trace,
                                          const Progress& progress) {
  std::vector<BoardOutcome> outcomes(episodes.size());
  std::mutex mutex;
  double done = 0;
  const int blocks = static_cast<int>((episodes.size() + kBoardBlock - 1) / kBoardBlock);
  ParallelFor(pool, blocks, [&](int index) {
    const size_t first = static_cast<size_t>(index) * kBoardBlock;
    const size_t count = std::min(kBoardBlock, episodes.size() - first);
    const auto controller = make(first);
    auto run = std::make_unique<Run>(robot, episodes.subspan(first, count));
    std::ranges::copy(run->Go(*controller, first == 0 ? trace : nullptr),
                      outcomes.begin() + static_cast<std::ptrdiff_t>(first));
    if (!progress) return;
    const std::lock_guard lock(mutex);
    progress(done += static_cast<double>(count), static_cast<double>(episodes.size()));
  });
  return outcomes;
}

}  // namespace upswing::realaigym

#include "realaigym/simulation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/rng.h"

namespace upswing {
namespace {

constexpr int kMostDelay = 32;  // steps, a power of two above that of the rules
constexpr int kHeldFrom = kGymSteps - 1000;

double Wrapped(double angle) {
  constexpr double kTurn = 2 * std::numbers::pi;
  return angle - kTurn * std::nearbyint(angle / kTurn);
}

/// 1 at the goal, smaller away from it: shape for a search.
double Nearness(double e1, double e2, double w1, double w2, double velocity) {
  const double angles = (e1 * e1 + e2 * e2) / 0.12;
  return 1 / (1 + 0.5 * (angles + (w1 * w1 + w2 * w2) / (velocity * velocity)));
}

/// A block of simulations while it runs.
class Run {
 public:
  Run(GymRobot robot, std::span<const GymEpisode> episodes)
      : robot_(robot), episodes_(episodes), past_(kMostDelay) {
    for (size_t lane = 0; lane < episodes.size(); ++lane) {
      const GymEpisode& episode = episodes[lane];
      block_.SetPlant(lane, episode.plant);
      rngs_.emplace_back(episode.seed, "realaigym: noise");
      noisy_ = noisy_ || episode.velocity_noise > 0;
      delayed_ = delayed_ || episode.delay > 0;
    }
  }

  std::vector<GymOutcome> Go(GymController& controller, std::vector<GymSample>* trace) {
    outcomes_.resize(episodes_.size());
    sums_.resize(episodes_.size());
    for (int step = 0; step < kGymSteps; ++step) {
      controller.Act(step, Measure(step), episodes_.size(), wanted_);
      Lanes& applied = robot_ == GymRobot::kPendubot ? block_.tau1 : block_.tau2;
      Drive(step, applied);
      if (trace != nullptr) trace->push_back({step * kGymTimestep, block_.state(0), torque_[0]});
      const Lanes before = robot_ == GymRobot::kPendubot ? block_.q1 : block_.q2;
      if (step >= kHeldFrom || step % 8 == 0) NoteNearness(step);
      if (step < kGymSteps - 1) NoteVelocities();
      Advance(block_);
      Note(step, before, robot_ == GymRobot::kPendubot ? block_.q1 : block_.q2);
    }
    for (size_t lane = 0; lane < episodes_.size(); ++lane) Finish(lane);
    return outcomes_;
  }

 private:
  /// What outcomes are made of.
  struct Sums {
    double change = 0, changes_squared = 0;  // of the torque
    int last_below = -1;                     // step below the line
  };

  const GymMeasurement& Measure(int step) {
    if (!delayed_) {
      seen_ = {block_.q1, block_.q2, block_.w1, block_.w2};
    } else {
      past_[static_cast<size_t>(step % kMostDelay)] = {block_.q1, block_.q2, block_.w1, block_.w2};
      for (size_t lane = 0; lane < episodes_.size(); ++lane) {
        const int then = std::max(0, step - episodes_[lane].delay);
        const GymMeasurement& past = past_[static_cast<size_t>(then % kMostDelay)];
        seen_.q1[lane] = past.q1[lane];
        seen_.q2[lane] = past.q2[lane];
        seen_.w1[lane] = past.w1[lane];
        seen_.w2[lane] = past.w2[lane];
      }
    }
    if (noisy_) {
      for (size_t lane = 0; lane < episodes_.size(); ++lane) {
        if (episodes_[lane].velocity_noise == 0) continue;
        const auto [n1, n2] = rngs_[lane].NormalPair();
        seen_.w1[lane] += episodes_[lane].velocity_noise * n1;
        seen_.w2[lane] += episodes_[lane].velocity_noise * n2;
      }
    }
    return seen_;
  }

  /// From the torques that the controller wants to those that act.
  void Drive(int step, Lanes& applied) {
    const double time = step * kGymTimestep;
    previous_ = torque_;
    for (size_t lane = 0; lane < episodes_.size(); ++lane) {
      const GymEpisode& episode = episodes_[lane];
      double torque = wanted_[lane];
      if (episode.torque_noise > 0) torque += episode.torque_noise * rngs_[lane].Normal();
      if (episode.response != 1) {
        torque = previous_[lane] + episode.response * (torque - previous_[lane]);
      }
      torque_[lane] = std::clamp(torque, -kGymTorqueLimit, kGymTorqueLimit);
      applied[lane] = torque_[lane];
      for (const GymPush& push : episode.pushes) {
        if (push.amplitude == 0) continue;
        const double z = (time - push.time) / push.width;
        if (std::abs(z) < 6) applied[lane] += push.amplitude * std::exp(-z * z / 2);
      }
    }
  }

  void NoteNearness(int step) {
    for (size_t lane = 0; lane < episodes_.size(); ++lane) {
      const double e1 = Wrapped(block_.q1[lane] - std::numbers::pi), e2 = Wrapped(block_.q2[lane]);
      const double w1 = block_.w1[lane], w2 = block_.w2[lane];
      GymOutcome& o = outcomes_[lane];
      o.nearest = std::max(o.nearest, Nearness(e1, e2, w1, w2, 5));
      if (step >= kHeldFrom) o.held += Nearness(e1, e2, w1, w2, 1) / (kGymSteps - kHeldFrom);
    }
  }

  void NoteVelocities() {
    for (size_t lane = 0; lane < episodes_.size(); ++lane) {
      const double w1 = block_.w1[lane], w2 = block_.w2[lane];
      outcomes_[lane].velocity_cost += (w1 * w1 + w2 * w2) * kGymTimestep;
    }
  }

  /// After a step: what its torque did to the motor's joint, and where the tip was before.
  void Note(int step, const Lanes& before, const Lanes& after) {
    const double line = 0.9 * (GymPlant().length1 + GymPlant().length2);
    const bool last = step == kGymSteps - 1;
    for (size_t lane = 0; lane < episodes_.size(); ++lane) {
      GymOutcome& o = outcomes_[lane];
      Sums& sums = sums_[lane];
      const double torque = torque_[lane];
      // Of N samples there are N - 1 differences.
      if (!last) o.energy += std::abs((after[lane] - before[lane]) * torque);
      if (!last) o.torque_cost += torque * torque * kGymTimestep;
      o.max_torque = std::max(o.max_torque, std::abs(torque));
      if (step > 0) {
        const double change = torque - previous_[lane];
        sums.change += change;
        sums.changes_squared += change * change;
      }
      if (!last && !(block_.tip[lane] > line)) sums.last_below = step;
    }
  }

  void Finish(size_t lane) {
    GymOutcome& o = outcomes_[lane];
    const Sums& sums = sums_[lane];
    const double mean = sums.change / (kGymSteps - 1);
    o.smoothness = std::sqrt(std::max(0.0, sums.changes_squared / (kGymSteps - 1) - mean * mean));
    const int first = sums.last_below + 1;
    o.above_line = first < kGymSteps - 1;
    o.swing_up_seconds = std::min(first, kGymSteps - 1) * kGymTimestep;
    const auto [q1, q2, w1, w2] = block_.state(lane);
    o.at_goal = std::abs(Wrapped(q1 - std::numbers::pi)) < 0.35 && std::abs(Wrapped(q2)) < 0.35 &&
                std::abs(w1) < 1 && std::abs(w2) < 1;
    // A simulation that has blown up is nothing.
    if (!std::isfinite(q1 + q2 + w1 + w2 + o.energy + o.velocity_cost)) o = GymOutcome();
  }

  GymRobot robot_;
  std::span<const GymEpisode> episodes_;
  GymBlock block_;
  std::vector<Rng> rngs_;
  bool noisy_ = false, delayed_ = false;
  std::vector<GymMeasurement> past_;  // ring of the last kMostDelay states
  GymMeasurement seen_{};
  Lanes wanted_{}, torque_{}, previous_{};  // N·m: asked for; that acts, without pushes; before it
  std::vector<GymOutcome> outcomes_;
  std::vector<Sums> sums_;
};

}  // namespace

std::vector<GymOutcome> SimulateGym(GymRobot robot, std::span<const GymEpisode> episodes,
                                    const GymControllerMaker& make, ThreadPool* pool,
                                    std::vector<GymSample>* trace,
                                    const std::function<void(size_t)>& done) {
  std::vector<GymOutcome> outcomes(episodes.size());
  const int blocks = static_cast<int>((episodes.size() + kGymBlock - 1) / kGymBlock);
  ParallelFor(pool, blocks, [&](int index) {
    const size_t first = static_cast<size_t>(index) * kGymBlock;
    const size_t count = std::min(kGymBlock, episodes.size() - first);
    const auto controller = make(first);
    auto run = std::make_unique<Run>(robot, episodes.subspan(first, count));
    std::ranges::copy(run->Go(*controller, first == 0 ? trace : nullptr),
                      outcomes.begin() + static_cast<std::ptrdiff_t>(first));
    if (done) done(count);
  });
  return outcomes;
}

}  // namespace upswing

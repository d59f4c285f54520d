#include "extras/machine/logs/play.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "extras/machine/logs/angle_noise.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/logs/weak_form.h"

namespace upswing::machine {
namespace {

/// Moves the angles of a joint (0 or 1) from an encoder, which a link drags along, to the link. The
/// link is ahead of the encoder by half of the play in the direction of the motion. While the
/// encoder stands still at a turn, the link crosses the play.
void MoveToLink(int joint, double width, double step, MachineLog& log) {
  constexpr double kVisible = 2.5;  // steps
  const double visible = std::max(kVisible * step, width / 20);
  double ahead = 0;  // -1 or 1: the direction of the motion; 0: unknown
  int turn = 0;      // first row at the extreme angle of this direction
  int left = 0;      // last row near it
  std::vector<double> moved(log.rows());
  double extreme = log.angle.front()[joint];
  for (int k = 0; k < log.rows(); ++k) {
    const double angle = log.angle[k][joint];
    const double beyond = (angle - extreme) * (ahead == 0 ? 1 : ahead);
    if (ahead != 0 && beyond > 0) {
      extreme = angle;
      turn = left = k;
    } else if (std::abs(beyond) <= step) {
      left = k;
    } else if (std::abs(beyond) > visible) {
      const double next = std::copysign(1.0, angle - extreme);
      for (int i = turn; i < k; ++i) {
        const double share = i >= left ? 1 : static_cast<double>(i - turn) / (left - turn);
        moved[i] = width / 2 * (ahead + share * (next - ahead));
      }
      ahead = next;
      extreme = angle;
      turn = left = k;
    }
    moved[k] = width / 2 * ahead;
  }
  for (int k = 0; k < log.rows(); ++k) log.angle[k][joint] += moved[k];
}

/// Moves the angles of a joint (0 or 1) from the motor to the link, which is behind by half of the
/// play in the direction of the torque.
void MoveBehindMotor(int joint, double width, double delay, MachineLog& log) {
  constexpr double kNoTorque = 0.02;  // of the largest
  double largest = 0;
  for (const Joints& torque : log.commanded) largest = std::max(largest, std::abs(torque[joint]));
  double side = 0;
  int sent = -1;  // last row whose torque acts
  for (int k = 0; k < log.rows(); ++k) {
    while (sent + 1 < log.rows() && log.time[sent + 1] + delay <= log.time[k]) ++sent;
    const double torque = sent < 0 ? 0 : log.commanded[sent][joint];
    if (std::abs(torque) > kNoTorque * largest) side = std::copysign(1.0, torque);
    log.angle[k][joint] -= width / 2 * side;
  }
}

/// Tries plays on the logs.
class PlaySearch {
 public:
  PlaySearch(std::span<const MachineLog> logs, double time, double delay)
      : logs_(logs), time_(time), delay_(delay) {
    for (const int j : {0, 1})
      step_[j] = QuantumOf(logs, j).value_or(StepOfNoise(AngleNoise(logs, j)));
    none_ = FitOf({logs.begin(), logs.end()});
    best_ = none_;
  }

  void Try(int joint, PlayKind kind) {
    for (const double width : {0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1}) {
      std::vector<MachineLog> moved(logs_.begin(), logs_.end());
      for (MachineLog& log : moved) {
        if (kind == PlayKind::kEncoder) {
          MoveToLink(joint, width, step_[joint], log);
        } else {
          MoveBehindMotor(joint, width, delay_, log);
        }
      }
      const Explained explained = FitOf(moved);
      if (!(explained.misfit < best_.misfit)) continue;
      best_ = explained;
      play_ = {joint + 1, width, kind, explained.left, none_.left};
    }
  }

  std::optional<Play> Found() const {
    constexpr double kChange = 0.9;  // by which a play must reduce the misfit
    if (none_.windows == 0) return {};
    const bool is_clear = best_.misfit < none_.misfit - kChange * (1 + 8.0 / none_.windows);
    return is_clear ? std::optional(play_) : std::nullopt;
  }

 private:
  struct Explained {
    double misfit = INFINITY, left = 1;
    int windows = 0;
  };

  /// The fit with the delay that explains the motion best, near that of the motors.
  Explained FitOf(const std::vector<MachineLog>& logs) const {
    constexpr int kEnough = 6;  // windows
    const WeakForm form(logs, time_);
    if (form.windows() < kEnough) return {};
    WeakEquations equations = form.Equations({}, {}, delay_);
    Explained best;
    for (const double late : {0.0, 0.02, 0.05}) {
      form.SetTorques({}, delay_ + late * time_, equations);
      const WeakFit fit = Fit(equations);
      if (fit.misfit() < best.misfit) best = {fit.misfit(), fit.left(), form.windows()};
    }
    return best;
  }

  std::span<const MachineLog> logs_;
  double time_, delay_;  // s
  Joints step_{};        // of the encoders, rad
  Explained none_, best_;
  Play play_;
};

}  // namespace

std::optional<Play> FindPlay(std::span<const MachineLog> logs, double time, double delay,
                             int motor) {
  PlaySearch search(logs, time, delay);
  for (const int joint : {0, 1}) search.Try(joint, PlayKind::kEncoder);
  search.Try(motor - 1, PlayKind::kGear);
  return search.Found();
}

}  // namespace upswing::machine

#include "extras/machine/logs/hypotheses.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "extras/machine/logs/angle_noise.h"

namespace upswing::machine {
namespace {

constexpr double kChange = 2.5;        // by which a change must reduce the misfit
constexpr double kExactChange = 0.9;   // the same, where it explains the log to the encoders' noise
constexpr double kTorqueChange = 1.2;  // the same, where it shows in the equation of its motor
constexpr int kThinWindows = 64;       // of a scan

bool HasScale(double scale) { return std::abs(scale) != 1; }

/// The largest torques of a log, N·m.
Joints LargestTorques(Pieces pieces) {
  Joints largest{};
  for (const auto quantity : {&MachineLog::commanded, &MachineLog::measured}) {
    for (const int joint : {0, 1}) {
      for (const double u : ValuesOf(pieces, quantity, joint)) {
        largest[joint] = std::max(largest[joint], std::abs(u));
      }
    }
  }
  return largest;
}

}  // namespace

WeakFit FitSmallZeros(const WeakEquations& equations, const std::array<Eigen::MatrixXd, 2>& free) {
  using namespace weak;
  WeakFit fit = Fit(equations, free);
  const auto [zero1, zero12, zero2] = fit.zeros();
  if (std::max({std::abs(zero1), std::abs(zero12), std::abs(zero12 - zero1)}) <= kZero) return fit;
  WeakEquations without = equations;
  for (const int joint : {0, 1}) without.A[joint].middleCols(kZero1, 3).setZero();
  return Fit(without, free);
}

int Hypothesis::changes() const {
  const bool has_unit = HasScale(angles.scale[0]) || HasScale(angles.scale[1]);
  return (angles.scale[0] < 0) + (angles.scale[1] < 0) + has_unit + (angles.link1 != 0) +
         (angles.swapped || torques.swapped) + (torques.sign[0] < 0) + (torques.sign[1] < 0) +
         (std::abs(angles.zero[0]) > kZero) + (std::abs(angles.zero[1]) > kZero) +
         (angles.late != 0) + is_late + (torques.largest != Joints{}) +
         (torques.dead_band != Joints{}) + (torques.flips_at >= 0) + (change.kind != Change::kNone);
}

bool IsSameKind(const Hypothesis& a, const Hypothesis& b) {
  return a.change.joint == b.change.joint && a.angles.absolute == b.angles.absolute &&
         HasScale(a.angles.scale[0]) == HasScale(b.angles.scale[0]) &&
         HasScale(a.angles.scale[1]) == HasScale(b.angles.scale[1]) &&
         a.angles.scale[0] * b.angles.scale[0] > 0 && a.angles.scale[1] * b.angles.scale[1] > 0 &&
         a.angles.link1 == b.angles.link1 && a.angles.swapped == b.angles.swapped &&
         a.torques.swapped == b.torques.swapped && a.torques.sign == b.torques.sign &&
         (a.angles.late != 0) == (b.angles.late != 0) && a.is_late == b.is_late &&
         (a.torques.largest != Joints{}) == (b.torques.largest != Joints{}) &&
         (a.torques.dead_band != Joints{}) == (b.torques.dead_band != Joints{}) &&
         (a.torques.flips_at >= 0) == (b.torques.flips_at >= 0) && a.change.kind == b.change.kind;
}

Hypotheses::Hypotheses(const WeakForm& form, Pieces pieces, Driven driven)
    : form_(form),
      thin_(form.Thinned(kThinWindows)),
      driven_(driven),
      range_{AngleRange(pieces, 0), AngleRange(pieces, 1)},
      noise_{AngleNoise(pieces, 0), AngleNoise(pieces, 1)},
      largest_(LargestTorques(pieces)),
      cycle_(UsualCycle(pieces)),
      absolute_(pieces.front().absolute),
      per_change_(kChange * (1 + 8.0 / form.windows())) {
  ImproveDelay(log_);
  equations_ = EquationsOf(log_);
  best_ = second_ = log_;
  least_cost_ = log_.cost(per_change_);
}

void Hypotheses::TryAll() {
  TryReadings();
  TryScales();
  TryTimes();
  TryTorques();
  TryEncoders();
  TryClock();
  ImproveDelays();
  Choose();
}

bool Hypotheses::HasNoEffect(int joint) const {
  constexpr double kExplained = 0.02, kMore = 0.3, kWorse = 1;  // share, of the misfit
  if (!driven_[joint] || log_.fit.left() > kExplained) return false;
  const int own = joint == 0 ? weak::kTorque1 : weak::kTorque2;
  const int other = joint == 0 ? weak::kTorque2 : weak::kTorque1;
  WeakEquations without = equations_;
  without.A[joint].col(own).setZero();
  if (Fit(without).misfit() > log_.fit.misfit() + kMore) return false;
  if (!driven_[1 - joint]) return true;
  // If it had the effect of the other one, its torques would be seen.
  without.A[joint].col(other) = equations_.A[joint].col(own);
  return Fit(without).misfit() > log_.fit.misfit() + kWorse;
}

bool Hypotheses::HasNoEffect() const {
  constexpr double kExplained = 0.02, kMore = 0.3;  // share, of the misfit
  if (!IsDriven() || log_.fit.left() > kExplained) return false;
  WeakEquations without = equations_;
  without.A[0].col(weak::kTorque1).setZero();
  without.A[1].col(weak::kTorque2).setZero();
  return Fit(without).misfit() < log_.fit.misfit() + kMore;
}

std::optional<double> Hypotheses::TorqueRatio() const {
  constexpr double kExplained = 0.05, kOff = 1.5;  // share, largest ratio that right units show
  if (!driven_[0] || !driven_[1] || log_.fit.left() > kExplained) return {};
  if (HasNoEffect() || HasNoEffect(0) || HasNoEffect(1)) return {};
  const double first = log_.fit.constants(weak::kTorque1);
  const double second = log_.fit.constants(weak::kTorque2);
  if (!(first > 0) || !(second > 0) || std::abs(std::log(first / second)) < std::log(kOff))
    return {};
  WeakEquations same = equations_;
  same.A[1].col(weak::kTorque1) = equations_.A[1].col(weak::kTorque2);
  same.A[1].col(weak::kTorque2).setZero();
  if (FitSmallZeros(same).misfit() < log_.fit.misfit() + per_change_) return {};
  return first / second;
}

/// Delays that motors have, s.
std::vector<double> Hypotheses::UsualDelays() const {
  const double first = -1.5 * cycle_ - 0.04 * form_.time();
  const double last = 2 * cycle_ + 0.1 * form_.time();
  std::vector<double> delays;
  constexpr int kSteps = 8;
  for (int i = 0; i <= kSteps; ++i) delays.push_back(first + i * (last - first) / kSteps);
  return delays;
}

/// Finds the delay of the torques that explains the motion best.
void Hypotheses::ImproveDelay(Hypothesis& h) const {
  WeakEquations equations = EquationsOf(h);
  h.fit = FitOf(h, equations);
  if (!IsDriven()) return;
  const std::vector<double> usual = UsualDelays();
  const auto with = [&](double delay) {
    Hypothesis next = h;
    next.delay = std::clamp(delay, usual.front(), usual.back());
    SetTorques(next.torques, next.delay, equations);
    next.fit = FitOf(next, equations);
    return next;
  };
  Hypothesis found = h;
  for (const double delay : usual) {
    const Hypothesis next = with(delay);
    if (next.fit.misfit() < found.fit.misfit()) found = next;
  }
  h = Refined(found, found.delay, (usual[1] - usual[0]) / 2, 0.002 * form_.time(), with);
}

/// The joints whose motors a hypothesis suspects of another torque than the log's.
Driven ChangedMotors(const Hypothesis& h) {
  Driven changed{};
  for (const int j : {0, 1}) {
    changed[j] = h.torques.largest[j] > 0 || h.torques.dead_band[j] > 0 ||
                 (h.change.kind == Change::kOffset && h.change.joint == j);
  }
  return changed;
}

/// Whether a hypothesis changes too little to matter. Errors of the model produce such changes,
/// too.
bool Hypotheses::IsSmall(const Hypothesis& h) const {
  constexpr double kSlip = 0.03, kDrift = 0.1;    // rad
  constexpr double kScale = 0.005, kLate = 0.01;  // share, natural times
  constexpr double kRate = 0.02;                  // share
  // A seventh of the least share that slips of drawn machines leave, 0.2 r², and drifts, 0.07 r².
  constexpr double kShownSlip = 0.03, kShownDrift = 0.01;
  if (h.changes() != 1) return false;
  if (h.change.kind == Change::kClock) return std::abs(h.change.rate - 1) < kRate;
  // Smaller shares are those of rounded torques and of the motion between rows.
  constexpr double kShownTorque = 2e-5;
  const Driven changed = ChangedMotors(h);
  if (changed[0] || changed[1]) return log_.fit.left() < kShownTorque;
  if (h.angles.late != 0) return std::abs(h.angles.late) < kLate * form_.time();
  for (const double scale : h.angles.scale) {
    if (HasScale(scale)) return std::abs(std::abs(scale) - 1) < kScale;
  }
  const bool drifts = h.change.kind == Change::kDrift;
  if (!drifts && h.change.kind != Change::kSlip) return false;
  if (h.fit.constants.size() <= weak::kColumns) return false;
  const Joints more = h.more_turn();
  const double turn =
      std::max(std::abs(h.angles.turn[0] + more[0]), std::abs(h.angles.turn[1] + more[1]));
  if (turn < (drifts ? kDrift : kSlip)) return true;
  // A turn of an angle by r leaves a share of the order of r² unexplained. Where the log leaves far
  // less, the turn makes up for small errors of the constants.
  const double shown = (drifts ? kShownDrift : kShownSlip) * turn * turn;
  return log_.fit.left() < shown;
}

void Hypotheses::Offer(const Hypothesis& h) {
  if (h.changes() == 0 || IsSmall(h)) return;
  least_cost_ = std::min(least_cost_, h.cost(per_change_));
  const auto same =
      std::ranges::find_if(offered_, [&](const Hypothesis& own) { return IsSameKind(own, h); });
  if (same == offered_.end()) {
    offered_.push_back(h);
  } else if (h.misfit() < same->misfit()) {
    *same = h;
  }
}

/// Finds the delays of the best hypotheses: that of the log may be wrong where its angles are.
void Hypotheses::ImproveDelays() {
  constexpr size_t kMost = 4;
  std::ranges::sort(offered_, {}, [](const Hypothesis& h) { return h.misfit(); });
  for (size_t i = 0; i < std::min(kMost, offered_.size()); ++i) {
    Hypothesis& h = offered_[i];
    if (!h.is_late) ImproveDelay(h);
  }
}

/// Whether a single suspicion of motors makes their equations much better, and no other equation
/// worse. The torque of a joint is in the equation of this joint only, so that errors of a model of
/// the links, which are in both, do not look like it.
bool Hypotheses::ShowsAtItsMotor(const Hypothesis& h) const {
  constexpr double kSame = 1.1, kLeast = 2e-6;  // factor, share
  const Driven changed = ChangedMotors(h);
  if (h.changes() != 1 || (!changed[0] && !changed[1])) return false;
  double gain = 0;
  for (const int j : {0, 1}) {
    const double before = std::max(log_.fit.unexplained[j], kLeast);
    const double after = std::max(h.fit.unexplained[j], kLeast);
    if (changed[j]) gain += std::log(before / after);
    if (!changed[j] && after > kSame * before) return false;
  }
  return gain > kTorqueChange;
}

/// Chooses the best hypotheses. One that explains the log to the noise of its encoders, or shows at
/// its motor only, needs less to convince. No other hypothesis can improve a fit to the noise.
void Hypotheses::Choose() {
  using Rule = std::function<bool(const Hypothesis&)>;
  const auto find = [&](const Rule& counts, const Hypothesis* other) {
    const Hypothesis* found = &log_;
    for (const Hypothesis& h : offered_) {
      if ((other != nullptr && IsSameKind(h, *other)) || !counts(h)) continue;
      if (h.cost(per_change_) < found->cost(per_change_)) found = &h;
    }
    return found;
  };
  Rule counts = [](const Hypothesis&) { return true; };
  const Hypothesis* best = find(counts, nullptr);
  const auto try_rule = [&](double change, const Rule& rule) {
    const double before = std::exchange(per_change_, per_change_ * change / kChange);
    const Hypothesis* found = find(rule, nullptr);
    if (found == &log_) {
      per_change_ = before;
      return;
    }
    best = found;
    counts = rule;
  };
  if (!ExplainsToNoise(log_.fit) && !ExplainsToNoise(best->fit)) {
    try_rule(kExactChange, [&](const Hypothesis& h) { return ExplainsToNoise(h.fit); });
  }
  if (best == &log_) try_rule(kTorqueChange, [&](const auto& h) { return ShowsAtItsMotor(h); });
  best_ = *best;
  second_ = *find(counts, &best_);
}

/// The shares of the squares of a fit's motion that the noise of the encoders makes.
Joints Hypotheses::NoiseShares(const WeakFit& fit) const {
  const Eigen::VectorXd& x = fit.constants;
  const double J1 = x(weak::kJ1), J2 = x(weak::kJ2), b = x(weak::kB), a = x(weak::kA);
  // Mean squares of the mass matrix over all angles 2.
  const double m11 = std::pow(J1 + J2, 2) + 2 * b * b, m12 = J2 * J2 + b * b / 2;
  const double m22 = std::pow(J2 + a, 2);
  const double n1 = noise_[0] * noise_[0], n2 = noise_[1] * noise_[1];
  const double gain = form_.NoiseGain(cycle_);
  const auto share = [&](double squares, double motion) {
    return motion > 0 ? gain * squares / motion : 1;
  };
  return {share(m11 * n1 + m12 * n2, fit.motion[0]), share(m12 * n1 + m22 * n2, fit.motion[1])};
}

bool Hypotheses::ExplainsToNoise(const WeakFit& fit) const {
  constexpr double kTimes = 4, kExact = 4e-6;  // the noise, share
  const Joints noise = NoiseShares(fit);
  return fit.unexplained[0] < kTimes * noise[0] + kExact &&
         fit.unexplained[1] < kTimes * noise[1] + kExact;
}

WeakEquations Hypotheses::EquationsOf(const WeakForm& form, const Hypothesis& h) const {
  WeakEquations equations = form.Equations(h.angles, h.torques, h.delay);
  DropIdleTorques(h.torques, equations);
  return equations;
}

void Hypotheses::SetTorques(const TorqueReading& torques, double delay,
                            WeakEquations& equations) const {
  form_.SetTorques(torques, delay, equations);
  DropIdleTorques(torques, equations);
}

/// Idle motors report torques that have nothing to do with the motion.
void Hypotheses::DropIdleTorques(const TorqueReading& torques, WeakEquations& equations) const {
  if (!driven_[torques.swapped ? 1 : 0]) equations.A[0].col(weak::kTorque1).setZero();
  if (!driven_[torques.swapped ? 0 : 1]) equations.A[1].col(weak::kTorque2).setZero();
}

Hypothesis Hypotheses::WithAngles(const AngleReading& angles) const {
  Hypothesis next = log_;
  next.angles = angles;
  next.fit = FitSmallZeros(EquationsOf(next));
  return next;
}

Hypothesis Hypotheses::WithTorques(const TorqueReading& torques, double delay) const {
  Hypothesis next = log_;
  next.torques = torques;
  next.delay = delay;
  WeakEquations equations = equations_;
  SetTorques(torques, delay, equations);
  next.fit = FitSmallZeros(equations);
  return next;
}

}  // namespace upswing::machine

#include "extras/machine/twin/residuals.h"

#include "extras/machine/logs/check.h"

namespace upswing::machine {
namespace {

constexpr int kStartStates = tangent::kBody - tangent::kStart;
// A column of derivatives begins with those of the motion.
static_assert(kStartStates + constant::kBody == tangent::kBody);
static_assert(kStartStates + constant::kLag + 1 == tangent::kOffset);

/// Residuals of a window of n rows, with their derivatives unless J is empty.
struct Residuals {
  Eigen::VectorXd r;  // (2 n)
  Eigen::MatrixXd J;  // (start states and constants × 2 n)

  /// `constants`: number of constants of the twin.
  Residuals(int rows, int constants, bool linearizes)
      : r(Eigen::VectorXd::Zero(2 * rows)),
        J(kStartStates + constants, linearizes ? 2 * rows : 0) {}

  void SetZero() {
    r.setZero();
    J.setZero();
  }
  /// Sets the derivatives of residual i by the motion, and by the zeros. Start states have measured
  /// angles, so a larger zero is a smaller true angle at the start.
  void SetTangents(int i, const Eigen::VectorXd& by_motion) {
    J.col(i).setZero();
    J.col(i).head<tangent::kOffset>() = by_motion.head<tangent::kOffset>();
    J(kStartStates + constant::kZero1, i) = -by_motion(tangent::kStart);
    J(kStartStates + constant::kZero2, i) = -by_motion(tangent::kStart + 1);
    if (by_motion.size() == tangent::kOffset) return;
    J.col(i).segment<2>(kStartStates + constant::kOffset) = by_motion.segment<2>(tangent::kOffset);
    if (by_motion.size() == tangent::kCogging) return;
    constexpr int kBothJoints = 2 * Cogging::kCoefficients;
    J.col(i).tail<kBothJoints>() = by_motion.segment<kBothJoints>(tangent::kCogging);
    J(kStartStates + constant::kZero1, i) += by_motion(tangent::kZero);
    J(kStartStates + constant::kZero2, i) += by_motion(tangent::kZero + 1);
  }
  void Add(int i, int constant, double derivative) { J(kStartStates + constant, i) += derivative; }

  SquaredResiduals Square() const {
    const double rows = static_cast<double>(r.size()) / 2;
    SquaredResiduals squared;
    squared.mean = r.squaredNorm() / rows;
    if (J.cols() == 0) return squared;
    squared.H = J * J.transpose() / rows;
    squared.g = J * r / rows;
    return squared;
  }
};

/// A predicted window; its derivatives are empty unless asked for.
struct PredictedWindow {
  Motion motion;
  MotionTangents tangents;
};

void SetAngles(const MachineLog& log, const LogWindow& window, const PredictedWindow& predicted,
               bool linearizes, Residuals& of) {
  for (int k = 0; k < window.rows(); ++k) {
    for (int j = 0; j < 2; ++j) {
      const int i = 2 * k + j;
      of.r(i) = predicted.motion.angle[k][j] - log.angle[window.first + k][j];
      if (!linearizes) continue;
      of.SetTangents(i, predicted.tangents.angle.col(i));
      of.Add(i, constant::kZero1 + j, 1);
    }
  }
}

/// The reported torque is that of the drive, current_delay before the row, without the part that
/// opposes the acceleration.
void SetTorques(const ModelledLog& modelled, const LogWindow& window,
                const PredictedWindow& predicted, bool linearizes, Residuals& of) {
  const auto& [log, reported, motor, model] = modelled;
  const auto& [motion, tangents] = predicted;
  of.SetZero();
  int cursor = 0;
  for (int k = 0; k < window.rows(); ++k) {
    DriveTangents of_torque;
    const double time = log.time[window.first + k] - motor.current_delay;
    const Joints torque = model.drive.At(time, cursor, linearizes ? &of_torque : nullptr);
    for (int j = 0; j < 2; ++j) {
      if (!reported[j]) continue;
      const int i = 2 * k + j;
      of.r(i) = torque[j] - motor.current_inertia * motion.acceleration[k][j] -
                log.measured[window.first + k][j];
      if (!linearizes) continue;
      of.SetTangents(i, -motor.current_inertia * tangents.acceleration.col(i));
      of.Add(i, constant::kDelay, of_torque.by_delay[j]);
      of.Add(i, constant::kLag, of_torque.by_lag[j]);
      of.Add(i, constant::kCurrentDelay,
             of_torque.by_delay[j] + motor.current_inertia * tangents.jerk[k][j]);
      of.Add(i, constant::kCurrentInertia, -motion.acceleration[k][j]);
    }
  }
}

}  // namespace

int NumConstants(Detail detail) {
  switch (detail) {
    case Detail::kUsual:
      return constant::kOffset;
    case Detail::kOffsets:
      return constant::kCogging;
    case Detail::kCogging:
      return constant::kRows;
  }
  return constant::kRows;
}

Eigen::VectorXd ConstantsOf(const Twin& twin, Detail detail) {
  const Manipulator m = ManipulatorOf(twin.plant);
  const Actuator& motor = twin.actuator;
  Eigen::VectorXd c(kMostConstants);
  c.head<constant::kCogging>() << m.J1, m.J2, m.b, m.a, m.G1, m.G2, m.d1, m.d2, m.f1, m.f2,
      motor.delay, motor.lag, twin.sensors.zero1, twin.sensors.zero2, motor.current_delay,
      motor.current_inertia, motor.torque_offset1, motor.torque_offset2;
  for (int j = 0; j < 2; ++j) {
    const auto& own = twin.cogging.coefficients[j];
    c.segment<Cogging::kCoefficients>(constant::kCogging + j * Cogging::kCoefficients) =
        Eigen::Map<const Eigen::Vector<double, Cogging::kCoefficients>>(own.data());
  }
  return c.head(NumConstants(detail));
}

ModelledLog::ModelledLog(const MachineLog& of, const Twin& twin)
    : log(of),
      reported{HasTorque(of.measured, 0), HasTorque(of.measured, 1)},
      motor(twin.actuator),
      model(CommandedModel(of, twin)) {}

ModelledLog::ModelledLog(const MachineLog& of, const Twin& twin, Detail detail)
    : ModelledLog(of, twin) {
  model.body.detail = detail;
}

WindowResiduals ResidualsOf(const ModelledLog& modelled, const LogWindow& window,
                            const Eigen::Vector4d& x, bool linearizes) {
  const MachineLog& log = modelled.log;
  PredictedWindow predicted;
  predicted.motion =
      Predict(modelled.model, {x(0), x(1), x(2), x(3)}, window.TimesIn(log),
              modelled.motor.current_delay, linearizes ? &predicted.tangents : nullptr);
  Residuals residuals(window.rows(), NumConstants(modelled.model.body.detail), linearizes);
  WindowResiduals result;
  SetAngles(log, window, predicted, linearizes, residuals);
  result.angle = residuals.Square();
  if (log.measured.empty()) {
    result.torque.H.setZero(result.angle.H.rows(), result.angle.H.cols());
    result.torque.g.setZero(result.angle.g.size());
    return result;
  }
  SetTorques(modelled, window, predicted, linearizes, residuals);
  result.torque = residuals.Square();
  return result;
}

}  // namespace upswing::machine

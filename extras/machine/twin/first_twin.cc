#include "extras/machine/twin/first_twin.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "pendulum/regressor.h"

// Symbols: those of Manipulator; z zeros of the encoders, k1 = G1 z1, k2 = G2 (z1 + z2).
namespace upswing::machine {
namespace {

// Times for UsualPlant; they count by the scale of the machine.
constexpr double kSpan = 0.2;        // of an integral, s
constexpr double kSlopeSpan = 0.03;  // to both sides of a slope, s

constexpr double kLongestDelay = 0.02;  // s
constexpr int kUnknowns = 12;           // J1 J2 b a G1 G2 d1 d2 f1 f2 k1 k2

using Row = Eigen::Matrix<double, 1, kUnknowns>;

/// Momenta and torques of both joints in a moment, by unknown.
struct Terms {
  Row change1 = Row::Zero(), change2 = Row::Zero(), rate1 = Row::Zero(), rate2 = Row::Zero();
};

Terms TermsAt(const Joints& q, const Joints& w) {
  constexpr int kConstants = kNumManipulatorConstants;
  using Columns = Eigen::Map<const Eigen::Matrix<double, 1, kConstants>>;
  const auto angles = dynamics::AnglesOf<double>({q[0], q[1]});
  const auto [momentum, force] = MomentumRegressorOf(angles, {w[0], w[1]});
  Terms t;
  t.change1.head<kConstants>() = Columns(momentum[0].data());
  t.change2.head<kConstants>() = Columns(momentum[1].data());
  t.rate1.head<kConstants>() = Columns(force[0].data());
  t.rate2.head<kConstants>() = Columns(force[1].data());
  // The integral of a velocity is exact: the change of an angle.
  t.change1[column::kD1] = q[0];
  t.change2[column::kD2] = q[1];
  t.rate1[column::kD1] = t.rate2[column::kD2] = 0;
  t.rate1[column::kF1] = DryFriction(1, w[0]);
  t.rate2[column::kF2] = DryFriction(1, w[1]);
  // Zeros turn gravity: k1 = G1 z1, k2 = G2 (z1 + z2).
  t.rate1.tail<2>() << -angles.c1, -angles.c12();
  t.rate2.tail<2>() << 0, -angles.c12();
  return t;
}

/// The integrated equations of all logs, and the impulses for each delay of `rows` cycles.
struct Equations {
  std::vector<Row> left;
  std::vector<std::vector<double>> right;  // (delays) of the impulses, N·m·s
};

/// `period`: of the log, s, over the natural time.
void Add(const MachineLog& log, double period, int delays, Equations& all) {
  const int m = std::max(1, static_cast<int>(kSlopeSpan / period));
  const int span = std::max(2, static_cast<int>(kSpan / period));
  const auto terms = [&](int k) {
    const double h = log.time[k + m] - log.time[k - m];
    const Joints &next = log.angle[k + m], &last = log.angle[k - m];
    return TermsAt(log.angle[k], {(next[0] - last[0]) / h, (next[1] - last[1]) / h});
  };
  for (int begin = m + delays + 1; begin + span + m < log.rows(); begin += span / 2) {
    const Terms first = terms(begin), end = terms(begin + span);
    Row left1 = end.change1 - first.change1, left2 = end.change2 - first.change2;
    std::vector<Joints> impulse(delays, Joints{});
    for (int k = begin; k < begin + span; ++k) {
      const double h = log.time[k + 1] - log.time[k];
      const Terms t = terms(k);
      left1 += h * t.rate1;
      left2 += h * t.rate2;
      for (int d = 0; d < delays; ++d) {
        // The angles of a row were read when the torques of the row before were sent.
        for (int j = 0; j < 2; ++j) impulse[d][j] += h * log.commanded[k - 1 - d][j];
      }
    }
    all.left.insert(all.left.end(), {left1, left2});
    for (int d = 0; d < delays; ++d) {
      all.right[d].insert(all.right[d].end(), impulse[d].begin(), impulse[d].end());
    }
  }
}

/// A plant of two uniform rods with these constants of the equations of motion.
Plant RodsOf(const Eigen::Matrix<double, kUnknowns, 1>& x, Plant plant) {
  constexpr double kRod = 0.75;  // centre of a rod over (inertia about its end / (mass · centre))
  const Options options = OptionsOf(plant);
  const auto within = [&](const char* name, double value) {
    const Range range = options.Get(name)->range;
    return std::clamp(std::isfinite(value) ? value : range.low, range.low, range.high);
  };
  const Scale scale = ScaleOverUsual(plant);
  const double least_moment = 1e-4 * scale.torque;                             // kg·m
  const double least_inertia = 1e-6 * scale.torque * scale.time * scale.time;  // kg·m²
  const double J1 = x[0], b = x[2], g = plant.gravity, moment2 = std::max(x[5] / g, least_moment);
  const double J2 =
      std::max(x[1], least_inertia);  // a part at a limit of its range would stay there
  plant.armature = within("armature", std::max(x[3], J2 / 20));
  plant.length1 = within("length1", b / moment2);
  plant.center2 = within("center2", kRod * J2 / moment2);
  plant.length2 = within("length2", 2 * plant.center2);
  plant.mass2 = within("mass2", moment2 / plant.center2);
  plant.inertia2 = within("inertia2", std::max(J2 - moment2 * plant.center2, J2 / 20));
  plant.center1 = plant.length1 / 2;
  plant.mass1 = within("mass1", (x[4] / g - plant.mass2 * plant.length1) / plant.center1);
  const double rest = J1 - plant.armature - plant.mass2 * plant.length1 * plant.length1;
  double inertia1 = rest - plant.mass1 * plant.center1 * plant.center1;
  // A motion shows only the sum of inertia1 and the armature of joint 1. A motor at joint 2 may
  // have more armature than this sum. Then all of the sum is the link's.
  plant.armature1 = -1;
  if (inertia1 < 0 && plant.actuated_joint == 2) {
    plant.armature1 = 0;
    inertia1 += plant.armature;
  }
  plant.inertia1 = within("inertia1", std::max(inertia1, std::abs(J1) / 20 + least_inertia));
  plant.damping1 = within("damping1", x[6]);
  plant.damping2 = within("damping2", x[7]);
  plant.coulomb1 = within("coulomb1", x[8]);
  plant.coulomb2 = within("coulomb2", x[9]);
  return plant;
}

}  // namespace

Twin FirstTwin(std::span<const MachineLog> logs, const Twin& known) {
  const double period = known.loop.period;
  const int delays = static_cast<int>(kLongestDelay / period) + 1;
  Equations all;
  all.right.resize(delays);
  const double natural_period = period / ScaleOverUsual(known.plant).time;
  for (const MachineLog& log : logs) Add(log, natural_period, delays, all);
  const int n = static_cast<int>(all.left.size());
  if (n < 2 * kUnknowns) {
    throw BadInput("learn: expected a motion of 2 s for a first model, got less");
  }
  Eigen::MatrixXd A(n, kUnknowns);
  for (int i = 0; i < n; ++i) A.row(i) = all.left[i];
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors(A);
  Eigen::Matrix<double, kUnknowns, 1> best;
  double least = -1;
  int delay = 0;
  for (int d = 0; d < delays; ++d) {
    const Eigen::Map<const Eigen::VectorXd> right(all.right[d].data(), n);
    const Eigen::VectorXd x = factors.solve(right);
    const double error = (A * x - right).squaredNorm();
    if (least >= 0 && error >= least) continue;
    least = error;
    best = x;
    delay = d;
  }
  Twin twin = known;
  twin.plant = RodsOf(best, known.plant);
  twin.actuator.delay = twin.actuator.lag = delay * period / 2;
  const double G1 = best[4], G2 = best[5];
  constexpr double kLargestZero = 0.2;  // rad
  const auto zero = [&](double z) {
    return std::isfinite(z) ? std::clamp(z, -kLargestZero, kLargestZero) : 0;
  };
  twin.sensors.zero1 = zero(best[10] / G1);
  twin.sensors.zero2 = zero(best[11] / G2) - twin.sensors.zero1;
  return twin;
}

Twin AsRods(Twin twin) {
  const Manipulator m = ManipulatorOf(twin.plant);
  Eigen::Matrix<double, kUnknowns, 1> x = Eigen::Matrix<double, kUnknowns, 1>::Zero();
  x.head<10>() << m.J1, m.J2, m.b, m.a, m.G1, m.G2, m.d1, m.d2, m.f1, m.f2;
  twin.plant = RodsOf(x, twin.plant);
  return twin;
}

}  // namespace upswing::machine

#include "extras/machine/twin/normal_equations.h"

#include <Eigen/LU>

namespace upswing::machine {
namespace {

using Eigen::Matrix4d;
using Eigen::MatrixXd;
using Eigen::Vector4d;
using Eigen::VectorXd;

// Windows overlap, so neighbours share rows: several in a row count as one.
constexpr int kWindowsInAScore = 6;

/// Normal equations of the constants in which a start state is eliminated.
struct EliminatedBlock {
  MatrixXd H;
  VectorXd g;
};

Matrix4d InverseOfDamped(const Matrix4d& Hxx, double damping) {
  Matrix4d damped = Hxx;
  damped.diagonal() *= 1 + damping;
  return damped.inverse();
}

EliminatedBlock EliminateStart(const WindowBlock& b, double damping) {
  const Eigen::Matrix<double, Eigen::Dynamic, 4> half =
      b.Hxc.transpose() * InverseOfDamped(b.Hxx, damping);
  return {b.Hcc - half * b.Hxc, b.gc - half * b.gx};
}

/// Whether the score that has window `w` ends with it: after some windows, and with a log.
bool EndsScore(const ShootingModel& model, int w) {
  const bool ends_log =
      w + 1 == model.windows() || model.LogOfWindow(w + 1) != model.LogOfWindow(w);
  return ends_log || (w + 1) % kWindowsInAScore == 0;
}

}  // namespace

Linearization LinearizationOf(const ShootingModel& model,
                              const std::vector<WindowResiduals>& linearized, const FitPoint& point,
                              const RobustScales& scales) {
  Linearization result;
  result.blocks = model.Blocks(linearized, point, scales);
  const FitParameters& parameters = model.parameters();
  for (int s = 0; s < parameters.sessions().size(); ++s) {
    result.slopes.push_back(parameters.Slope(point.theta, s));
  }
  return result;
}

NormalEquations EliminateStarts(const ShootingModel& model, const Linearization& linearization,
                                double damping) {
  const auto& [blocks, slopes] = linearization;
  const int n = model.parameters().size();
  NormalEquations equations{MatrixXd::Zero(n, n), VectorXd::Zero(n), {}};
  std::vector<MatrixXd> H;  // (sessions)
  for (const MatrixXd& slope : slopes) H.push_back(MatrixXd::Zero(slope.rows(), slope.rows()));
  VectorXd score = VectorXd::Zero(n);
  for (int w = 0; w < model.windows(); ++w) {
    const int session = model.SessionOfWindow(w);
    const EliminatedBlock eliminated = EliminateStart(blocks[w], damping);
    H[session] += eliminated.H;
    score += slopes[session].transpose() * eliminated.g;
    if (!EndsScore(model, w)) continue;
    equations.g += score;
    equations.scores.push_back(score);
    score.setZero();
  }
  for (size_t s = 0; s < slopes.size(); ++s) {
    equations.H += slopes[s].transpose() * H[s] * slopes[s];
  }
  return equations;
}

Vector4d ChangeOfStart(const WindowBlock& block, const MatrixXd& slope, const VectorXd& change,
                       double damping) {
  const VectorXd of_constants = slope * change;
  return -(InverseOfDamped(block.Hxx, damping) * (block.gx + block.Hxc * of_constants));
}

void FixAtZero(int i, MatrixXd& A, VectorXd& b) {
  A.row(i).setZero();
  A.col(i).setZero();
  A(i, i) = 1;
  b(i) = 0;
}

}  // namespace upswing::machine

#include "extras/machine/fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "pendulum/posterior.h"

// Symbols: θ values shared by all windows, x start state of a window, r residuals, J = ∂r/∂θ,
// K = ∂r/∂x; H.. blocks of the Gauss-Newton matrix, g. gradients.
namespace upswing::machine {
namespace {

using Eigen::Matrix4d;
using Eigen::MatrixXd;
using Eigen::Vector4d;
using Eigen::VectorXd;

// Standard deviations of a start state about its cubic (rad, rad/s), and the weight of that prior.
const Vector4d kStartDeviation(0.002, 0.002, 0.06, 0.06);
constexpr double kStartWeight = 0.05;
// Limits of the scales of the robust cost.
constexpr double kSmallestScale = 1e-5, kLargestScale = 0.1;  // rad
constexpr double kSmallestTorqueScale = 1e-3;                 // N·m

/// Typical size of a value, for finite differences.
double ScaleOf(const std::string& name) {
  static const std::map<std::string, double, std::less<>> kScales{
      {"delay", 0.002},   {"lag", 0.005},    {"current_delay", 0.002}, {"current_inertia", 0.002},
      {"zero1", 0.02},    {"zero2", 0.02},   {"armature", 0.003},      {"damping1", 0.02},
      {"damping2", 0.02}, {"coulomb1", 0.1}, {"coulomb2", 0.1},        {"inertia1", 0.01},
      {"inertia2", 0.01}};
  const auto found = kScales.find(name);
  return found == kScales.end() ? 0.2 : found->second;
}

/// An entry of θ: a setting of the twin; or, with a session, that session's deviation from it.
struct Value {
  std::string name;
  double scale;
  int session;  // -1: all
  Range range;
  double prior;      // weight of the prior about `guess`; 0: none
  double guess = 0;  // at first
};

/// Whether a value changes the torques. If so, its derivatives need the drives of all logs again.
bool ChangesDrive(const std::string& name) { return name == "delay" || name == "lag"; }

/// Prior standard deviation of a session's value about the machine's value: encoders' zeros in rad,
/// dry friction in N·m. 0: all sessions share the value.
double SessionDeviation(const std::string& name) {
  if (name == "zero1" || name == "zero2") return 0.05;
  return name == "coulomb1" || name == "coulomb2" ? 0.03 : 0;
}

/// Prior standard deviation of a value about the first guess; 0: none. Motors take milliseconds:
/// without reported torques, much larger delays can imitate friction.
double PriorDeviation(const std::string& name) {
  return name == "delay" || name == "lag" || name == "current_delay" ? 0.005 : 0;  // s
}

/// The weight of a prior with this standard deviation; 0: none.
double WeightOf(double deviation) { return deviation > 0 ? 1 / (deviation * deviation) : 0; }

/// A window with its free start state.
struct Shot {
  LogWindow window;
  Vector4d x, cubic;  // start state now, and the cubic's (rad, rad/s)
  int session;        // index
};

/// The twin in a session, ready to predict.
struct Model {
  Manipulator body;
  Joints zero;             // rad
  double current_delay;    // s
  double current_inertia;  // kg·m²
};

/// Residuals of a window, predicted minus measured. A column for each joint.
struct Residuals {
  Eigen::MatrixX2d angle;   // (rows × 2), rad
  Eigen::MatrixX2d torque;  // (rows × 2), N·m; no rows if the log lacks reported torques
};

/// A window's share in the normal equations.
struct Share {
  double cost = 0;
  double squares = 0, torque_squares = 0;  // means over rows, rad² and (N·m)²
  Matrix4d Hxx;
  Vector4d gx;
  MatrixXd Hxt, Htt;  // (4 × n), (n × n)
  VectorXd gt;
};

class Problem {
 public:
  Problem(std::span<const MachineLog> logs, const Twin& first,
          const std::vector<std::string>& names, const FitConfig& config, ThreadPool* pool)
      : logs_(logs), twin_(first), pool_(pool) {
    twin_.sessions.clear();
    twin_.uncertain.clear();
    twin_.covariance.clear();
    // Zeros stand for the capsules' centres and inertias.
    const auto [link1, link2] = LinksOf(twin_.plant);
    twin_.plant.center1 = link1.c;
    twin_.plant.center2 = link2.c;
    twin_.plant.inertia1 = link1.I;
    twin_.plant.inertia2 = link2.I;
    std::map<std::string, int> sessions;
    for (const MachineLog& log : logs) {
      const auto [place, is_new] =
          sessions.emplace(SessionOf(log.name), static_cast<int>(sessions_.size()));
      if (is_new) sessions_.push_back(place->first);
      session_of_.push_back(place->second);
      reported_.push_back({HasTorque(log.measured, 0), HasTorque(log.measured, 1)});
    }
    const Options options = OptionsOf(twin_);
    for (const std::string& name : names) {
      const Option& option = *options.Find(name, "identify").front();
      values_.push_back(
          {name, ScaleOf(name), -1, UncertainRange(option), WeightOf(PriorDeviation(name))});
      if (SessionDeviation(name) == 0) continue;
      for (int s = 0; s < static_cast<int>(sessions_.size()); ++s) {
        values_.push_back({name, ScaleOf(name), s, {}, WeightOf(SessionDeviation(name))});
      }
    }
    theta_.resize(size());
    for (int i = 0; i < size(); ++i) {
      theta_(i) = values_[i].session < 0 ? options.Get(values_[i].name)->number() : 0;
      // The model counts lags below 10 µs as equal, so the derivative at lag 0 is 0.
      if (values_[i].name == "lag" && theta_(i) == 0) theta_(i) = values_[i].scale;
      values_[i].guess = theta_(i);
    }
    for (const LogWindow& w :
         CutWindows(logs, config.windows, first.plant.length1, first.plant.length2)) {
      const Vector4d x(w.start.q1, w.start.q2, w.start.w1, w.start.w2);
      shots_.push_back({w, x, x, session_of_[w.log]});
    }
  }

  int size() const { return static_cast<int>(values_.size()); }
  int windows() const { return static_cast<int>(shots_.size()); }

  /// The twin with the values θ of a session.
  Twin TwinAt(const VectorXd& theta, int session) const {
    Twin twin = twin_;
    const Options options = OptionsOf(twin);
    for (int i = 0; i < size(); ++i) {
      if (values_[i].session >= 0 && values_[i].session != session) continue;
      // A session's deviation comes after the machine's value.
      const Option& option = *options.Get(values_[i].name);
      double& value = *std::get<double*>(option.target);
      value = values_[i].session < 0 ? theta(i) : value + theta(i);
      value = std::clamp(value, option.range.low, option.range.high);
    }
    return twin;
  }

  /// One step of the method; false if no step decreases the cost any more.
  bool Step(double tolerance) {
    SetScales();
    const std::vector<Share> shares = Linearize();
    double before = PriorCost(theta_);
    MatrixXd H = MatrixXd::Zero(size(), size());
    VectorXd g = VectorXd::Zero(size());
    AddPrior(H, g);
    for (const Share& share : shares) before += share.cost;
    for (; damping_ < 1e6; damping_ *= 8) {
      MatrixXd A = H;
      VectorXd b = g;
      std::vector<Matrix4d> inverses;
      for (const Share& s : shares) {
        Matrix4d Hxx = s.Hxx;
        Hxx.diagonal() *= 1 + damping_;
        inverses.push_back(Hxx.inverse());
        A += s.Htt - s.Hxt.transpose() * inverses.back() * s.Hxt;
        b += s.gt - s.Hxt.transpose() * inverses.back() * s.gx;
      }
      A.diagonal() *= 1 + damping_;
      A.diagonal().array() += 1e-12;
      VectorXd theta = theta_ - A.ldlt().solve(b);
      for (int i = 0; i < size(); ++i) {
        const Value& v = values_[i];
        theta(i) = std::clamp(theta(i), v.range.low, v.range.high);
      }
      const VectorXd change = theta - theta_;
      std::vector<Vector4d> starts;
      for (size_t w = 0; w < shares.size(); ++w) {
        const Share& s = shares[w];
        starts.push_back(shots_[w].x - inverses[w] * (s.gx + s.Hxt * change));
      }
      const double after = CostAt(theta, starts);
      if (!(after < before)) continue;
      theta_ = theta;
      for (size_t w = 0; w < shots_.size(); ++w) shots_[w].x = starts[w];
      damping_ = std::max(damping_ / 5, 1e-7);
      return before - after > tolerance * std::abs(before);
    }
    return false;
  }

  FitResult Result() {
    const std::vector<Share> shares = Linearize();
    // The sandwich estimate: right also where the model's residuals are not white.
    MatrixXd A = MatrixXd::Zero(size(), size()), meat = A;
    for (int i = 0; i < size(); ++i) A(i, i) = values_[i].prior;
    std::vector<double> errors, torque_errors;
    // Windows overlap, so neighbours share rows: the scores of several in a row count as one.
    constexpr size_t kBlock = 6;
    int blocks = 0;
    VectorXd block = VectorXd::Zero(size());
    for (size_t w = 0; w < shares.size(); ++w) {
      const Share& s = shares[w];
      const MatrixXd half = s.Hxt.transpose() * s.Hxx.inverse();
      A += s.Htt - half * s.Hxt;
      block += s.gt - half * s.gx;
      if (w + 1 == shares.size() || shots_[w + 1].window.log != shots_[w].window.log ||
          (w + 1) % kBlock == 0) {
        meat += block * block.transpose();
        block.setZero();
        ++blocks;
      }
      errors.push_back(std::sqrt(s.squares));
      if (s.torque_squares > 0) torque_errors.push_back(std::sqrt(s.torque_squares));
    }
    // The fit makes the scores smaller than those of the true values: MacKinnon and White (1985),
    // HC1, with blocks as observations.
    meat *= static_cast<double>(blocks) / std::max(1, blocks - size());
    // A value at the limit of its range is taken as known.
    for (int i = 0; i < size(); ++i) {
      const Value& v = values_[i];
      if (theta_(i) > v.range.low && theta_(i) < v.range.high) continue;
      A.row(i).setZero();
      A.col(i).setZero();
      meat.row(i).setZero();
      meat.col(i).setZero();
      A(i, i) = 1;
    }
    A.diagonal().array() += 1e-12;
    const MatrixXd inverse = A.ldlt().solve(MatrixXd::Identity(size(), size()));
    FitResult result = Combine(inverse * meat * inverse);
    result.windows = windows();
    result.error = Median(errors);
    result.torque_error = Median(torque_errors);
    return result;
  }

 private:
  /// Covariance (n × n) of the differences between sessions, for n values of the machine. The prior
  /// counts as one session. So a single session, which shows no differences, gets the prior's
  /// covariance.
  MatrixXd BetweenSessions(int n) const {
    MatrixXd squares = MatrixXd::Zero(n, n);
    MatrixXd difference = MatrixXd::Zero(std::ssize(sessions_), n);
    int column = -1;
    for (int i = 0; i < size(); ++i) {
      if (values_[i].session < 0) {
        ++column;
        squares(column, column) = std::pow(SessionDeviation(values_[i].name), 2);
      } else {
        difference(values_[i].session, column) = theta_(i);
      }
    }
    squares += difference.transpose() * difference;
    std::set<int> seen;  // sessions with windows; their mean takes one degree of freedom
    for (const Shot& shot : shots_) seen.insert(shot.session);
    return squares / std::max<double>(std::ssize(seen), 1);
  }

  /// The machine's values. Their covariance includes the covariance between sessions.
  FitResult Combine(const MatrixXd& covariance) const {
    FitResult result;
    result.twin = TwinAt(theta_, -1);
    std::vector<int> own;  // the entries of θ without a session
    for (int i = 0; i < size(); ++i) {
      if (values_[i].session >= 0) continue;
      own.push_back(i);
      result.twin.uncertain.push_back(values_[i].name);
    }
    const MatrixXd between = BetweenSessions(static_cast<int>(own.size()));
    for (size_t i = 0; i < own.size(); ++i) {
      for (size_t j = 0; j < own.size(); ++j) {
        const double both = (covariance(own[i], own[j]) + covariance(own[j], own[i])) / 2;
        result.twin.covariance.push_back(both + between(i, j));
      }
    }
    for (int s = 0; s < static_cast<int>(sessions_.size()); ++s) {
      const Twin own = TwinAt(theta_, s);
      result.twin.sessions.push_back({sessions_[s], own.sensors.zero1, own.sensors.zero2,
                                      own.plant.coulomb1, own.plant.coulomb2});
    }
    return result;
  }

  double PriorCost(const VectorXd& theta) const {
    double cost = 0;
    for (int i = 0; i < size(); ++i) {
      const double off = theta(i) - values_[i].guess;
      cost += values_[i].prior * off * off;
    }
    return cost;
  }
  void AddPrior(MatrixXd& H, VectorXd& g) const {
    for (int i = 0; i < size(); ++i) {
      H(i, i) += values_[i].prior;
      g(i) += values_[i].prior * (theta_(i) - values_[i].guess);
    }
  }

  /// Models of all sessions, and drives of all logs, at θ.
  std::vector<Model> ModelsAt(const VectorXd& theta) const {
    std::vector<Model> models;
    for (int s = 0; s < static_cast<int>(sessions_.size()); ++s)
      models.push_back(ModelAt(theta, s));
    return models;
  }
  Model ModelAt(const VectorXd& theta, int session) const {
    const Twin twin = TwinAt(theta, session);
    return {BodyOf(twin),
            {twin.sensors.zero1, twin.sensors.zero2},
            twin.actuator.current_delay,
            twin.actuator.current_inertia};
  }
  std::vector<Drive> DrivesAt(const VectorXd& theta) const {
    const Twin twin = TwinAt(theta, 0);
    std::vector<Drive> drives;
    for (const MachineLog& log : logs_) drives.push_back(Drive::Commanded(log, twin));
    return drives;
  }

  Residuals ResidualsOf(const Shot& shot, const Vector4d& x, const Model& model, const Drive& drive,
                        Motion& motion) const {
    const MachineLog& log = logs_[shot.window.log];
    const auto [index, first, last, start] = shot.window;
    Predict(model.body, drive, model.zero, {x(0), x(1), x(2), x(3)}, log, first, last,
            model.current_delay, motion);
    const int rows = last - first;
    Residuals r;
    r.angle.resize(rows, 2);
    r.torque.resize(log.measured.empty() ? 0 : rows, 2);
    int cursor = 0;
    for (int k = 0; k < rows; ++k) {
      for (int j = 0; j < 2; ++j) r.angle(k, j) = motion.angle[k][j] - log.angle[first + k][j];
      if (log.measured.empty()) continue;
      const Joints torque = drive.At(log.time[first + k] - model.current_delay, cursor);
      for (int j = 0; j < 2; ++j) {
        r.torque(k, j) = 0;
        if (!reported_[shot.window.log][j]) continue;
        r.torque(k, j) = torque[j] - model.current_inertia * motion.acceleration[k][j] -
                         log.measured[first + k][j];
      }
    }
    return r;
  }

  static double MeanSquare(const Eigen::MatrixX2d& r) {
    return r.rows() == 0 ? 0 : r.squaredNorm() / static_cast<double>(r.rows());
  }

  /// Cost of a window's residuals: ln(1 + r²/s²) of the mean square of both kinds.
  double Cost(const Residuals& r) const {
    return std::log1p(MeanSquare(r.angle) / (scale_ * scale_)) +
           std::log1p(MeanSquare(r.torque) / (torque_scale_ * torque_scale_));
  }
  static double StartCost(const Shot& shot, const Vector4d& x) {
    return kStartWeight * (x - shot.cubic).cwiseQuotient(kStartDeviation).squaredNorm();
  }

  double CostAt(const VectorXd& theta, const std::vector<Vector4d>& starts) const {
    const std::vector<Model> models = ModelsAt(theta);
    const std::vector<Drive> drives = DrivesAt(theta);
    std::vector<double> costs(shots_.size());
    ParallelFor(pool_, windows(), [&](int w) {
      Motion motion;
      const Shot& shot = shots_[w];
      costs[w] = Cost(ResidualsOf(shot, starts[w], models[shot.session], drives[shot.window.log],
                                  motion)) +
                 StartCost(shot, starts[w]);
    });
    double cost = PriorCost(theta);
    for (const double c : costs) cost += c;
    return cost;
  }

  std::vector<Share> Linearize() const {
    // Models and drives at θ, and with each value a little larger and smaller.
    const auto moved = [&](int i, double sign) {
      VectorXd theta = theta_;
      theta(i) += sign * Difference(i);
      return theta;
    };
    const std::vector<Model> models = ModelsAt(theta_);
    const std::vector<Drive> drives = DrivesAt(theta_);
    std::vector<std::array<std::vector<Drive>, 2>> moved_drives(size());
    std::vector<std::array<std::vector<Model>, 2>> moved_models(size());
    for (int i = 0; i < size(); ++i) {
      if (values_[i].session >= 0) continue;
      for (const int side : {0, 1}) {
        const VectorXd theta = moved(i, side == 0 ? 1 : -1);
        if (ChangesDrive(values_[i].name)) moved_drives[i][side] = DrivesAt(theta);
        moved_models[i][side] = ModelsAt(theta);
      }
    }
    std::vector<Share> shares(shots_.size());
    ParallelFor(pool_, windows(), [&](int w) {
      const Shot& shot = shots_[w];
      const int log = shot.window.log;
      Motion motion;
      const Residuals r = ResidualsOf(shot, shot.x, models[shot.session], drives[log], motion);
      const int rows = static_cast<int>(r.angle.size()), more = static_cast<int>(r.torque.size());
      MatrixXd J = MatrixXd::Zero(rows + more, size()), K(rows + more, 4);
      const auto difference = [&](const Residuals& a, const Residuals& b, double h) {
        VectorXd d(rows + more);
        d.head(rows) = (a.angle - b.angle).reshaped() / (2 * h);
        d.tail(more) = (a.torque - b.torque).reshaped() / (2 * h);
        return d;
      };
      int common = 0;  // index of the machine's value; those of the sessions follow it
      for (int i = 0; i < size(); ++i) {
        if (values_[i].session >= 0) {
          // A session's deviation is added to the machine's value.
          if (values_[i].session == shot.session) J.col(i) = J.col(common);
          continue;
        }
        common = i;
        std::array<Residuals, 2> sides;
        for (const int side : {0, 1}) {
          const auto& own = moved_drives[i][side];
          sides[side] = ResidualsOf(shot, shot.x, moved_models[i][side][shot.session],
                                    own.empty() ? drives[log] : own[log], motion);
        }
        J.col(i) = difference(sides[0], sides[1], Difference(i));
      }
      for (int i = 0; i < 4; ++i) {
        const double h = 1e-5;
        Vector4d above = shot.x, below = shot.x;
        above(i) += h;
        below(i) -= h;
        K.col(i) =
            difference(ResidualsOf(shot, above, models[shot.session], drives[log], motion),
                       ResidualsOf(shot, below, models[shot.session], drives[log], motion), h);
      }
      shares[w] = ShareOf(shot, r, J, K);
    });
    return shares;
  }

  double Difference(int i) const { return 1e-4 * values_[i].scale; }

  Share ShareOf(const Shot& shot, const Residuals& r, const MatrixXd& J, const MatrixXd& K) const {
    Share s;
    s.squares = MeanSquare(r.angle);
    s.torque_squares = MeanSquare(r.torque);
    s.cost = Cost(r) + StartCost(shot, shot.x);
    // The robust cost weighs a window's residuals by 1 / (1 + r²/s²).
    const int rows = static_cast<int>(r.angle.size()), more = static_cast<int>(r.torque.size());
    VectorXd weight(rows + more), residual(rows + more);
    const auto weight_of = [](double square, double scale, double n) {
      return 1 / (1 + square / (scale * scale)) / (scale * scale * n);
    };
    weight.head(rows).setConstant(weight_of(s.squares, scale_, rows / 2.0));
    weight.tail(more).setConstant(weight_of(s.torque_squares, torque_scale_, more / 2.0));
    residual << r.angle.reshaped(), r.torque.reshaped();
    const MatrixXd WK = weight.asDiagonal() * K, WJ = weight.asDiagonal() * J;
    const Vector4d prior = kStartWeight * kStartDeviation.cwiseAbs2().cwiseInverse();
    s.Hxx = K.transpose() * WK;
    s.Hxx.diagonal() += prior;
    s.gx = WK.transpose() * residual + prior.cwiseProduct(shot.x - shot.cubic);
    s.Hxt = WK.transpose() * J;
    s.Htt = J.transpose() * WJ;
    s.gt = WJ.transpose() * residual;
    return s;
  }

  /// Sets the scales of the robust cost to the windows' median errors.
  void SetScales() {
    const std::vector<Model> models = ModelsAt(theta_);
    const std::vector<Drive> drives = DrivesAt(theta_);
    std::vector<double> errors(shots_.size()), torque_errors(shots_.size());
    ParallelFor(pool_, windows(), [&](int w) {
      Motion motion;
      const Shot& shot = shots_[w];
      const Residuals r =
          ResidualsOf(shot, shot.x, models[shot.session], drives[shot.window.log], motion);
      errors[w] = std::sqrt(MeanSquare(r.angle));
      torque_errors[w] = std::sqrt(MeanSquare(r.torque));
    });
    scale_ = std::clamp(Median(errors), kSmallestScale, kLargestScale);
    torque_scale_ = std::max(Median(torque_errors), kSmallestTorqueScale);
  }

  std::span<const MachineLog> logs_;
  Twin twin_;
  ThreadPool* pool_;
  std::vector<std::string> sessions_;
  std::vector<int> session_of_;                // of each log
  std::vector<std::array<bool, 2>> reported_;  // of each log: whether the joints report torques
  std::vector<Value> values_;
  VectorXd theta_;
  std::vector<Shot> shots_;
  double damping_ = 1e-3;
  double scale_ = kLargestScale, torque_scale_ = 1;  // rad, N·m
};

}  // namespace

FitResult Fit(std::span<const MachineLog> logs, const Twin& first,
              const std::vector<std::string>& names, const FitConfig& config, ThreadPool* pool,
              const Progress& progress) {
  Problem problem(logs, first, names, config, pool);
  if (problem.windows() == 0) {
    throw BadInput(Concat("identify: expected logs with a motion of ", config.windows.seconds,
                          " s away from upright, got none in ",
                          Counted(static_cast<int64_t>(logs.size()), "log")));
  }
  for (int i = 0; i < config.iterations; ++i) {
    const bool goes_on = problem.Step(config.tolerance);
    if (progress) progress(goes_on ? i + 1 : config.iterations, config.iterations);
    if (!goes_on) break;
  }
  FitResult result = problem.Result();
  constexpr double kHopeless = 10;  // median error in a window, rad
  const bool is_finite =
      std::ranges::all_of(result.twin.covariance, [](double x) { return std::isfinite(x); });
  if (!(result.error < kHopeless) || !is_finite) {
    throw BadInput(Concat("identify: expected logs that a model can follow, got a median error of ",
                          result.error, " rad; machine check finds faults of logs"));
  }
  return result;
}

}  // namespace upswing::machine

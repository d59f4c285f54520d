#include "extras/machine/twin/fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "extras/machine/twin/residuals.h"
#include "pendulum/posterior.h"

// Symbols: θ values to identify, c constants that follow from θ in a session, x start state of a
// window, r residuals; H.. blocks of the Gauss-Newton matrix, g. gradients.
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
constexpr double kFirstLag = 0.005;                           // s
// Variance of a new session, as a multiple of the twin's: real machines change more from session to
// session than the few that a twin knows.
constexpr double kNewSession = 10;

/// Typical differences of a value: standard deviations of its prior.
struct Deviations {
  double sessions;  // of a session's value about the machine's; 0: a tenth of the guess
  double guess;     // of the machine's value about a guess without covariance; 0: half of the guess
};

/// Encoders' zeros in rad, dry friction in N·m, times in s.
Deviations DeviationsOf(const std::string& name) {
  static const std::map<std::string, Deviations, std::less<>> kDeviations{
      {"zero1", {0.05, 0.05}},          {"zero2", {0.05, 0.05}},
      {"coulomb1", {0.03, 0.1}},        {"coulomb2", {0.03, 0.1}},
      {"damping1", {0.003, 0.02}},      {"damping2", {0.003, 0.02}},
      {"armature", {0.001, 0.005}},     {"current_inertia", {0.0005, 0.005}},
      {"delay", {0.001, 0.005}},        {"lag", {0.001, 0.005}},
      {"current_delay", {0.001, 0.005}}};
  const auto found = kDeviations.find(name);
  return found == kDeviations.end() ? Deviations{0, 0} : found->second;
}

/// An entry of θ: a setting of the twin; or, with a session, that session's deviation from it.
struct Value {
  std::string name;
  int session;  // -1: all
  Range range = {};
};

/// A window, and the start state of its cubic (rad, rad/s).
struct Shot {
  LogWindow window;
  Vector4d cubic;
  int session;  // index
};

/// Normal equations of the constants in which the start state is eliminated.
struct Reduced {
  ConstantsMatrix H;
  Constants g;
};

/// A window's part of the normal equations: start state x and constants c.
struct Block {
  Matrix4d Hxx;
  Vector4d gx;
  Eigen::Matrix<double, 4, kConstants> Hxc;
  ConstantsMatrix Hcc;
  Constants gc;

  /// Eliminates the damped start state.
  Reduced Eliminate(double damping) const {
    const Eigen::Matrix<double, kConstants, 4> half = Hxc.transpose() * Inverse(damping);
    return {Hcc - half * Hxc, gc - half * gx};
  }
  Matrix4d Inverse(double damping) const {
    Matrix4d damped = Hxx;
    damped.diagonal() *= 1 + damping;
    return damped.inverse();
  }
};

class Problem {
 public:
  Problem(std::span<const MachineLog> logs, const Twin& first, const Structure& structure,
          const FitConfig& config, ThreadPool* pool)
      : logs_(logs), twin_(first), adapts_(config.adapts), pool_(pool) {
    twin_.sessions.clear();
    twin_.uncertain.clear();
    twin_.covariance.clear();
    // Zeros stand for the capsules' centres and inertias.
    const auto [link1, link2] = LinksOf(twin_.plant);
    twin_.plant.center1 = link1.c;
    twin_.plant.center2 = link2.c;
    twin_.plant.inertia1 = link1.I;
    twin_.plant.inertia2 = link2.I;
    FindSessions();
    FindValues(structure);
    SetPrior(first);
    for (const LogWindow& w :
         CutWindows(logs, config.windows, first.plant.length1, first.plant.length2)) {
      starts_.emplace_back(w.start.q1, w.start.q2, w.start.w1, w.start.w2);
      shots_.push_back({w, starts_.back(), session_of_[w.log]});
      seen_.insert(session_of_[w.log]);
    }
  }

  int size() const { return static_cast<int>(values_.size()); }
  int windows() const { return static_cast<int>(shots_.size()); }

  /// One step of the method; false if no step decreases the cost any more.
  bool Step(double tolerance) {
    const std::vector<Share> shares = Linearize();
    SetScales(shares);
    const std::vector<MatrixXd> slopes = Slopes();
    const std::vector<Block> blocks = BlocksOf(shares);
    const double before = CostOf(shares, theta_, starts_);
    for (; damping_ < 1e6; damping_ *= 8) {
      const Evidence evidence = EvidenceOf(blocks, slopes, damping_);
      MatrixXd A = evidence.H + prior_;
      VectorXd b = evidence.g + prior_ * (theta_ - guess_);
      A.diagonal() *= 1 + damping_;
      A.diagonal().array() += 1e-12;
      for (int i = 0; i < size(); ++i) {
        // A value that would leave its range stays at the limit.
        const bool falls = b(i) > 0;
        const bool stays_low = falls && theta_(i) <= values_[i].range.low;
        const bool stays_high = !falls && theta_(i) >= values_[i].range.high;
        if (stays_low || stays_high) Forget(i, A, b);
      }
      VectorXd theta = theta_ - A.ldlt().solve(b);
      for (int i = 0; i < size(); ++i) {
        theta(i) = std::clamp(theta(i), values_[i].range.low, values_[i].range.high);
      }
      std::vector<Vector4d> starts;
      for (int w = 0; w < windows(); ++w) {
        const Constants change = slopes[shots_[w].session] * (theta - theta_);
        starts.emplace_back(starts_[w] -
                            blocks[w].Inverse(damping_) * (blocks[w].gx + blocks[w].Hxc * change));
      }
      const double after = CostOf(SharesAt(theta, starts, false), theta, starts);
      if (!(after < before)) continue;
      theta_ = theta;
      starts_ = starts;
      damping_ = std::max(damping_ / 5, 1e-7);
      return before - after > tolerance * std::abs(before);
    }
    return false;
  }

  /// Expectation maximisation for the covariance between sessions (Laird and Ware, 1982) at this θ.
  /// The first assumption counts as one more session. False if no value differs between sessions.
  bool EstimateBetween() {
    if (adapts_ || between_.size() == 0) return false;
    const Evidence evidence = EvidenceOf(BlocksOf(Linearize()), Slopes(), 0);
    const MatrixXd first = FirstBetween();
    for (int i = 0; i < 200; ++i) {
      const Solution solution = Solve(evidence);
      MatrixXd sum = first;
      for (const int s : seen_) {
        const std::vector<int> own = OwnOf(s);
        const VectorXd difference = (theta_ + solution.change)(own);
        sum += difference * difference.transpose() + solution.inverse(own, own);
      }
      SetBetween(sum / (std::ssize(seen_) + 1.0));
    }
    damping_ = 1e-3;
    return true;
  }

  FitResult Result() {
    const std::vector<Share> shares = Linearize();
    FitResult result;
    result.twin = TwinAt(theta_, -1);
    Covariances(shares, result.twin);
    if (!adapts_) {
      for (const int s : seen_) result.twin.sessions.push_back(SessionAt(s));
    }
    result.windows = windows();
    result.error = MedianError(shares, &Share::angle);
    return result;
  }

 private:
  /// The values of a session.
  Session SessionAt(int index) const {
    const Twin own = TwinAt(theta_, index);
    Session session;
    session.name = sessions_[index];
    for (const Value& v : values_) {
      if (v.session == index) session.values.emplace_back(v.name, NumberIn(own, v.name));
    }
    return session;
  }

  static double NumberIn(Twin twin, const std::string& name) {
    return OptionsOf(twin).Get(name)->number();
  }

  /// Makes A x = b ask for x(i) = 0.
  template <typename Right>
  static void Forget(int i, MatrixXd& A, Right& b) {
    A.row(i).setZero();
    A.col(i).setZero();
    A(i, i) = 1;
    b.row(i).setZero();
  }

  void FindSessions() {
    std::map<std::string, int> sessions;
    for (const MachineLog& log : logs_) {
      const auto [place, is_new] =
          sessions.emplace(adapts_ ? "" : SessionOf(log.name), static_cast<int>(sessions_.size()));
      if (is_new) sessions_.push_back(place->first);
      session_of_.push_back(place->second);
      reported_.push_back({HasTorque(log.measured, 0), HasTorque(log.measured, 1)});
    }
  }

  void FindValues(const Structure& structure) {
    const Options options = OptionsOf(twin_);
    std::vector<double> theta;
    for (const std::string& name : structure.values) {
      const Option& option = *options.Find(name, "identify").front();
      // The model counts lags below 10 µs as equal, so the derivative at lag 0 is 0.
      const bool moves = name == "lag" && option.number() == 0;
      values_.push_back({name, -1, UncertainRange(option)});
      theta.push_back(moves ? kFirstLag : option.number());
      if (adapts_ || std::ranges::count(structure.of_session, name) == 0) continue;
      for (int s = 0; s < static_cast<int>(sessions_.size()); ++s) {
        values_.push_back({name, s});
        theta.push_back(0);
      }
    }
    theta_ = guess_ = Eigen::Map<VectorXd>(theta.data(), size());
  }

  /// Sets the prior. In an identification, sessions' deviations and times have one: motors take
  /// milliseconds, and without reported torques much larger delays can imitate friction.
  void SetPrior(const Twin& first) {
    prior_ = MatrixXd::Zero(size(), size());
    if (adapts_) {
      prior_ = NewSessionOf(first).inverse();
      return;
    }
    for (int i = 0; i < size(); ++i) {
      const std::string& name = values_[i].name;
      const bool is_time = name == "delay" || name == "lag" || name == "current_delay";
      if (is_time && values_[i].session < 0) prior_(i, i) = std::pow(DeviationsOf(name).guess, -2);
    }
    SetBetween(FirstBetween());
  }

  /// Indices in θ of a session's values.
  std::vector<int> OwnOf(int session) const {
    std::vector<int> own;
    for (int i = 0; i < size(); ++i) {
      if (values_[i].session == session) own.push_back(i);
    }
    return own;
  }

  /// The covariance of a session's values that is assumed at first.
  MatrixXd FirstBetween() const {
    const std::vector<int> own = OwnOf(0);
    VectorXd deviations(std::ssize(own));
    for (int k = 0; k < static_cast<int>(own.size()); ++k) {
      const std::string& name = values_[own[k]].name;
      const double known = DeviationsOf(name).sessions;
      deviations(k) = known > 0 ? known : std::abs(NumberIn(twin_, name)) / 10;
    }
    return deviations.cwiseAbs2().asDiagonal();
  }

  void SetBetween(const MatrixXd& covariance) {
    between_ = covariance;
    const MatrixXd inverse = covariance.inverse();
    for (int s = 0; s < static_cast<int>(sessions_.size()); ++s) {
      const std::vector<int> own = OwnOf(s);
      prior_(own, own) = inverse;
    }
  }

  /// The covariance of θ in a new session: a multiple of the twin's covariance, wide for values
  /// without one.
  MatrixXd NewSessionOf(const Twin& twin) const {
    const auto at = [&](int i, int j) {
      return kNewSession * machine::CovarianceOf(twin, values_[i].name, values_[j].name);
    };
    MatrixXd covariance = MatrixXd::Zero(size(), size());
    for (int i = 0; i < size(); ++i) {
      for (int j = 0; j < size(); ++j) {
        if (at(i, i) > 0 && at(j, j) > 0) covariance(i, j) = at(i, j);
      }
      const double wide = DeviationsOf(values_[i].name).guess;
      if (!(at(i, i) > 0)) covariance(i, i) = std::pow(wide > 0 ? wide : guess_(i) / 2, 2);
      covariance(i, i) *= 1 + 1e-4;  // positive in spite of rounding
    }
    return covariance;
  }

  /// The twin with the values θ of a session; of the machine for -1.
  Twin TwinAt(const VectorXd& theta, int session) const {
    Twin twin = twin_;
    const Options options = OptionsOf(twin);
    for (int i = 0; i < size(); ++i) {
      if (values_[i].session >= 0 && values_[i].session != session) continue;
      // A session's deviation comes after the machine's value.
      const Option& option = *options.Get(values_[i].name);
      double& value = *std::get<double*>(option.target);
      value = values_[i].session < 0 ? theta(i) : value + theta(i);
      const Range range = UncertainRange(option);
      value = std::clamp(value, range.low, range.high);
    }
    return twin;
  }

  /// ∂c/∂θ of each session (kConstants × n).
  std::vector<MatrixXd> Slopes() const {
    std::vector<MatrixXd> slopes;
    for (int s = 0; s < static_cast<int>(sessions_.size()); ++s) {
      MatrixXd& slope = slopes.emplace_back(MatrixXd::Zero(kConstants, size()));
      int common = 0;  // index of the machine's value; those of the sessions follow it
      for (int i = 0; i < size(); ++i) {
        if (values_[i].session < 0) {
          common = i;
          constexpr double h = 1e-7;
          VectorXd above = theta_, below = theta_;
          above(i) += h;
          below(i) -= h;
          slope.col(i) = (ConstantsOf(TwinAt(above, s)) - ConstantsOf(TwinAt(below, s))) / (2 * h);
        } else if (values_[i].session == s) {
          slope.col(i) = slope.col(common);
        }
      }
    }
    return slopes;
  }

  /// The residuals of all windows at θ from these start states, computed in parallel.
  std::vector<Share> SharesAt(const VectorXd& theta, const std::vector<Vector4d>& starts,
                              bool linearizes) const {
    std::vector<Twin> twins;
    for (int s = 0; s < static_cast<int>(sessions_.size()); ++s) twins.push_back(TwinAt(theta, s));
    std::vector<Drive> drives;
    for (size_t i = 0; i < logs_.size(); ++i) {
      drives.push_back(Drive::Commanded(logs_[i], twins[session_of_[i]]));
    }
    std::vector<Share> shares(shots_.size());
    ParallelFor(pool_, windows(), [&](int w) {
      const Shot& shot = shots_[w];
      const int log = shot.window.log;
      shares[w] = ShareOf(logs_[log], shot.window, reported_[log], starts[w], twins[shot.session],
                          drives[log], linearizes);
    });
    return shares;
  }
  std::vector<Share> Linearize() const { return SharesAt(theta_, starts_, true); }

  /// The blocks of the windows. The robust cost ln(1 + r²/s²) weighs squares by 1 / (s² + r²).
  std::vector<Block> BlocksOf(const std::vector<Share>& shares) const {
    const Vector4d prior = kStartWeight * kStartDeviation.cwiseAbs2().cwiseInverse();
    std::vector<Block> blocks;
    for (int w = 0; w < windows(); ++w) {
      const auto& [angle, torque] = shares[w];
      const double a = 1 / (scale_ * scale_ + angle.mean);
      const double t = 1 / (torque_scale_ * torque_scale_ + torque.mean);
      const auto H = (a * angle.H + t * torque.H).eval();
      const auto g = (a * angle.g + t * torque.g).eval();
      Block& b = blocks.emplace_back();
      b.Hxx = H.topLeftCorner<4, 4>();
      b.Hxx.diagonal() += prior;
      b.Hxc = H.topRightCorner<4, kConstants>();
      b.Hcc = H.bottomRightCorner<kConstants, kConstants>();
      b.gx = g.head<4>() + prior.cwiseProduct(starts_[w] - shots_[w].cubic);
      b.gc = g.tail<kConstants>();
    }
    return blocks;
  }

  /// Cost of all windows' residuals, ln(1 + r²/s²) of the mean square of both kinds, of their
  /// start states and of θ.
  double CostOf(const std::vector<Share>& shares, const VectorXd& theta,
                const std::vector<Vector4d>& starts) const {
    double cost = (theta - guess_).dot(prior_ * (theta - guess_));
    for (int w = 0; w < windows(); ++w) {
      const auto& [angle, torque] = shares[w];
      const double start =
          (starts[w] - shots_[w].cubic).cwiseQuotient(kStartDeviation).squaredNorm();
      cost += std::log1p(angle.mean / (scale_ * scale_)) +
              std::log1p(torque.mean / (torque_scale_ * torque_scale_)) + kStartWeight * start;
    }
    return cost;
  }

  /// Sets the scales of the robust cost to the windows' median errors.
  void SetScales(const std::vector<Share>& shares) {
    scale_ = std::clamp(MedianError(shares, &Share::angle), kSmallestScale, kLargestScale);
    torque_scale_ = std::max(MedianError(shares, &Share::torque), kSmallestTorqueScale);
  }
  static double MedianError(const std::vector<Share>& shares, Squares Share::*kind) {
    std::vector<double> errors;
    for (const Share& s : shares) errors.push_back(std::sqrt((s.*kind).mean));
    return Median(errors);
  }

  /// Normal equations H θ = g of the windows, after the elimination of damped start states.
  struct Evidence {
    MatrixXd H;
    VectorXd g;
    MatrixXd scatter;  // sum of the squares of the parts of g that the blocks of windows give
    int blocks;
  };
  Evidence EvidenceOf(const std::vector<Block>& blocks, const std::vector<MatrixXd>& slopes,
                      double damping) const {
    const MatrixXd zero = MatrixXd::Zero(size(), size());
    Evidence e{zero, VectorXd::Zero(size()), zero, 0};
    std::vector<ConstantsMatrix> H(sessions_.size(), ConstantsMatrix::Zero());
    // Windows overlap, so neighbours share rows: several in a row count as one.
    constexpr int kInARow = 6;
    VectorXd score = VectorXd::Zero(size());
    for (int w = 0; w < windows(); ++w) {
      const Reduced reduced = blocks[w].Eliminate(damping);
      H[shots_[w].session] += reduced.H;
      score += slopes[shots_[w].session].transpose() * reduced.g;
      const bool ends_log = w + 1 == windows() || shots_[w + 1].window.log != shots_[w].window.log;
      if (ends_log || (w + 1) % kInARow == 0) {
        e.g += score;
        e.scatter += score * score.transpose();
        score.setZero();
        ++e.blocks;
      }
    }
    for (size_t s = 0; s < H.size(); ++s) e.H += slopes[s].transpose() * H[s] * slopes[s];
    return e;
  }

  /// The solution of the normal equations.
  struct Solution {
    VectorXd change;   // (n) of θ
    MatrixXd inverse;  // (n × n) of the matrix
  };
  Solution Solve(const Evidence& e) const {
    MatrixXd A = e.H + prior_;
    VectorXd b = e.g + prior_ * (theta_ - guess_);
    A.diagonal().array() += 1e-12;
    MatrixXd I = MatrixXd::Identity(size(), size());
    // A value at the limit of its range is taken as known.
    for (int i = 0; i < size(); ++i) {
      const Value& v = values_[i];
      if (theta_(i) > v.range.low && theta_(i) < v.range.high) continue;
      Forget(i, A, b);
      I(i, i) = 0;
    }
    const Eigen::LDLT<MatrixXd> factors(A);
    return {-factors.solve(b), factors.solve(I)};
  }

  /// Sets the names and the covariance of the machine's values.
  void Covariances(const std::vector<Share>& shares, Twin& twin) const {
    const Evidence evidence = EvidenceOf(BlocksOf(shares), Slopes(), 0);
    MatrixXd covariance = Solve(evidence).inverse;
    if (!adapts_) {
      // The fit makes the scores smaller than those of the true values: MacKinnon and White (1985),
      // HC1, with blocks as observations, and without what the prior determines.
      const double rest = evidence.blocks - (covariance * evidence.H).trace();
      const double factor = evidence.blocks / std::max(evidence.blocks / 2.0, rest);
      covariance = covariance * (factor * evidence.scatter + prior_) * covariance;
    }
    covariance = (covariance + covariance.transpose()).eval() / 2;
    std::vector<int> own, differ;  // the machine's entries of θ; places in it of those of sessions
    for (int i = 0; i < size(); ++i) {
      if (values_[i].session >= 0) continue;
      // A session's values follow the machine's in θ.
      const bool differs = i + 1 < size() && values_[i + 1].session >= 0;
      if (differs) differ.push_back(static_cast<int>(own.size()));
      own.push_back(i);
      twin.uncertain.push_back(values_[i].name);
    }
    MatrixXd total = covariance(own, own);
    total(differ, differ) += between_;
    twin.covariance.assign(total.data(), total.data() + total.size());
  }

  std::span<const MachineLog> logs_;
  Twin twin_;
  bool adapts_;
  ThreadPool* pool_;
  std::vector<std::string> sessions_;
  std::vector<int> session_of_;                // of each log
  std::vector<std::array<bool, 2>> reported_;  // of each log: whether the joints report torques
  std::vector<Value> values_;
  VectorXd theta_, guess_;        // (n) now, and at first
  MatrixXd prior_;                // (n × n) inverse covariance about the guess; 0: none
  MatrixXd between_;              // (k × k) covariance of a session's k values about the machine's
  std::vector<Shot> shots_;       // (windows)
  std::set<int> seen_;            // sessions with windows
  std::vector<Vector4d> starts_;  // (windows) start states now
  double damping_ = 1e-3;
  double scale_ = kLargestScale, torque_scale_ = 1;  // rad, N·m
};

}  // namespace

FitResult Fit(std::span<const MachineLog> logs, const Twin& first, const Structure& structure,
              const FitConfig& config, ThreadPool* pool, const Progress& progress) {
  Problem problem(logs, first, structure, config, pool);
  if (problem.windows() == 0) {
    throw BadInput(Concat("expected logs with a motion of ", config.windows.seconds,
                          " s away from upright, got none in ",
                          Counted(static_cast<int64_t>(logs.size()), "log"),
                          "; machine check finds units and rests"));
  }
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    if (round > 0 && !problem.EstimateBetween()) break;
    for (int i = 0; i < config.iterations; ++i) {
      if (!problem.Step(config.tolerance)) break;
      if (progress) progress(round + (i + 1.0) / config.iterations, kRounds);
    }
  }
  if (progress) progress(kRounds, kRounds);
  FitResult result = problem.Result();
  constexpr double kHopeless = 10;  // median error in a window, rad
  const bool is_finite =
      std::ranges::all_of(result.twin.covariance, [](double x) { return std::isfinite(x); });
  if (!(result.error < kHopeless) || !is_finite) {
    throw BadInput(Concat("expected logs that a model can follow, got a median error of ",
                          result.error, " rad; machine check finds faults of logs"));
  }
  return result;
}

}  // namespace upswing::machine

#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/options.h"
#include "extras/machine/logs/log.h"
#include "extras/machine/twin/motion.h"
#include "extras/machine/twin/residuals.h"
#include "extras/machine/twin/twin.h"
#include "pendulum/scale.h"

/// The values θ that an identification changes, and what they mean for a twin.
namespace upswing::machine {

/// The values to identify, by name. Other values stay at the first guess.
struct Structure {
  std::string name;
  std::vector<std::string> values;
  std::vector<std::string> of_session = {};  // values that differ between sessions
};

/// The sessions of logs, in the order of their first logs.
struct LogSessions {
  std::vector<std::string> names;  // (sessions)
  std::vector<int> of_log;         // (logs) index of each log's session

  int size() const { return static_cast<int>(names.size()); }
};

/// Groups logs by SessionOf.
LogSessions SessionsOf(std::span<const MachineLog> logs);
/// Puts all logs into one session without a name.
LogSessions OneSession(std::span<const MachineLog> logs);

/// An entry of θ: a setting of the twin; or, with a session, that session's deviation from it.
struct FitValue {
  std::string name;
  std::optional<int> session = {};  // none: the machine's value
  int machine = 0;                  // index in θ of the machine's value; that of itself
  bool differs = false;             // the machine's value has deviations of sessions
  Range range = {};                 // of the entry
};

/// The entries of θ and the twins that they stand for.
class FitParameters {
 public:
  /// `first` has the first guess, and the values that stay. Throws BadInput for an unknown name.
  FitParameters(const Twin& first, const Structure& structure, const LogSessions& sessions);

  /// n, the number of entries of θ.
  int size() const { return static_cast<int>(values_.size()); }
  const FitValue& operator[](int i) const { return values_[i]; }
  const LogSessions& sessions() const { return sessions_; }
  /// θ at first (n).
  const Eigen::VectorXd& guess() const { return guess_; }
  /// A setting of the twin at first, by name.
  double FirstNumber(const std::string& name) const;

  /// The derivatives that the values need.
  Detail detail() const;
  /// ScaleOverUsual of the first guess, by which priors count.
  const Scale& scale() const { return scale_; }

  /// Indices in θ of the machine's values.
  std::vector<int> IndicesOfMachine() const;
  /// Indices in θ of a session's deviations. All sessions have those of the same k values, in the
  /// same order.
  std::vector<int> IndicesOfSession(int session) const;

  /// Whether values differ between sessions.
  bool HasDeviations() const { return !IndicesOfSession(0).empty(); }

  /// The twin of a session: the machine's values and the session's deviations, within their ranges.
  /// Without a session, the machine's values only.
  Twin TwinAt(const Eigen::VectorXd& theta, std::optional<int> session) const;
  /// θ with the machine's values at the means over the `seen` sessions, and the same values of
  /// sessions. No other machine's values have smaller deviations, in any norm that all sessions
  /// share.
  Eigen::VectorXd Centred(const Eigen::VectorXd& theta, std::span<const int> seen) const;
  /// The values of a session that differ from the machine's.
  Session SessionAt(const Eigen::VectorXd& theta, int session) const;

  /// ∂c/∂θ (NumConstants × n) of a session, where c are the constants of its twin (ConstantsOf).
  Eigen::MatrixXd Slope(const Eigen::VectorXd& theta, int session) const;

 private:
  Twin base_;  // the first guess, without covariance and sessions
  Scale scale_;
  LogSessions sessions_;
  std::vector<FitValue> values_;
  Eigen::VectorXd guess_;
};

}  // namespace upswing::machine

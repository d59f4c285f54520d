#include "extras/machine/twin/fit_parameters.h"

#include <algorithm>
#include <map>

#include "extras/machine/twin/motion.h"
#include "pendulum/posterior.h"

namespace upswing::machine {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFirstLag = 0.005;  // s

/// A twin whose covariance and sessions are to be found. Centres and inertias of 0, which stand for
/// those of capsules, are replaced by these.
Twin WithoutResults(const Twin& first) {
  Twin twin = first;
  twin.distrust.clear();
  twin.sessions.clear();
  twin.uncertain.clear();
  twin.covariance.clear();
  const auto [link1, link2] = LinksOf(twin.plant);
  twin.plant.center1 = link1.c;
  twin.plant.center2 = link2.c;
  twin.plant.inertia1 = link1.I;
  twin.plant.inertia2 = link2.I;
  return twin;
}

/// The range of a value in a fit. A torque without lag jumps between two steps of the integration,
/// which then do not see the derivative by the delay. A lag of a step is as good.
Range FitRange(const Option& option) {
  Range range = UncertainRange(option);
  if (option.name == "lag") range.low = kMotionStep;
  return range;
}

/// The value that a fit begins with.
double FirstGuessOf(const Option& option) {
  return option.name == "lag" && option.number() < kMotionStep ? kFirstLag : option.number();
}

double NumberIn(Twin twin, const std::string& name) { return OptionsOf(twin).Get(name)->number(); }

}  // namespace

LogSessions SessionsOf(std::span<const MachineLog> logs) {
  LogSessions sessions;
  std::map<std::string, int> known;
  for (const MachineLog& log : logs) {
    const auto [place, is_new] = known.emplace(SessionOf(log.name), sessions.size());
    if (is_new) sessions.names.push_back(place->first);
    sessions.of_log.push_back(place->second);
  }
  return sessions;
}

LogSessions OneSession(std::span<const MachineLog> logs) {
  return {.names = {""}, .of_log = std::vector<int>(logs.size(), 0)};
}

FitParameters::FitParameters(const Twin& first, const Structure& structure,
                             const LogSessions& sessions)
    : base_(WithoutResults(first)), scale_(ScaleOverUsual(base_.plant)), sessions_(sessions) {
  const Options options = OptionsOf(base_);
  std::vector<double> guess;
  for (const std::string& name : structure.values) {
    const Option& option = *options.Find(name, "identify").front();
    const bool differs = std::ranges::count(structure.of_session, name) > 0;
    const int machine = size();
    values_.push_back(
        {.name = name, .machine = machine, .differs = differs, .range = FitRange(option)});
    guess.push_back(FirstGuessOf(option));
    if (!differs) continue;
    for (int s = 0; s < sessions_.size(); ++s) {
      values_.push_back({.name = name, .session = s, .machine = machine});
      guess.push_back(0);
    }
  }
  guess_ = Eigen::Map<VectorXd>(guess.data(), size());
}

double FitParameters::FirstNumber(const std::string& name) const { return NumberIn(base_, name); }

Detail FitParameters::detail() const {
  if (base_.cogging.any()) return Detail::kCogging;
  const bool has_offsets = std::ranges::any_of(
      values_, [](const FitValue& value) { return IsTorqueOffset(value.name); });
  return has_offsets ? Detail::kOffsets : Detail::kUsual;
}

std::vector<int> FitParameters::IndicesOfMachine() const {
  std::vector<int> own;
  for (int i = 0; i < size(); ++i) {
    if (!values_[i].session) own.push_back(i);
  }
  return own;
}

std::vector<int> FitParameters::IndicesOfSession(int session) const {
  std::vector<int> own;
  for (int i = 0; i < size(); ++i) {
    if (values_[i].session == session) own.push_back(i);
  }
  return own;
}

Twin FitParameters::TwinAt(const VectorXd& theta, std::optional<int> session) const {
  Twin twin = base_;
  const Options options = OptionsOf(twin);
  // A session's deviations come after the machine's values in θ.
  for (int i = 0; i < size(); ++i) {
    const std::optional<int> owner = values_[i].session;
    if (owner && owner != session) continue;
    const Option& option = *options.Get(values_[i].name);
    double& value = *std::get<double*>(option.target);
    value = owner ? value + theta(i) : theta(i);
    const Range range = FitRange(option);
    value = std::clamp(value, range.low, range.high);
  }
  return twin;
}

VectorXd FitParameters::Centred(const VectorXd& theta, std::span<const int> seen) const {
  VectorXd centred = theta;
  if (seen.empty()) return centred;
  for (const int i : IndicesOfMachine()) centred(i) = values_[i].differs ? 0 : theta(i);
  const double share = 1 / static_cast<double>(seen.size());
  for (const int s : seen) {
    const Twin own = TwinAt(theta, s);
    for (const int i : IndicesOfSession(s)) {
      centred(i) = NumberIn(own, values_[i].name);
      centred(values_[i].machine) += share * centred(i);
    }
  }
  for (const int s : seen) {
    for (const int i : IndicesOfSession(s)) centred(i) -= centred(values_[i].machine);
  }
  return centred;
}

Session FitParameters::SessionAt(const VectorXd& theta, int session) const {
  const Twin own = TwinAt(theta, session);
  Session result;
  result.name = sessions_.names[session];
  for (const int i : IndicesOfSession(session)) {
    result.values.push_back({values_[i].name, NumberIn(own, values_[i].name)});
  }
  return result;
}

MatrixXd FitParameters::Slope(const VectorXd& theta, int session) const {
  constexpr double h = 1e-7;
  MatrixXd slope = MatrixXd::Zero(NumConstants(detail()), size());
  for (const int i : IndicesOfMachine()) {
    VectorXd above = theta, below = theta;
    above(i) += h;
    below(i) -= h;
    slope.col(i) = (ConstantsOf(TwinAt(above, session), detail()) -
                    ConstantsOf(TwinAt(below, session), detail())) /
                   (2 * h);
  }
  // A session's deviation has the effect of the machine's value.
  for (const int i : IndicesOfSession(session)) slope.col(i) = slope.col(values_[i].machine);
  return slope;
}

}  // namespace upswing::machine

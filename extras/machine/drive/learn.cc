#include "extras/machine/drive/learn.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "extras/machine/drive/excitation.h"
#include "extras/machine/drive/learn_candidates.h"
#include "extras/machine/drive/learn_causes.h"
#include "extras/machine/drive/learn_trials.h"
#include "extras/machine/drive/learning_run.h"
#include "extras/machine/drive/policy_controller.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/twin/first_twin.h"
#include "extras/machine/twin/identify.h"
#include "extras/machine/twin/physics_rules.h"
#include "os/file.h"

namespace upswing::machine {
namespace {

// All times are for UsualPlant, and count by the scale of the machine.

/// The plan of an excitation.
struct ExcitationPlan {
  double seconds;  // length, s
  double lean;     // of the links, that it aims at, rad
  double energy;   // that it aims at; 1: upright
  double window;   // length of the windows in which a model predicts its motion, s
};
constexpr ExcitationPlan kSmallMotion{4, 0.8, 0.2, 0.3}, kLargeMotion{6, 2, 0.6, 0.5};
constexpr double kLimitShare = 0.6;  // share of the user's limits that an excitation aims at
constexpr int kMostExcitations = 3;  // until a twin that explains nothing has to do

constexpr double kLargestError = 0.1;     // of a fit, rad
constexpr double kLargestZero = 0.2;      // of the encoders, rad
constexpr double kLongestSwinging = 600;  // until links without friction rest, s
constexpr double kMostSpread = 4;         // of simulated machines, in deviations of the twin

/// A controller to try.
struct Choice {
  MachinePolicy policy;  // null: none
  PolicyArguments arguments;
  int candidate = 0;        // index
  double compensation = 0;  // share of dry friction that motors compensate under it
  int held = 0;             // simulated machines that it balances
};

/// Adds the processor time (s) of its lifetime to a total, also if an exception ends it.
class ProcessorTimer {
 public:
  explicit ProcessorTimer(double& total) : total_(total) {}
  ~ProcessorTimer() { total_ += Seconds() - begin_; }
  ProcessorTimer(const ProcessorTimer&) = delete;
  ProcessorTimer& operator=(const ProcessorTimer&) = delete;

 private:
  static double Seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

  double& total_;
  double begin_ = Seconds();
};

/// A session of learning.
class LearningSession {
 public:
  LearningSession(const LearnConfig& config, MachineLink& link, const std::filesystem::path& out,
                  ThreadPool* pool, const std::function<void(const std::string&)>& say,
                  const std::function<bool()>& stop)
      : c_(config),
        link_(link),
        out_(out),
        pool_(pool),
        say_(say),
        stop_(stop),
        twin_(config.Known()) {}

  LearnResult Work() {
    try {
      Identify();
      while (!Try()) Fit(kLargeMotion.window);
      return result_;
    } catch (const Ended& ended) {
      result_.reason = ended.reason;
    }
    if (!stop_()) AddCauses();
    return result_;
  }

 private:
  /// The session ends without balance.
  struct Ended {
    std::string reason;
  };

  /// Moves the links until a twin explains the motion.
  void Identify() {
    const Twin known = twin_;
    const double time_of_more = TimeOf(kLargeMotion) + TimeOfTry();
    Excite(kSmallMotion, /*has_twin=*/false);
    ExpectMotion();
    Fit(kSmallMotion.window);
    // A link that hardly moved shows no twin that is good enough to estimate the state.
    bool has_twin =
        explains_ && LargerMagnitude(twin_.sensors.zero1, twin_.sensors.zero2) < kLargestZero;
    for (int i = 1; i < kMostExcitations; ++i) {
      if (!has_twin) twin_ = known;
      Excite(kLargeMotion, has_twin);
      Fit(kLargeMotion.window);
      has_twin = explains_;
      if (IsTrusted() || TimeLeft() < time_of_more) break;
    }
    if (!explains_ && !OutsidePhysics(twin_, /*reports=*/true).empty()) {
      throw Ended{"no twin explains the motion: " + twin_.distrust};
    }
    is_identified_ = true;
    for (const std::string& fall : FallsBeyond(twin_, c_.limits)) say_("  warning: " + fall);
  }

  bool IsTrusted() const { return twin_.distrust.empty(); }

  double TimeLeft() const { return c_.MostMotion() - result_.motion; }
  /// Longest time of an excitation, s.
  double TimeOf(const ExcitationPlan& e) const {
    return e.seconds * scale().time + c_.limits.brake_seconds;
  }
  /// Time that a try needs for a quick swing-up, balance and the brake, s.
  double TimeOfTry() const {
    constexpr double kQuickSwingUp = 2;  // s
    return kQuickSwingUp * scale().time + c_.hold + c_.limits.brake_seconds;
  }

  void ExpectBudget() const {
    if (stop_()) throw Ended{"stopped"};
    constexpr double kLeast = 1;  // of a run, s
    if (TimeLeft() < kLeast * std::min(1.0, scale().time)) {
      throw Ended{"the time of motion is used up"};
    }
    if (result_.computing >= c_.computing) throw Ended{"the time of computing is used up"};
  }

  void ExpectTimeOfTry() const {
    if (TimeLeft() >= TimeOfTry()) return;
    throw Ended{fmt::format(
        "the time of motion is used up: another try takes {:.1f} s or more, and {:.1f} s are left",
        TimeOfTry(), std::max(0.0, TimeLeft()))};
  }

  /// The natural units of the machine over those of UsualPlant, as far as they are known.
  Scale scale() const { return ScaleOverUsual(twin_.plant); }

  /// Ends the session unless the first excitation moved a link.
  void ExpectMotion() const {
    constexpr double kLeast = 0.05;  // rad
    const Pieces last(&logs_.back(), 1);
    const double range = std::max(AngleRange(last, 0), AngleRange(last, 1));
    if (range > kLeast) return;
    throw Ended{fmt::format(
        "the links moved by {:.3f} rad only under torques up to {:g} N·m: does anything hold them?",
        range, c_.limits.torque)};
  }

  /// Runs work that computes, and counts its processor time. An error of it ends the session.
  template <typename Work>
  void Compute(const Work& work) {
    const ProcessorTimer timer(result_.computing);
    try {
      work();
    } catch (const Error& error) {
      throw Ended{error.what()};
    }
  }

  /// Moves the links with growing torques. `has_twin`: whether the twin can estimate the state and
  /// its energy.
  void Excite(const ExcitationPlan& e, bool has_twin) {
    const double energy = std::min(e.energy, kLimitShare * c_.limits.energy);
    // Links that swing to this lean have this energy.
    const double lean =
        std::min({e.lean, kLimitShare * c_.limits.angle, std::acos(1 - 2 * energy)});
    const double seconds = e.seconds * scale().time;
    say_(fmt::format("excite: torques grow until the links lean {:.2f} rad, {:.3g} s", lean,
                     seconds));
    const Estimator estimator =
        has_twin ? Estimator(twin_, 1 / c_.hz) : Estimator(twin_.sensors, 1 / c_.hz);
    const Excitation torques(c_.limits.torque, c_.actuated_joint,
                             has_twin ? LevelWithEnergy(lean, energy) : LevelOfMotion(lean),
                             c_.seed + logs_.size(), scale());
    const double cycles = std::max(1.0, std::round(kControlPeriod * scale().time * c_.hz));
    Run({.limits = c_.limits, .seconds = seconds, .scale = scale(), .start_angle = StartAngle()},
        estimator, MachineController(torques, cycles / c_.hz));
  }

  /// The first run needs links that hang: they show the zeros of the encoders. Later, dry friction
  /// may hold the links wherever they come to rest.
  double StartAngle() const { return logs_.empty() ? kStartAngle : kAnyAngle; }

  /// The level of an excitation, 1 at its aim: lean (rad) and velocity of the links.
  Excitation::Level LevelOfMotion(double lean) const {
    const double velocity = kLimitShare * c_.limits.velocity;
    return [=](const PendulumState& s) {
      // Lean and velocity add up as energies do: links that lean and move go on to lean further.
      return std::hypot(LargerMagnitude(Wrapped(s.q1), Wrapped(s.q1 + s.q2)) / lean,
                        LargerMagnitude(s.w1, s.w2) / velocity);
    };
  }

  /// The same, or the energy (1: upright) of the twin as a share of `energy`, if that is more.
  Excitation::Level LevelWithEnergy(double lean, double energy) const {
    const Manipulator body = ManipulatorOf(twin_.plant);
    const double hanging = -body.At({}).energy;
    return [=, of_motion = LevelOfMotion(lean)](const PendulumState& s) {
      return std::max(of_motion(s), (1 + body.At(s).energy / hanging) / energy);
    };
  }

  RunOutcome Run(RunRules rules, const Estimator& estimator, MachineController controller) {
    ExpectBudget();
    rules.motion = TimeLeft();
    rules.log = (out_ / fmt::format("log-{:02}.csv", logs_.size() + 1)).string();
    const double swinging = kLongestSwinging * std::max(1.0, rules.scale.time);
    if (!logs_.empty()) rules.limits.patience = std::max(rules.limits.patience, swinging);
    RunOutcome run =
        RunCycles(c_, rules, twin_.sensors, estimator, std::move(controller), link_, stop_);
    if (run.motion == 0) {
      if (stop_()) throw Ended{"stopped"};
      if (logs_.empty()) throw Failure(run.reason);
      throw Ended{run.reason};
    }
    result_.motion += run.motion;
    logs_.push_back(ReadLog(rules.log).front());
    SayRun(rules.log, run);
    // A machine that does not answer gets no more torque.
    if (run.faulty) {
      is_faulty_ = true;
      throw Ended{run.reason};
    }
    const Joints& last = logs_.back().angle.back();
    if (LargerMagnitude(last[0], last[1]) > c_.limits.angle) {
      throw Ended{"the links hang beyond --max-angle: turn them back, or raise it"};
    }
    return run;
  }

  /// Says what the newest log has. `file`: its name.
  void SayRun(const std::string& file, const RunOutcome& run) const {
    const MachineLog& log = logs_.back();
    Joints angle{}, torque{};
    for (int k = 0; k < log.rows(); ++k) {
      for (int j = 0; j < 2; ++j) {
        angle[j] = LargerMagnitude(angle[j], log.angle[k][j]);
        torque[j] = LargerMagnitude(torque[j], log.commanded[k][j]);
      }
    }
    say_(
        fmt::format("  {}: {:.1f} s, angles up to {:.2f} and {:.2f} rad, torques {} and "
                    "{} N·m{}",
                    file, run.motion, angle[0], angle[1], FormatPlain(torque[0], 3),
                    FormatPlain(torque[1], 3), run.reason.empty() ? "" : "; " + run.reason));
  }

  /// Identifies the twin from all logs, and judges it. The log of a try counts twice.
  void Fit(double window) {
    ExpectBudget();
    say_(fmt::format("identify: {}", Counted(std::ssize(logs_), "log")));
    Compute([&] {
      const Twin guess = FirstTwin(logs_, twin_);
      if (logs_.size() == 1 || ErrorOf(guess) < ErrorOf(twin_)) twin_ = guess;
      const FitResult fit = FitLogs(window * scale().time);
      Adopt(fit.twin);
      const Judgement judgement =
          Judge(logs_, PredictorOf("", twin_, logs_).twins, "the logs of the fit", pool_);
      explains_ = judgement.explains();
      twin_.distrust = DistrustOf(judgement, twin_, logs_, twin_.plant.length1);
      WriteFileAtomically(out_ / "twin.toml", TwinText(twin_));
      SayTwin(fit.error);
      say_("  " + SentenceOf(judgement));
      if (!IsTrusted()) say_("  no twin: " + twin_.distrust);
    });
  }

  /// Fits all values to windows of this length (s). If that leads nowhere or to a value outside
  /// physics, tries other first guesses. Throws Failure if no twin follows the motion.
  FitResult FitLogs(double window) const {
    constexpr double kGoodError = 0.01;  // rad
    FitResult fit = FitFrom(twin_, window);
    const bool is_odd = !OutsidePhysics(fit.twin, /*reports=*/true).empty();
    std::vector<Twin> guesses;
    if (is_odd) guesses.push_back(AsRods(fit.twin));
    if (fit.error > kGoodError) guesses.push_back(c_.Known());
    for (Twin& guess : guesses) {
      guess.sensors = twin_.sensors;
      FitResult other = FitFrom(guess, window);
      if (other.error < fit.error) fit = std::move(other);
    }
    if (fit.error < kLargestError) return fit;
    throw Failure(fmt::format(
        "no twin follows the motion (error {:.2f} rad): are the signs of angles and torques right?",
        fit.error));
  }

  FitResult FitFrom(const Twin& guess, double window) const {
    const FitConfig config{.windows = {window, window}, .iterations = 30, .tolerance = 1e-4};
    std::vector<std::string> values =
        Structures(/*has_motors=*/true, twin_.cogging.any(), /*one_body=*/false).back().values;
    values.emplace_back("length1");
    std::vector<MachineLog> logs = logs_;
    if (result_.tries > 0) logs.push_back(logs_.back());
    return machine::Fit(logs, guess, {"", values}, config, pool_);
  }

  /// Takes an identified twin as the machine's, with the zeros and friction of today.
  void Adopt(const Twin& identified) {
    const double quantum = twin_.sensors.quantum;
    twin_ = InSession(identified, logs_.back());
    MeasureLoop(logs_, twin_);
    twin_.sensors.quantum = quantum;  // the user knows it
    twin_.name = "learned";
    KeepValidCovariance();
  }

  void SayTwin(double error) const {
    const Manipulator m = ManipulatorOf(twin_.plant);
    say_(
        fmt::format("  error {:.4f} rad; gravity {} and {} N·m, dry friction {} and {} N·m, "
                    "delay {:.1f} ms, lag {:.1f} ms",
                    error, FormatPlain(m.G1, 3), FormatPlain(m.G2, 3), FormatPlain(m.f1, 3),
                    FormatPlain(m.f2, 3), 1e3 * twin_.actuator.delay, 1e3 * twin_.actuator.lag));
  }

  double ErrorOf(const Twin& twin) const {
    std::vector<std::vector<double>> errors;
    const double window = 0.3 * ScaleOverUsual(twin.plant).time;  // s
    for (const MachineLog& log : logs_) errors.push_back(WindowErrors(log, twin, window, false));
    return PooledMedian(errors);
  }

  /// Few windows give a covariance that rounding makes invalid. Then the values count as
  /// independent.
  void KeepValidCovariance() {
    try {
      Rng rng(c_.seed, "machine: draws");
      DrawTwin(twin_, rng);
    } catch (const Error&) {
      const size_t n = twin_.uncertain.size();
      for (size_t i = 0; i < n * n; ++i) twin_.covariance[i] *= i % (n + 1) == 0 ? 1 : 0;
    }
  }

  /// Designs a controller and tries it. Returns whether the machine balanced.
  bool Try() {
    ExpectTimeOfTry();
    const Choice choice = Choose();
    ExpectBudget();
    ++result_.tries;
    result_.controller = choice.arguments;
    result_.compensation = choice.compensation;
    say_(fmt::format("try {}: {}, compensation {:.2g}", result_.tries, choice.policy->name,
                     choice.compensation));
    const RunOutcome run = Run(TryRules(c_, twin_, choice.compensation),
                               Estimator(twin_, 1 / c_.hz), ControllerOf(choice.policy));
    result_.balanced = run.summary.upright;
    say_(fmt::format("  balanced {:.1f} s; used {:.1f} s of motion, {:.1f} s of computing",
                     result_.balanced, result_.motion, result_.computing));
    if (result_.balanced >= c_.hold) return true;
    failures_.push_back({.candidate = choice.candidate,
                         .controller = choice.policy->name,
                         .held = choice.held,
                         .balanced = run.balanced,
                         .reason = run.reason,
                         .twin = twin_});
    return false;
  }

  /// Whether a candidate has failed on the machine, and the twin is as it was.
  bool HasFailed(int candidate) const {
    return std::ranges::any_of(failures_, [&](const FailedTry& failure) {
      return failure.candidate == candidate && !HasChanged(failure.twin, twin_);
    });
  }

  /// Machines like the twin. Each failed try shows that the machine differs from it more than its
  /// covariance says.
  Draws SimulatedMachines() const {
    const double spread = std::exp2(static_cast<double>(failures_.size()));
    return {.twin = twin_, .spread = std::min(spread, kMostSpread), .rest = LastState()};
  }

  /// The state of the links at the end of the last log, if they rest.
  PendulumState LastState() const {
    const MachineLog& log = logs_.back();
    constexpr double kRests = 0.3;  // rad/s by the scale
    const Joints& w = log.velocity.back();
    if (LargerMagnitude(w[0], w[1]) > kRests * scale().velocity()) return {};
    const Joints& q = log.angle.back();
    return {q[0] - twin_.sensors.zero1, q[1] - twin_.sensors.zero2, 0, 0};
  }

  /// The first candidate that balances all simulated machines, or most of them.
  Choice Choose() {
    ExpectBudget();
    Choice best;
    best.held = -1;
    Compute([&] {
      const std::vector<Candidate> candidates = CandidatesFor(twin_.plant);
      const Draws draws = SimulatedMachines();
      for (int i = 0; i < static_cast<int>(candidates.size()) && best.held < kDraws; ++i) {
        if (!HasFailed(i)) Consider(candidates[i], i, draws, best);
      }
    });
    if (best.policy == nullptr) {
      throw Ended{failures_.empty() ? "no controller exists for the twin"
                                    : "every controller has failed on the machine"};
    }
    return best;
  }

  /// Replaces the best choice by a candidate that balances more simulated machines.
  void Consider(const Candidate& candidate, int index, const Draws& draws, Choice& best) {
    try {
      const PolicyArguments arguments = ArgumentsOf(candidate, twin_.plant);
      const MachinePolicy policy = GetMachinePolicy(arguments, "", twin_, std::llround(c_.hz));
      const int held = HeldBy(c_, draws, policy, candidate.compensation, stop_);
      if (stop_()) throw Ended{"stopped"};
      say_(fmt::format("design: {}: {} of {} machines of the twin", candidate.controller, held,
                       kDraws));
      if (held > best.held) best = {policy, arguments, index, candidate.compensation, held};
    } catch (const Error& error) {
      say_(fmt::format("design: {}", error.what()));
    }
  }

  /// Adds to the reason why the machine does not balance, as far as the logs tell.
  void AddCauses() {
    if (logs_.empty()) return;
    const std::vector<std::string> causes = CausesOf({.config = c_,
                                                      .twin = twin_,
                                                      .logs = logs_,
                                                      .tries = failures_,
                                                      .is_identified = is_identified_,
                                                      .is_faulty = is_faulty_});
    if (!causes.empty()) result_.reason += ": " + Join(causes, "; ");
  }

  const LearnConfig& c_;
  MachineLink& link_;
  std::filesystem::path out_;
  ThreadPool* pool_;
  std::function<void(const std::string&)> say_;
  std::function<bool()> stop_;
  Twin twin_;
  bool is_identified_ = false;  // whether the excitations are over
  bool explains_ = false;       // whether the twin explains the logs
  std::vector<MachineLog> logs_;
  std::vector<FailedTry> failures_;
  bool is_faulty_ = false;  // whether the supervisor found a fault
  LearnResult result_;
};

}  // namespace

LearnResult Learn(const LearnConfig& config, MachineLink& link, const std::filesystem::path& out,
                  ThreadPool* pool, const std::function<void(const std::string&)>& say,
                  const std::function<bool()>& stop) {
  config.Check();
  return LearningSession(config, link, out, pool, say, stop).Work();
}

}  // namespace upswing::machine

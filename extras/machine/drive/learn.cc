#include "extras/machine/drive/learn.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <numbers>
#include <utility>
#include <vector>

#include "agents/controllers.h"
#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "extras/machine/drive/excitation.h"
#include "extras/machine/drive/learning_run.h"
#include "extras/machine/drive/policy_controller.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/twin/first_twin.h"
#include "extras/machine/twin/identify.h"
#include "os/file.h"
#include "pendulum/runge_kutta.h"

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

constexpr double kLargestError = 0.1;    // of a fit, rad
constexpr double kLargestZero = 0.2;     // of the encoders, rad
constexpr double kLongestSwinging = 60;  // until the links rest, s
constexpr int kDraws = 5;                // machines of the posterior that judge a controller

/// A controller to choose.
struct Candidate {
  std::string controller;   // its name (agents/controllers.h)
  ControllerConfig config;  // with the design plant
  double compensation = 0;  // share of dry friction that motors compensate under it
};

/// The controller that is to be tried.
struct Choice {
  MachinePolicy policy;  // null: none
  PolicyArguments arguments;
  double compensation = 0;  // share of dry friction that motors compensate under it
};

/// The candidates for a plant, the best first. mpc needs milliseconds for a decision. The last two
/// plan with dry friction instead of compensating it: under noise, compensation shakes a light
/// link.
std::vector<Candidate> CandidatesFor(const Plant& plant) {
  constexpr double kUsualCompensation = 0.95;
  // The numbers are for the size of RealAIGym's boards.
  const Scale scale = TaskScaleOf(plant);
  const ControllerConfig usual = ControllerConfig::For(WithoutDryFriction(plant));

  ControllerConfig stiff = usual;
  stiff.lqr.q1 = stiff.lqr.q2 = 100;
  stiff.lqr.torque = 0.3 / (scale.torque * scale.torque);

  ControllerConfig slow = usual;
  slow.tvlqr = {.seconds = 6 * scale.time, .reserve = 0.1};

  ControllerConfig quick = stiff;
  quick.mpc.seconds = 0.3 * scale.time;
  quick.mpc.angle_range = 9;

  ControllerConfig with_friction = usual;
  with_friction.mpc.seconds = scale.time;
  with_friction.plant.coulomb1 = plant.coulomb1;
  with_friction.plant.coulomb2 = plant.coulomb2;

  // In the regulator's linear model, damping stands for the friction of the joint without a motor.
  ControllerConfig with_damping = with_friction;
  constexpr double kDamping = 2;  // for dry friction, s/rad
  if (plant.actuated_joint == 1) {
    with_damping.plant.damping2 += kDamping * scale.time * plant.coulomb2;
  } else {
    with_damping.plant.damping1 += kDamping * scale.time * plant.coulomb1;
  }
  return {{"tvlqr", usual, kUsualCompensation},
          {"tvlqr", stiff, kUsualCompensation},
          {"tvlqr", slow, kUsualCompensation},
          {"mpc", quick, kUsualCompensation},
          {"mpc", with_friction, 0},
          {"mpc", with_damping, 0}};
}

/// The arguments that turn the defaults into the candidate, as a user gives them. GetMachinePolicy
/// designs on the twin's plant without dry friction, so changes of the plant are relative to that.
PolicyArguments ArgumentsOf(const Candidate& candidate, const Plant& plant) {
  const Plant usual_plant = WithoutDryFriction(plant);
  const ControllerConfig usual = ControllerConfig::For(usual_plant);
  PolicyArguments arguments;
  arguments.name = candidate.controller;
  for (const auto& [setting, before] : Differences(OptionsOf(candidate.config), OptionsOf(usual))) {
    arguments.flags.push_back({setting.name, setting.plain_text()});
  }
  for (const auto& [setting, before] :
       Differences(OptionsOf(candidate.config.plant), OptionsOf(usual_plant))) {
    arguments.made_for.push_back(Concat(setting.name, "=", setting.plain_text()));
  }
  return arguments;
}

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
      const Twin known = twin_;
      Excite(kSmallMotion, /*has_twin=*/false);
      ExpectMotion();
      Fit(kSmallMotion.window);
      // A link that hardly moved shows no twin that is good enough to estimate the state.
      const bool has_twin =
          LargerMagnitude(twin_.sensors.zero1, twin_.sensors.zero2) < kLargestZero;
      if (!has_twin) twin_ = known;
      Excite(kLargeMotion, has_twin);
      while (true) {
        Fit(kLargeMotion.window);
        if (result_.tries == 0) WarnOfFalls();
        if (Try()) return result_;
      }
    } catch (const Ended& ended) {
      result_.reason = ended.reason;
    }
    return result_;
  }

 private:
  /// The session ends without balance.
  struct Ended {
    std::string reason;
  };

  void ExpectBudget() const {
    if (stop_()) throw Ended{"stopped"};
    if (result_.motion >= c_.motion) throw Ended{"the time of motion is used up"};
    if (result_.computing >= c_.computing) throw Ended{"the time of computing is used up"};
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
                             c_.seed, scale());
    const double cycles = std::max(1.0, std::round(kControlPeriod * scale().time * c_.hz));
    Run({.limits = c_.limits, .seconds = seconds}, estimator,
        MachineController(torques, cycles / c_.hz));
  }

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
    rules.seconds = std::min(rules.seconds, c_.motion - result_.motion);
    rules.log = (out_ / fmt::format("log-{:02}.csv", logs_.size() + 1)).string();
    rules.scale = scale();
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
    if (run.faulty) throw Ended{run.reason};
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
        fmt::format("  {}: {:.1f} s, angles up to {:.2f} and {:.2f} rad, torques {:.2f} and "
                    "{:.2f} N·m{}",
                    file, run.motion, angle[0], angle[1], torque[0], torque[1],
                    run.reason.empty() ? "" : "; " + run.reason));
  }

  /// Identifies the twin from all logs. The log of a try counts twice.
  void Fit(double window) {
    ExpectBudget();
    say_(fmt::format("identify: {}", Counted(std::ssize(logs_), "log")));
    Compute([&] {
      const Twin guess = FirstTwin(logs_, twin_);
      if (logs_.size() == 1 || ErrorOf(guess) < ErrorOf(twin_)) twin_ = guess;
      const FitResult fit = FitLogs(window);
      Adopt(fit.twin);
      const Judgement judgement =
          Judge(logs_, PredictorOf("", twin_, logs_).twins, "the logs of the fit", pool_);
      twin_.distrust = DistrustOf(judgement, twin_, logs_);
      WriteFileAtomically(out_ / "twin.toml", TwinText(twin_));
      SayTwin(fit.error);
      say_("  " + SentenceOf(judgement));
    });
  }

  /// Fits all values to windows of this length (s by the scale). Throws Failure if no twin follows
  /// the motion.
  FitResult FitLogs(double window) const {
    window *= scale().time;
    const FitConfig config{.windows = {window, window}, .iterations = 30, .tolerance = 1e-4};
    std::vector<std::string> values =
        Structures(/*has_motors=*/true, twin_.cogging.any(), /*one_body=*/false).back().values;
    values.emplace_back("length1");
    std::vector<MachineLog> logs = logs_;
    if (result_.tries > 0) logs.push_back(logs_.back());
    FitResult fit = machine::Fit(logs, twin_, {"", values}, config, pool_);
    if (!(fit.error < kLargestError)) {
      throw Failure(
          fmt::format("no twin follows the motion (error {:.2f} rad): are the signs of "
                      "angles and torques right?",
                      fit.error));
    }
    return fit;
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
    say_(fmt::format(
        "  error {:.4f} rad; gravity {:.2f} and {:.2f} N·m, dry friction {:.3f} and {:.3f} "
        "N·m, delay {:.1f} ms, lag {:.1f} ms",
        error, m.G1, m.G2, m.f1, m.f2, 1e3 * twin_.actuator.delay, 1e3 * twin_.actuator.lag));
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

  /// Says which limits a fall from upright exceeds. A motor cannot hold links that fall.
  void WarnOfFalls() {
    constexpr double kLean = 0.1;             // rad
    const double seconds = 3 * scale().time;  // of each fall
    const Body body = BodyOf(twin_);
    const auto falling = [&](const PendulumState& s, double /*share*/) {
      return body.Acceleration(s, {});
    };
    double angle = 0, velocity = 0;
    for (const double lean : {-kLean, kLean}) {
      PendulumState s{std::numbers::pi + lean, 0, 0, 0};
      for (int i = 0; i < seconds / body.longest_step; ++i) {
        s = RungeKuttaStep(s, falling(s, 0), body.longest_step, falling);
        angle = std::max(angle, LargerMagnitude(s.q1, s.q2));
        velocity = std::max(velocity, LargerMagnitude(s.w1, s.w2));
      }
    }
    const auto warn = [&](const char* flag, double limit, double reached, const char* unit) {
      if (reached <= limit) return;
      say_(fmt::format("  warning: a fall from upright reaches {:.1f} {}, beyond {} {:g}", reached,
                       unit, flag, limit));
    };
    warn("--max-angle", c_.limits.angle, angle, "rad");
    warn("--max-velocity", c_.limits.velocity, velocity, "rad/s");
  }

  /// Designs a controller and tries it. Returns whether the machine balanced.
  bool Try() {
    const Choice choice = Choose();
    ExpectBudget();
    ++result_.tries;
    result_.controller = choice.arguments;
    result_.compensation = choice.compensation;
    say_(fmt::format("try {}: {}", result_.tries, choice.policy->name));
    const RunOutcome run = Run(TryRules(choice.compensation), Estimator(twin_, 1 / c_.hz),
                               ControllerOf(choice.policy));
    result_.balanced = run.summary.upright;
    say_(fmt::format("  balanced {:.1f} s; used {:.1f} s of motion, {:.1f} s of computing",
                     result_.balanced, result_.motion, result_.computing));
    return result_.balanced >= c_.hold;
  }

  RunRules TryRules(double compensation) const {
    return {.limits = c_.limits,
            .seconds = 2 * kLongestFall * scale().time + c_.hold,
            .is_try = true,
            .compensation = compensation,
            .scale = scale()};
  }

  /// The first controller that balances all machines drawn from the posterior, or most of them.
  Choice Choose() {
    ExpectBudget();
    Choice best;
    Compute([&] {
      int most = -1;
      for (const Candidate& candidate : CandidatesFor(twin_.plant)) {
        try {
          const PolicyArguments arguments = ArgumentsOf(candidate, twin_.plant);
          const MachinePolicy policy = GetMachinePolicy(arguments, "", twin_, std::llround(c_.hz));
          const int held = HeldBy(policy, candidate.compensation);
          say_(fmt::format("design: {}: {} of {} machines of the twin", candidate.controller, held,
                           kDraws));
          if (held <= most) continue;
          most = held;
          best = {policy, arguments, candidate.compensation};
        } catch (const Error& error) {
          say_(fmt::format("design: {}", error.what()));
        }
        if (most == kDraws) break;
      }
    });
    if (best.policy == nullptr) throw Ended{"no controller exists for the twin"};
    return best;
  }

  /// Number of machines, of kDraws of the posterior, that a controller balances.
  int HeldBy(const MachinePolicy& policy, double compensation) const {
    int held = 0;
    for (int i = 0; i < kDraws; ++i) {
      Rng rng(c_.seed, "machine: draws", static_cast<uint64_t>(i));
      TwinLink link(DrawTwin(twin_, rng), {}, c_.seed);
      const RunOutcome run =
          RunCycles(c_, TryRules(compensation), twin_.sensors, Estimator(twin_, 1 / c_.hz),
                    ControllerOf(policy), link, stop_);
      if (stop_()) throw Ended{"stopped"};
      if (run.summary.upright >= c_.hold) ++held;
    }
    return held;
  }

  const LearnConfig& c_;
  MachineLink& link_;
  std::filesystem::path out_;
  ThreadPool* pool_;
  std::function<void(const std::string&)> say_;
  std::function<bool()> stop_;
  Twin twin_;
  std::vector<MachineLog> logs_;
  LearnResult result_;
};

}  // namespace

void LearnConfig::Describe(Options& o) {
  o.Section("learning");
  o.Add(&encoder_counts, "encoder_counts", {16, 1e9}, "1/turn", "steps of the encoders; required")
      .usual = "none";
  o.Add(&hold, "hold", {1, 3600}, "s", "time of balance that ends the learning");
  o.Add(&motion, "motion", {10, 3600}, "s", "longest time with torques, all runs together");
  o.Add(&computing, "computing", {1, 1e6}, "s", "longest processor time of models and controllers");
  o.Add(&hz, "hz", {100, 1000}, "1/s", "cycles per second").step = 50;
  o.Add(&length, "length", {0.02, 200}, "m",
        "length of both links together; with --max-torque it tells the size of the machine")
      .usual = "about that of RealAIGym's robot, 0.5";
}

Twin LearnConfig::Known() const {
  Twin twin;
  Plant& plant = twin.plant;
  if (length > 0 && limits.torque > 0) {
    plant = UsualPlant();
    const double longer = length / (plant.length1 + plant.length2);
    const double heavier = limits.torque / plant.torque_limit / longer;
    for (double Plant::*m : {&Plant::mass1, &Plant::mass2}) plant.*m *= heavier;
    for (double Plant::*l : {&Plant::length1, &Plant::length2, &Plant::center1, &Plant::center2}) {
      plant.*l *= longer;
    }
    for (double Plant::*I : {&Plant::inertia1, &Plant::inertia2, &Plant::armature}) {
      plant.*I *= heavier * longer * longer;
    }
  }
  plant.torque_limit = limits.torque;
  plant.actuated_joint = actuated_joint;
  twin.actuator.passive_limit = limits.passive_torque;
  twin.sensors.quantum = 2 * std::numbers::pi / encoder_counts;
  twin.sensors.velocity_share = 0.2;
  twin.sensors.velocity_dead_zone = 0.1 * ScaleOverUsual(plant).velocity();
  twin.loop.period = 1 / hz;
  return twin;
}

Limits LearnConfig::DefaultLimits(double torque) const {
  LearnConfig known = *this;
  known.limits.torque = torque;
  Twin twin = known.Known();
  twin.actuator.passive_limit = Limits().passive_torque * ScaleOverUsual(twin.plant).torque;
  Limits defaults = Limits::For(twin);
  defaults.angle = LearnConfig().limits.angle;
  return defaults;
}

void LearnConfig::Check() const {
  if (encoder_counts == 0) throw BadInput("machine learn: expected --encoder-counts, got none");
  const auto expect = [](const char* flag, double least, double got) {
    if (got >= least) return;
    throw BadInput(Concat(flag, ": expected ", least, " or more for a swing-up, got ", got));
  };
  expect("--max-angle", 3.5, limits.angle);
  expect("--max-energy", 1.1, limits.energy);
}

LearnResult Learn(const LearnConfig& config, MachineLink& link, const std::filesystem::path& out,
                  ThreadPool* pool, const std::function<void(const std::string&)>& say,
                  const std::function<bool()>& stop) {
  config.Check();
  return LearningSession(config, link, out, pool, say, stop).Work();
}

}  // namespace upswing::machine

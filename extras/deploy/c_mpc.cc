// The controller mpc for extras/deploy/c/mpc.c.
#include <algorithm>
#include <array>
#include <cmath>

#include "agents/controllers.h"
#include "base/rng.h"
#include "base/text.h"
#include "control/mpc.h"
#include "control/trajectory.h"
#include "extras/deploy/c_header.h"
#include "extras/deploy/c_text.h"
#include "pendulum/equations.h"

namespace upswing::deploy {
namespace {

constexpr int kPlanSamples = 4;            // each costs as much as about two calls
constexpr int kPlanDraws = 1000;           // of a sample
constexpr double kPlanTorqueShare = 5e-3;  // tolerance of a torque, as a share of the limit
constexpr double kPlanCostShare = 1e-2;    // tolerance of a cost, as a share of it
constexpr double kSmooth = 0.25;           // share of the tolerances that a change near by may use
constexpr double kRoughest = 100;          // change of a state without a result
constexpr double kPlanNearby = 1e-4;       // rad, natural velocity: what rounding adds up to
constexpr int kPlanNeighbours = 24;        // states near by that are tried
constexpr double kPlanRange = 1.5;         // of samples about hanging, rad, natural velocity
constexpr double kCalmest = 0.1;           // least share of this range
constexpr double kDrawsUntilCalm = 20;     // until this share

int HorizonOf(const ControllerConfig& config) {
  return static_cast<int>(std::lround(config.mpc.seconds / config.plant.control_period));
}

const MpcPolicy& PolicyOf(const LoadedPolicy& loaded) {
  return dynamic_cast<const MpcPolicy&>(*loaded.policy);
}

/// The results of a sample in extras/deploy/c/mpc.c: an iteration from no torque, a call in the
/// next state of that plan, and the cost of the regulator from near upright.
struct SampleResult {
  StateVector next;                    // deviation from upright
  std::array<double, 2> torques = {};  // N·m, of the plan and of the call
  double cost = 0;                     // of the plan
  bool improved = false;               // whether the iteration found a better plan
};

/// Computes samples of one controller.
class Sampler {
 public:
  Sampler(const LoadedPolicy& loaded, const ControllerConfig& config)
      : loaded_(loaded),
        lqr_(SolveLqr(config.lqr, config.plant)),
        cost_(WeightsOf(config.lqr), config.lqr.torque, lqr_.P, config.mpc.angle_range),
        optimizer_(config.plant, PolicyOf(loaded).planning_steps()),
        steps_(static_cast<size_t>(HorizonOf(config))) {}

  const Lqr& lqr() const { return lqr_; }
  const QuadraticCost& cost() const { return cost_; }

  SampleResult ResultAt(const StateVector& x) {
    SampleResult result;
    const StateVector deviation = UprightDeviation(x);
    Trajectory plan =
        optimizer_.Follow(cost_, FromUpright(deviation), std::vector<double>(steps_, 0.0));
    const double before = plan.cost;
    optimizer_.Improve(cost_, 0, 1, plan);
    result.improved = plan.cost < before;
    result.cost = plan.cost;
    result.torques[0] = plan.u[0];
    result.next = UprightDeviation(plan.x[1]);
    const auto seen = Observe(loaded_.plant, StateOf(plan.x[1]), loaded_.scale());
    const std::vector<float> obs(seen.begin(), seen.end());
    const auto memory = PolicyOf(loaded_).StartFrom(plan, optimizer_.gains());
    loaded_.policy->Act({obs.data(), 1, static_cast<int>(obs.size())}, {&result.torques[1], 1, 1},
                        *memory);
    return result;
  }

  /// The cost of the regulator from a deviation.
  double HeldCost(const StateVector& deviation) {
    const Trajectory upright{std::vector<StateVector>(steps_ + 1, FromUpright({0, 0, 0, 0})),
                             std::vector<double>(steps_, 0.0), 0};
    const std::vector<Eigen::RowVector4d> K(steps_, -lqr_.K);
    const TrajectoryOptimizer::FeedbackPlan hold{upright, K};
    return optimizer_.Follow(cost_, FromUpright(deviation), {&hold, 1}).front().cost;
  }

  /// The largest change of the results, in tolerances, by what rounding adds up to. It is large
  /// where a step size of the optimiser's search wins narrowly. Stops beyond `most`.
  double Roughness(const StateVector& x, Rng& rng, double most) {
    const SampleResult here = ResultAt(x);
    double largest = here.improved ? 0 : kRoughest;
    for (int i = 0; i < kPlanNeighbours && largest <= most; ++i) {
      const SampleResult there = ResultAt(x + Offset(kPlanNearby, rng));
      for (size_t k = 0; k < here.torques.size(); ++k) {
        const double change = std::abs(there.torques[k] - here.torques[k]);
        largest = std::max(largest, change / (kPlanTorqueShare * loaded_.plant.torque_limit));
      }
      const double change = std::abs(there.cost - here.cost);
      largest = std::max(largest, change / (kPlanCostShare * here.cost));
    }
    return largest;
  }

  /// Draws a state of floats around hanging. Later draws are calmer, as a plan is smooth there.
  StateVector DrawState(Rng& rng, int draw) const {
    const double share = std::max(kCalmest, 1 - draw / kDrawsUntilCalm);
    return Offset(share * kPlanRange, rng).cast<float>().cast<double>();
  }

 private:
  /// A random difference of states: up to `range` in rad, and in natural velocity.
  StateVector Offset(double range, Rng& rng) const {
    const double velocity = range * TaskScaleOf(loaded_.plant).velocity();
    StateVector x;
    for (int k = 0; k < 4; ++k) x[k] = rng.Uniform(-1, 1) * (k < 2 ? range : velocity);
    return x;
  }

  const LoadedPolicy& loaded_;
  Lqr lqr_;
  QuadraticCost cost_;
  TrajectoryOptimizer optimizer_;
  size_t steps_;
};

/// The smoothest of some states, or the first that is smooth enough. `roughness` grows to its own.
StateVector DrawSmoothState(Sampler& sampler, Rng& rng, double& roughness) {
  StateVector best;
  double least = 2 * kRoughest;
  for (int draw = 0; draw < kPlanDraws && least > kSmooth; ++draw) {
    const StateVector x = sampler.DrawState(rng, draw);
    const double here = sampler.Roughness(x, rng, least);
    if (draw > 0 && here >= least) continue;
    best = x;
    least = here;
  }
  roughness = std::max(roughness, least);
  return best;
}

/// The share, a power of 2, of the samples' deviations from which the regulator starts with little
/// of the motor's torque, so that it stays within it.
double HeldShare(const std::vector<StateVector>& samples, const Lqr& lqr, double limit) {
  double share = 1;
  for (const StateVector& x : samples) {
    while (share * std::abs(lqr.Torque(UprightDeviation(x))) > limit / 32) share /= 2;
  }
  return share;
}

void AddPlanSamples(const LoadedPolicy& loaded, Sampler& sampler, CParts& parts) {
  Rng rng(0, "samples of the C header of mpc");
  std::vector<StateVector> samples;
  double roughness = kSmooth;
  for (int i = 0; i < kPlanSamples; ++i) {
    samples.push_back(DrawSmoothState(sampler, rng, roughness));
  }
  const double wider = std::min(roughness, kRoughest) / kSmooth;
  const double share = HeldShare(samples, sampler.lqr(), loaded.plant.torque_limit);
  std::vector<double> states, next, costs, torques;
  for (const StateVector& x : samples) {
    const SampleResult result = sampler.ResultAt(x);
    states.insert(states.end(), x.begin(), x.end());
    next.insert(next.end(), result.next.begin(), result.next.end());
    costs.insert(costs.end(), {result.cost, sampler.HeldCost(share * UprightDeviation(x))});
    torques.insert(torques.end(), result.torques.begin(), result.torques.end());
  }
  parts.samples = {{"sample_states", "q1, q2, w1, w2", Floats(states)},
                   {"sample_next", "deviations a control period later", Floats(next)},
                   {"sample_costs", "of a plan, of the regulator", Floats(costs)},
                   {"sample_torques", "N m: of the plan, of a call", Floats(torques)}};
  const auto add = [&](const char* name, double value, const char* comment) {
    parts.macros.emplace_back(name, CLiteral(static_cast<float>(value)) + comment);
  };
  parts.macros.emplace_back("SAMPLES", Concat(kPlanSamples));
  add("TORQUE_TOLERANCE", wider * kPlanTorqueShare * loaded.plant.torque_limit, " /* N m */");
  add("COST_TOLERANCE", std::min(wider * kPlanCostShare, 0.5), " /* as a share */");
  add("HELD_SHARE", share, " /* of a sample, from which the regulator holds */");
}

/// Adds the settings that mpc has for real machines, if they are on.
void AddMachineSettings(const MpcConfig& mpc, const QuadraticCost& cost, CParts& parts) {
  const auto add = [&](const char* name, double value, const char* comment) {
    parts.macros.emplace_back(name, CLiteral(static_cast<float>(value)) + comment);
  };
  const MpcConfig off;
  if (mpc.angle_range < off.angle_range) {
    const auto [upright1, upright2] = cost.largest_uprights();
    add("LARGEST_UPRIGHT1", upright1, " /* rad, angle of a goal with full turns */");
    add("LARGEST_UPRIGHT2", upright2, " /* rad */");
  }
  if (mpc.velocity < off.velocity) {
    add("BRAKE_VELOCITY", mpc.velocity,
        " /* rad/s, of the motor's joint, above which it brakes */");
  }
}

}  // namespace

void AddPredictive(const LoadedPolicy& loaded, const ControllerConfig& config, CParts& parts) {
  Sampler sampler(loaded, config);
  const LqrConfig& lqr = config.lqr;
  const Scale scale = TaskScaleOf(config.plant);
  const int horizon = HorizonOf(config), guesses = static_cast<int>(config.mpc.guesses);
  parts.constants.push_back({"gain", "N m/rad, N m s/rad", Floats(sampler.lqr().K)});
  const int planning_steps = PolicyOf(loaded).planning_steps();
  AddEquations(config.plant, planning_steps, parts);
  parts.constants.push_back({"weights", "of q1, q2, w1, w2 and the torque, squared",
                             Floats(std::array{lqr.q1, lqr.q2, lqr.w1, lqr.w2, lqr.torque})});
  const Eigen::Matrix4d& P = sampler.lqr().P;
  parts.constants.push_back({"end_cost", "4 x 4, of the last deviation",
                             Floats(std::span(P.data(), static_cast<size_t>(P.size())))});
  parts.constants.push_back(
      {"units", "natural time squared, 1 / natural torque squared",
       Floats(std::array{scale.time * scale.time, 1 / (scale.torque * scale.torque)})});
  parts.macros.emplace_back("HORIZON", Concat(horizon, " /* control periods */"));
  parts.macros.emplace_back("ITERATIONS", Concat(config.mpc.iterations, " /* of a call */"));
  parts.macros.emplace_back(
      "FIRST_ITERATIONS", Concat(MpcPolicy::kFirstIterations, " /* at most, of the first call */"));
  parts.macros.emplace_back("GUESSES", Concat(guesses, " /* of the first plan */"));
  AddMachineSettings(config.mpc, sampler.cost(), parts);
  AddPlanSamples(loaded, sampler, parts);

  constexpr size_t kFloat = 4;  // bytes
  const auto T = static_cast<size_t>(horizon);
  parts.state_bytes = kFloat * (3 + 4 * (T + 1) + (guesses > 1 ? 7 : 6) * T);
  parts.stack_bytes = kFloat * 230;
  parts.code = "4 to 8 KB";
  const int rounds = guesses > 1 ? guesses + 1 : 1;  // the best guess goes on once more
  parts.note = Concat(
      "The first call after policy_init makes a plan, and takes as long as up to ",
      std::max(1, MpcPolicy::kFirstIterations * rounds / static_cast<int>(config.mpc.iterations)),
      " calls: make it before the motion, and set its torque a period before the next call. The "
      "self-test takes as long as about 8 calls, and has a state on its stack.");
  const auto derivatives = static_cast<size_t>(4 * planning_steps) * T;
  parts.work = Concat(config.mpc.iterations, " iterations, each of ", derivatives,
                      " derivatives with their own derivatives and up to ", 17 * derivatives,
                      " without; the first call takes up to ", MpcPolicy::kFirstIterations * rounds,
                      " iterations.");
}

}  // namespace upswing::deploy

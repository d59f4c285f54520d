// The controller mpc for extras/deploy/c/mpc.c.
#include <array>
#include <cmath>

#include "agents/controllers.h"
#include "base/error.h"
#include "base/rng.h"
#include "base/text.h"
#include "control/mpc.h"
#include "control/trajectory.h"
#include "extras/deploy/c_header.h"
#include "extras/deploy/c_text.h"
#include "pendulum/equations.h"

namespace upswing::deploy {
namespace {

constexpr int kPlanSamples = 4;   // each costs as much as about three calls
constexpr int kPlanDraws = 1000;  // of a sample
constexpr double kPlanTorqueShare =
    2e-3;                                // tolerance of a sample's torque, as a share of the limit
constexpr double kPlanCostShare = 1e-3;  // tolerance of a sample's costs
constexpr double kPlanNearby = 1e-5;     // rad, rad/s: more than the rounding of float
constexpr double kPlanSmaller = 64;      // the states near upright are samples over this
constexpr int kFirstIterations = 100;    // of the first plan, as in control/mpc.cc
const StateVector kPlanRange(3.14, 3.14, 4, 4);  // ± range of samples, rad, rad/s

int HorizonOf(const ControllerConfig& config) {
  return static_cast<int>(std::lround(config.mpc.seconds / config.plant.control_period));
}

/// What extras/deploy/c/mpc.c computes from a sample: an iteration from no torque, a call in the
/// next state of that plan, and the cost of the regulator from near upright.
struct SampleResult {
  StateVector next;                    // deviation from upright
  double improved_cost, held_cost;     //
  std::array<double, 2> torques = {};  // N·m, of the plan and of the call
};

/// Computes samples of one controller.
class Sampler {
 public:
  Sampler(const LoadedPolicy& loaded, const ControllerConfig& config)
      : loaded_(loaded),
        lqr_(SolveLqr(config.lqr, config.plant)),
        cost_(WeightsOf(config.lqr), config.lqr.torque, lqr_.P, config.mpc.angle_range),
        optimizer_(config.plant),
        steps_(static_cast<size_t>(HorizonOf(config))) {}

  const Lqr& lqr() const { return lqr_; }
  const QuadraticCost& cost() const { return cost_; }

  SampleResult ResultAt(const StateVector& x) {
    SampleResult result;
    const StateVector deviation = UprightDeviation(x);
    Trajectory plan =
        optimizer_.Follow(cost_, FromUpright(deviation), std::vector<double>(steps_, 0.0));
    optimizer_.Improve(cost_, 0, 1, plan);
    result.improved_cost = plan.cost;
    result.torques[0] = plan.u[0];
    result.next = UprightDeviation(plan.x[1]);
    const auto seen = Observe(loaded_.plant, StateOf(plan.x[1]), loaded_.scale());
    const std::vector<float> obs(seen.begin(), seen.end());
    const auto memory =
        dynamic_cast<const MpcPolicy&>(*loaded_.policy).StartFrom(plan, optimizer_.gains());
    loaded_.policy->Act({obs.data(), 1, static_cast<int>(obs.size())}, {&result.torques[1], 1, 1},
                        *memory);
    const Trajectory upright{std::vector<StateVector>(steps_ + 1, FromUpright({0, 0, 0, 0})),
                             std::vector<double>(steps_, 0.0), 0};
    const std::vector<Eigen::RowVector4d> K(steps_, -lqr_.K);
    const StateVector near = deviation / kPlanSmaller;
    result.held_cost = optimizer_.Follow(cost_, FromUpright(near), upright, K).cost;
    return result;
  }

  /// Whether rounding the state leaves the results as they are, within half of the tolerances.
  bool IsSmooth(const StateVector& x, const SampleResult& here) {
    for (int k = 0; k < 4; ++k) {
      for (const double step : {-kPlanNearby, kPlanNearby}) {
        const SampleResult there = ResultAt(x + step * StateVector::Unit(k));
        for (size_t i = 0; i < here.torques.size(); ++i) {
          const double change = std::abs(there.torques[i] - here.torques[i]);
          if (change > kPlanTorqueShare / 2 * loaded_.plant.torque_limit) return false;
        }
        const double change = std::abs(there.improved_cost - here.improved_cost);
        if (change > kPlanCostShare / 2 * here.improved_cost) return false;
      }
    }
    return true;
  }

 private:
  const LoadedPolicy& loaded_;
  Lqr lqr_;
  QuadraticCost cost_;
  TrajectoryOptimizer optimizer_;
  size_t steps_;
};

/// A random state of floats.
StateVector DrawPlanState(Rng& rng) {
  StateVector x;
  for (int k = 0; k < 4; ++k) x[k] = static_cast<float>(rng.Uniform(-1, 1) * kPlanRange[k]);
  return x;
}

void AddPlanSamples(const LoadedPolicy& loaded, Sampler& sampler, CParts& parts) {
  Rng rng(0, "samples of the C header of mpc");
  std::vector<double> states, next, costs, torques;
  for (int i = 0; i < kPlanSamples; ++i) {
    StateVector x = DrawPlanState(rng);
    SampleResult result = sampler.ResultAt(x);
    for (int draw = 1; !sampler.IsSmooth(x, result); ++draw) {
      if (draw == kPlanDraws) {
        throw BadInput(Concat(loaded.name, ": found no states for the header's self-test where ",
                              "the plan is smooth enough"));
      }
      x = DrawPlanState(rng);
      result = sampler.ResultAt(x);
    }
    states.insert(states.end(), x.begin(), x.end());
    next.insert(next.end(), result.next.begin(), result.next.end());
    costs.insert(costs.end(), {result.improved_cost, result.held_cost});
    torques.insert(torques.end(), result.torques.begin(), result.torques.end());
  }
  parts.samples = {{"sample_states", "q1, q2, w1, w2", Floats(states)},
                   {"sample_next", "deviations a control period later", Floats(next)},
                   {"sample_costs", "of a plan, of the regulator", Floats(costs)},
                   {"sample_torques", "N m: of the plan, of a call", Floats(torques)}};
  parts.macros.emplace_back("SAMPLES", Concat(kPlanSamples));
  parts.macros.emplace_back(
      "TORQUE_TOLERANCE",
      CLiteral(static_cast<float>(kPlanTorqueShare * loaded.plant.torque_limit)));
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
  AddEquations(config.plant, config.plant.physics_steps(), parts);
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
  parts.macros.emplace_back("FIRST_ITERATIONS",
                            Concat(kFirstIterations, " /* at most, of the first call */"));
  parts.macros.emplace_back("GUESSES", Concat(guesses, " /* of the first plan */"));
  AddMachineSettings(config.mpc, sampler.cost(), parts);
  AddPlanSamples(loaded, sampler, parts);

  constexpr size_t kFloat = 4;  // bytes
  const auto T = static_cast<size_t>(horizon);
  parts.state_bytes = kFloat * (3 + 4 * (T + 1) + (guesses > 1 ? 7 : 6) * T);
  parts.stack_bytes = kFloat * 230;
  parts.code = "4 to 8 KB";
  parts.note = Concat(
      "The first call after policy_init makes a plan, and takes as long as up to ",
      kFirstIterations * (guesses > 1 ? guesses + 1 : 1) / static_cast<int>(config.mpc.iterations),
      " calls: make it before the motion, and set its torque a period before the next call. The "
      "self-test takes as long as about 8 calls, and has a state on its stack.");
  const auto derivatives = static_cast<size_t>(4 * config.plant.physics_steps()) * T;
  parts.work = Concat(
      config.mpc.iterations, " iterations, each of ", derivatives,
      " derivatives with their own derivatives and up to ", 17 * derivatives,
      " without; the first call after policy_init takes up to ", kFirstIterations,
      guesses > 1 ? Concat(" iterations for each of ", guesses, " guesses.") : " iterations.");
}

}  // namespace upswing::deploy

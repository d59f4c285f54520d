#include <array>
#include <cmath>

#include "agents/controllers.h"
#include "base/error.h"
#include "base/rng.h"
#include "base/text.h"
#include "control/tvlqr.h"
#include "extras/deploy/c_header.h"
#include "extras/deploy/c_text.h"

namespace upswing::deploy {
namespace {

constexpr int kLawSamples = 16;
constexpr int kDrawsOfEach = 1000;     // per kind of state
constexpr double kTorqueShare = 5e-4;  // tolerance of a sample's torque, as a share of the limit
constexpr double kNearby = 1e-3;       // rad, rad/s: no jump of the torque this close to a sample
const StateVector kRange(3.14, 3.14, 4, 4);  // ± range of samples, rad, rad/s
constexpr double kUprightShare = 0.005;      // largest share of kRange about upright

// Ends the description of the work of a controller that simulates.
constexpr const char* kOnlyNearUpright = "; away from upright none of the simulation.";

/// The settings that the controller was made with.
ControllerConfig ConfigOf(const LoadedPolicy& loaded) {
  ControllerConfig config;
  config.plant = loaded.design_plant();
  ApplyToml(OptionsOf(config), loaded.policy->info().config, loaded.name);
  return config;
}

/// The upper triangle of P, row by row.
std::vector<double> Triangle(const Eigen::Matrix4d& P) {
  std::vector<double> numbers;
  for (int i = 0; i < 4; ++i) {
    for (int k = i; k < 4; ++k) numbers.push_back(P(i, k));
  }
  return numbers;
}

/// The first torque of an episode that begins in a state.
double TorqueAt(const LoadedPolicy& loaded, const StateVector& x) {
  const auto seen = Observe(loaded.plant, {x[0], x[1], x[2], x[3]}, loaded.scale());
  const std::vector<float> obs(seen.begin(), seen.end());
  double torque = 0;
  loaded.policy->Act({obs.data(), 1, static_cast<int>(obs.size())}, {&torque, 1, 1},
                     *loaded.policy->Start(1));
  return torque;
}

/// Whether the torque jumps by `least` or more around a state; rounding would decide there.
bool Jumps(const LoadedPolicy& loaded, const StateVector& x, double least) {
  const double here = TorqueAt(loaded, x);
  for (int k = 0; k < 4; ++k) {
    const StateVector step = kNearby * StateVector::Unit(k);
    // The second difference, which is 0 for any linear law, however steep.
    const double bend = TorqueAt(loaded, x - step) - 2 * here + TorqueAt(loaded, x + step);
    if (std::abs(bend) >= least) return true;
  }
  return false;
}

/// A random state of floats: anywhere, or so close to upright that the torque stays within its
/// limit.
StateVector DrawState(const LoadedPolicy& loaded, Rng& rng, bool upright) {
  StateVector x;
  for (int k = 0; k < 4; ++k) x[k] = rng.Uniform(-1, 1) * kRange[k];
  const auto rounded = [](const StateVector& exact) {
    return StateVector(exact.cast<float>().cast<double>());
  };
  if (!upright) return rounded(x);
  StateVector lean = kUprightShare * x;
  while (std::abs(TorqueAt(loaded, FromUpright(lean))) >= loaded.plant.torque_limit) lean /= 2;
  return rounded(FromUpright(lean));
}

/// Draws states, every other one near upright, and their torques. No state is near a jump.
void DrawSamples(const LoadedPolicy& loaded, double tolerance, std::vector<float>& states,
                 std::vector<float>& torques) {
  Rng rng(0, "samples of a controller's C header");
  for (int i = 0; i < kLawSamples; ++i) {
    const bool upright = i % 2 == 0;
    StateVector x = DrawState(loaded, rng, upright);
    for (int draw = 1; Jumps(loaded, x, tolerance / 2); ++draw) {
      if (draw == kDrawsOfEach) {
        throw BadInput(Concat(loaded.name,
                              ": found no states for the header's self-test where the ",
                              "torque is smooth enough"));
      }
      x = DrawState(loaded, rng, upright);
    }
    for (const double number : x) states.push_back(static_cast<float>(number));
    torques.push_back(static_cast<float>(TorqueAt(loaded, x)));
  }
}

/// The deviations from upright one control period after the samples.
std::vector<float> StepsFrom(const std::vector<float>& states, const std::vector<float>& torques,
                             const DesignPlant& plant) {
  PendulumModel model(plant);
  std::vector<float> steps;
  for (size_t i = 0; i < torques.size(); ++i) {
    const float* s = states.data() + 4 * i;
    const StateVector x(s[0], s[1], s[2], s[3]);
    StateVector next = x;
    const double torque = torques[i];
    model.Step({&next, 1}, {&torque, 1});
    for (const double number : StateVector(UprightDeviation(x) + next - x)) {
      steps.push_back(static_cast<float>(number));
    }
  }
  return steps;
}

/// Adds the tables with which extras/deploy/c/catch.c simulates.
void AddCatch(const LoadedPolicy& loaded, const LqrCatch& upright, CParts& parts) {
  AddEquations(loaded.plant, loaded.design_plant().physics_steps(), parts);
  parts.constants.push_back(
      {"upright_cost", "of a deviation from upright", Floats(Triangle(upright.lqr().P))});
  parts.constants.push_back({"region", "of attraction", Floats(std::array{upright.region()})});
  parts.macros.emplace_back("LOOK_AHEAD", Concat(upright.steps(), " /* control periods */"));
}

void AddGain(const Lqr& lqr, CParts& parts) {
  parts.constants.push_back({"gain", "N m/rad, N m s/rad", Floats(lqr.K)});
}

void AddRegulator(const LoadedPolicy& /*loaded*/, const ControllerConfig& config, CParts& parts) {
  parts.task.goal = "holds a double pendulum with one motor upright";
  parts.work = "a product of four numbers.";
  AddGain(SolveLqr(config.lqr, config.plant), parts);
}

/// Adds the regulator that catches, of a controller that swings up.
void AddCatchingRegulator(const LoadedPolicy& loaded, const ControllerConfig& config,
                          CParts& parts) {
  const LqrCatch upright(config.lqr, config.plant);
  AddGain(upright.lqr(), parts);
  AddCatch(loaded, upright, parts);
  parts.work = Concat("up to ", upright.steps(),
                      " control periods of simulation near upright, of 16 derivatives each");
}

/// Adds a law that pumps energy, as extras/deploy/c/swing_up.c computes it.
void AddLaw(const std::string& law, const std::vector<double>& gains, CParts& parts) {
  parts.constants.push_back({"law_gains", "of angle, velocity and energy", Floats(gains)});
  parts.macros.emplace_back("LAW", law);
  parts.work += kOnlyNearUpright;
}

void AddEnergyShaping(const LoadedPolicy& loaded, const ControllerConfig& config, CParts& parts) {
  AddCatchingRegulator(loaded, config, parts);
  const EnergyShapingConfig& energy = config.energy;
  AddLaw("'e' /* energy shaping */", {energy.kP, energy.kD, energy.kE}, parts);
}

void AddPartialFeedback(const LoadedPolicy& loaded, const ControllerConfig& config, CParts& parts) {
  AddCatchingRegulator(loaded, config, parts);
  const PartialFeedbackConfig& pfl = config.pfl;
  AddLaw("'p' /* partial feedback linearisation */", {pfl.kP, pfl.kD, pfl.kE}, parts);
}

void AddPlan(const LoadedPolicy& loaded, const ControllerConfig& config, CParts& parts) {
  AddCatchingRegulator(loaded, config, parts);
  const SwingUp& plan = dynamic_cast<const TvlqrPolicy&>(*loaded.policy).plan();
  const int steps = plan.trajectory.steps();
  std::vector<double> places, gains, costs;
  for (size_t t = 0; t < static_cast<size_t>(steps); ++t) {
    const StateVector d = UprightDeviation(plan.trajectory.x[t]);
    places.insert(places.end(), d.begin(), d.end());
    gains.insert(gains.end(), plan.K[t].begin(), plan.K[t].end());
    const std::vector<double> cost = Triangle(plan.P[t]);
    costs.insert(costs.end(), cost.begin(), cost.end());
  }
  parts.constants.push_back({"plan", "deviations from upright", Floats(places)});
  parts.constants.push_back({"plan_torque", "N m", Floats(plan.trajectory.u)});
  parts.constants.push_back({"plan_gain", "N m/rad, N m s/rad", Floats(gains)});
  parts.constants.push_back({"plan_cost", "of leaving the plan", Floats(costs)});
  parts.macros.emplace_back("PLAN_STEPS", Concat(steps, " /* control periods */"));
  parts.work += Concat(", and ", 2 * steps, " quadratic forms", kOnlyNearUpright);
}

/// A controller that has C code.
struct CController {
  const char* name;
  const char* file;       // of extras/deploy/c
  size_t state_bytes;     // of its struct; 0: `add` tells
  bool simulates = true;  // whether it looks ahead near upright
  /// Adds its constants, and its work at each decision.
  void (*add)(const LoadedPolicy& loaded, const ControllerConfig& config, CParts& parts);
};

constexpr CController kControllersInC[] = {
    {.name = "lqr", .file = "lqr.c", .state_bytes = 4, .simulates = false, .add = AddRegulator},
    {.name = "energy", .file = "swing_up.c", .state_bytes = 4, .add = AddEnergyShaping},
    {.name = "pfl", .file = "swing_up.c", .state_bytes = 4, .add = AddPartialFeedback},
    {.name = "tvlqr", .file = "tvlqr.c", .state_bytes = 12, .add = AddPlan},
    {.name = "mpc", .file = "mpc.c", .state_bytes = 0, .add = AddPredictive},
};

/// Throws BadInput if the controller has no C code.
const CController& CControllerCalled(const std::string& name) {
  for (const CController& controller : kControllersInC) {
    if (name == controller.name) return controller;
  }
  throw BadInput(Concat(name, ": expected ", Join(ControllersInC(), ", "),
                        " or a learned policy for C, got a controller without C code"));
}

/// Adds the description of a controller to the header: its file, origin, limits and plant.
void DescribeController(const LoadedPolicy& loaded, const Plant& plant, const char* file,
                        CParts& parts) {
  parts.task = PendulumTask(loaded);
  parts.task.file = file;
  parts.origin =
      Concat("It is ", CommentText(loaded.name), ": ", CommentText(loaded.policy->description()));
  parts.limit = plant.torque_limit;
  parts.period = loaded.control_period();
  parts.plant_use = "of which it knows all";
  parts.plant = plant;
}

/// Adds the samples of the self-test and their tolerance. `simulates`: whether the controller looks
/// ahead, so that the samples include a step of its simulation.
void AddSelfTest(const LoadedPolicy& loaded, const Plant& plant, bool simulates, CParts& parts) {
  const double tolerance = kTorqueShare * plant.torque_limit;
  std::vector<float> states, torques;
  DrawSamples(loaded, tolerance, states, torques);
  parts.samples = {{"sample_states", "q1, q2, w1, w2", states}, {"sample_torques", "N m", torques}};
  if (simulates) {
    parts.samples.push_back({"sample_steps", "deviations a control period later",
                             StepsFrom(states, torques, loaded.design_plant())});
  }
  parts.macros.emplace_back("SAMPLES", Concat(kLawSamples));
  parts.macros.emplace_back("TORQUE_TOLERANCE", CLiteral(static_cast<float>(tolerance)));
}

}  // namespace

std::vector<std::string> ControllersInC() { return NamesOf(kControllersInC); }

CHeader ControllerHeaderOf(const LoadedPolicy& loaded, const std::string& prefix) {
  const CController& controller = CControllerCalled(loaded.policy->kind());
  const ControllerConfig config = ConfigOf(loaded);
  CParts parts;
  DescribeController(loaded, config.plant, controller.file, parts);
  parts.state_bytes = controller.state_bytes;
  // The deviation; a simulating controller also copies it, and needs five arrays for a step.
  parts.stack_bytes = 4 * sizeof(float) * (controller.simulates ? 7 : 1);
  controller.add(loaded, config, parts);
  if (parts.samples.empty()) AddSelfTest(loaded, config.plant, controller.simulates, parts);
  CHeader header;
  header.prefix = prefix;
  WriteHeader(parts, header);
  return header;
}

}  // namespace upswing::deploy

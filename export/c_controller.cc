#include "export/c_controller.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "control/tvlqr.h"
#include "core/error.h"
#include "core/rng.h"
#include "core/text.h"
#include "export/c_code.h"
#include "export/c_controller_code.h"
#include "export/c_task.h"
#include "export/c_text.h"
#include "setup/controllers.h"
#include "sim/closed_form.h"

namespace upswing {
namespace {

constexpr int kSamples = 16;
constexpr int kMostDraws = 1000;       // of each
constexpr double kTorqueShare = 5e-4;  // of the limit: tolerance of a sample's torque
constexpr double kNearby = 1e-3;       // rad, rad/s: so near to a sample the torque does not jump
const StateVector kRange(3.14, 3.14, 4, 4);  // ±, of a sample: rad, rad/s
constexpr double kUprightShare = 0.005;      // of that, at most, about upright

/// The settings that it was made with.
ControllerConfig ConfigOf(const LoadedPolicy& loaded) {
  ControllerConfig config;
  config.plant = loaded.plant;
  ApplyToml(OptionsOf(config), loaded.policy->info().config, loaded.name);
  return config;
}

std::vector<float> Floats(const auto& numbers) {
  std::vector<float> floats;
  floats.reserve(static_cast<size_t>(numbers.size()));
  for (const double number : numbers) floats.push_back(static_cast<float>(number));
  return floats;
}

/// The upper triangle, row by row.
std::vector<double> Triangle(const Eigen::Matrix4d& P) {
  std::vector<double> numbers;
  for (int i = 0; i < 4; ++i) {
    for (int k = i; k < 4; ++k) numbers.push_back(P(i, k));
  }
  return numbers;
}

/// The first torque of an episode that begins in a state.
double TorqueAt(const LoadedPolicy& loaded, const StateVector& x) {
  const auto seen = Observe(loaded.plant, {x[0], x[1], x[2], x[3]});
  const std::vector<float> obs(seen.begin(), seen.end());
  double torque = 0;
  loaded.policy->Act({obs.data(), 1, static_cast<int>(obs.size())}, {&torque, 1, 1},
                     *loaded.policy->Start(1));
  return torque;
}

/// Whether the torque jumps by `least` or more around a state: there roundings choose.
bool Jumps(const LoadedPolicy& loaded, const StateVector& x, double least) {
  const double here = TorqueAt(loaded, x);
  for (int k = 0; k < 4; ++k) {
    const StateVector step = kNearby * StateVector::Unit(k);
    // 0 for any linear law, however steep.
    const double bend = TorqueAt(loaded, x - step) - 2 * here + TorqueAt(loaded, x + step);
    if (std::abs(bend) >= least) return true;
  }
  return false;
}

/// A state whose numbers are floats, anywhere or so near to upright that the torque is within its
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

/// States (every other one near upright) and their torques, none near a jump.
void DrawSamples(const LoadedPolicy& loaded, double tolerance, std::vector<float>& states,
                 std::vector<float>& torques) {
  Rng rng(0, "samples of a controller's C header");
  for (int i = 0; i < kSamples; ++i) {
    const bool upright = i % 2 == 0;
    StateVector x = DrawState(loaded, rng, upright);
    for (int draw = 1; Jumps(loaded, x, tolerance / 2); ++draw) {
      if (draw == kMostDraws) {
        throw BadInput(Concat(loaded.name, ": found no states where the torque is smooth enough ",
                              "for the header's self test"));
      }
      x = DrawState(loaded, rng, upright);
    }
    for (const double number : x) states.push_back(static_cast<float>(number));
    torques.push_back(static_cast<float>(TorqueAt(loaded, x)));
  }
}

/// The deviations from upright one control period after the samples.
std::vector<float> StepsFrom(const std::vector<float>& states, const std::vector<float>& torques,
                             const Plant& plant) {
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

/// A header while it is made.
class ControllerWriter {
 public:
  explicit ControllerWriter(const LoadedPolicy& loaded)
      : loaded_(loaded), kind_(loaded.policy->kind()), config_(ConfigOf(loaded)) {}

  CHeader Write(const std::string& prefix) {
    AddParts();
    for (const CArray& array : arrays_) header_.constant_bytes += 4 * array.values.size();
    header_.prefix = prefix;
    header_.state_bytes = plan_steps_ > 0 ? 12 : 4;
    // The deviation; for others its copy that is simulated, too, and five arrays of a step.
    header_.stack_bytes = 4 * sizeof(float) * (kind_ == "lqr" ? 1 : 7);
    std::string text = Concat(Head(), Declarations(), c_code::kNumbers, "\n");
    for (const CArray& array : arrays_) text += ArrayText(array);
    text += Concat(code_, Control(), SelfTest(), "\n#endif\n");
    header_.text =
        Replaced(Replaced(text, "NAME_", prefix + "_"), "CAPS_", UpperCase(prefix) + "_");
    return header_;
  }

 private:
  void AddParts();
  void AddCatch(const LqrCatch& upright);
  void AddPlan(const SwingUp& plan);
  std::string Head() const;
  std::string Declarations() const;
  std::string Control() const;
  std::string SelfTest() const;

  const LoadedPolicy& loaded_;
  const std::string kind_;
  const ControllerConfig config_;
  std::vector<CArray> arrays_;
  std::string code_;    // functions before NAME_control
  std::string choose_;  // statements that choose a torque u at d
  int look_ahead_ = 0, plan_steps_ = 0;
  CHeader header_;
};

void ControllerWriter::AddParts() {
  const auto gain = [&](const Lqr& lqr) {
    arrays_.push_back({"gain", "N m/rad, N m s/rad", Floats(lqr.K)});
    code_ = c_code::kDeviation;
  };
  if (kind_ == "lqr") {
    gain(SolveLqr(config_.lqr, config_.plant));
    choose_ = "    u = NAME_regulator(d);\n";
    return;
  }
  const LqrCatch upright(config_.lqr, config_.plant);
  gain(upright.lqr());
  AddCatch(upright);
  if (kind_ == "tvlqr") {
    AddPlan(dynamic_cast<const TvlqrPolicy&>(*loaded_.policy).plan());
    choose_ = R"c(    if (NAME_catches(d)) {
      state->step = CAPS_PLAN_STEPS;
      state->sign = 1.0f;
      u = NAME_regulator(d);
    } else {
      u = NAME_follow(state, d);
    }
)c";
    return;
  }
  const bool energy = kind_ == "energy";
  const std::vector<double> gains =
      energy ? std::vector{config_.energy.kP, config_.energy.kD, config_.energy.kE}
             : std::vector{config_.pfl.kP, config_.pfl.kD, config_.pfl.kE};
  arrays_.push_back({"law_gains", "of angle, velocity and energy", Floats(gains)});
  code_ +=
      Filled(c_code::kTerms, {{"law", energy ? c_code::kEnergyShaping : c_code::kPartialFeedback}});
  choose_ = "    u = NAME_catches(d) ? NAME_regulator(d) : NAME_law(d);\n";
}

void ControllerWriter::AddCatch(const LqrCatch& upright) {
  if (config_.plant.coulomb1 != 0 || config_.plant.coulomb2 != 0) {
    throw BadInput(Concat(loaded_.name,
                          ": expected a plant without dry friction (coulomb1, coulomb2 ",
                          "0), which the C code's look-ahead does not have"));
  }
  ClosedFormBatch batch(1);
  batch.SetPlant(0, config_.plant);
  arrays_.push_back({"plant", "of the equations of motion",
                     Floats(std::array{batch.J1[0], batch.J2[0], batch.b[0], batch.G1[0],
                                       batch.G2[0], batch.d1[0], batch.d2[0], batch.a[0]})});
  arrays_.push_back(
      {"upright_cost", "of a deviation from upright", Floats(Triangle(upright.lqr().P))});
  arrays_.push_back({"region", "of attraction", Floats(std::array{upright.region()})});
  look_ahead_ = upright.steps();
  const bool first = config_.plant.actuated_joint == 1;
  code_ += c_code::kCost + Filled(c_code::kCatch, {{"torque1", first ? "torque + " : ""},
                                                   {"torque2", first ? "" : "torque + "}});
}

void ControllerWriter::AddPlan(const SwingUp& plan) {
  plan_steps_ = plan.trajectory.steps();
  std::vector<double> places, gains, costs;
  for (size_t t = 0; t < static_cast<size_t>(plan_steps_); ++t) {
    const StateVector d = UprightDeviation(plan.trajectory.x[t]);
    places.insert(places.end(), d.begin(), d.end());
    gains.insert(gains.end(), plan.K[t].begin(), plan.K[t].end());
    const std::vector<double> cost = Triangle(plan.P[t]);
    costs.insert(costs.end(), cost.begin(), cost.end());
  }
  arrays_.push_back({"plan", "deviations from upright", Floats(places)});
  arrays_.push_back({"plan_torque", "N m", Floats(plan.trajectory.u)});
  arrays_.push_back({"plan_gain", "N m/rad, N m s/rad", Floats(gains)});
  arrays_.push_back({"plan_cost", "of leaving the plan", Floats(costs)});
  code_ += c_code::kPlan;
}

std::string ControllerWriter::Head() const {
  std::string states;
  const CTask task = CTaskOf(loaded_);
  for (const auto& [name, meaning] : task.state) {
    states += Concat(" *   ", name, std::string(8 - name.size(), ' '), meaning, '\n');
  }
  std::string work = "Work of a call: a product of four numbers.";
  if (look_ahead_ > 0) {
    work = Concat("Work of a call: up to ", look_ahead_,
                  " control periods of simulation near upright, of 16 derivatives each");
    if (plan_steps_ > 0) work += Concat(", and ", 2 * plan_steps_, " quadratic forms");
    work += "; away from upright none of the simulation.";
  }
  const char* goal =
      kind_ == "lqr" ? "holds a double pendulum with one motor upright" : task.goal.c_str();
  return Filled(
      c_code::kHead,
      {{"goal", goal},
       {"origin", Paragraph(Concat("It is ", CommentText(loaded_.name), ": ",
                                   CommentText(loaded_.policy->description()),
                                   ". Written by Upswing ", UPSWING_VERSION, '.'))},
       {"names", "q1, q2, w1, w2"},
       {"states", states},
       {"motor", task.motor},
       {"limit", FormatNumber(config_.plant.torque_limit)},
       {"period", FormatNumber(kControlPeriod)},
       {"plant", PlantParagraph(config_.plant, "of which it knows all")},
       {"needs", Paragraph(Concat("Flash: ", header_.constant_bytes,
                                  " bytes of constants, 1 to 3 KB of code, and up to 600 bytes "
                                  "of samples where the self test is used. RAM: ",
                                  header_.state_bytes, " bytes of state, and arrays of ",
                                  header_.stack_bytes, " bytes on the stack. ", work))}});
}

std::string ControllerWriter::Declarations() const {
  std::string sizes;
  if (look_ahead_ > 0) {
    sizes += Concat("#define CAPS_LOOK_AHEAD ", look_ahead_, " /* control periods */\n");
  }
  if (plan_steps_ > 0) {
    sizes += Concat("#define CAPS_PLAN_STEPS ", plan_steps_, " /* control periods */\n");
  }
  return Filled(Concat(c_code::kOpening, sizes, c_code::kDeclarations),
                {{"period", CLiteral(static_cast<float>(kControlPeriod))},
                 {"limit", CLiteral(static_cast<float>(config_.plant.torque_limit))},
                 {"constant_bytes", Concat(header_.constant_bytes)},
                 {"acted", ""},
                 {"state", plan_steps_ > 0 ? c_code::kPlace : ""}});
}

std::string ControllerWriter::Control() const {
  return Filled(c_code::kControllerControl,
                {{"forget", plan_steps_ > 0 ? "  state->step = -1;\n  state->sign = 1.0f;\n" : ""},
                 {"choose", choose_}});
}

std::string ControllerWriter::SelfTest() const {
  const double tolerance = kTorqueShare * config_.plant.torque_limit;
  std::vector<float> states, torques;
  DrawSamples(loaded_, tolerance, states, torques);
  std::string steps;
  if (look_ahead_ > 0) {
    steps = ArrayText({"sample_steps", "deviations a control period later",
                       StepsFrom(states, torques, config_.plant)});
  }
  const CChecksum checksum = ChecksumOf(arrays_);
  return Filled(Concat(c_code::kChecksum, c_code::kControllerSelfTest),
                {{"tables", ArrayText({"sample_states", "q1, q2, w1, w2", states}) +
                                ArrayText({"sample_torques", "N m", torques}) + steps},
                 {"step", look_ahead_ > 0 ? c_code::kStepTest : ""},
                 {"sums", checksum.lines},
                 {"checksum", Concat(checksum.sum, 'u')},
                 {"samples", Concat(kSamples)},
                 {"torque_tolerance", CLiteral(static_cast<float>(tolerance))}});
}

}  // namespace

CHeader ControllerHeaderOf(const LoadedPolicy& loaded, const std::string& prefix) {
  const std::string kind = loaded.policy->kind();
  if (kind == "mpc") {
    throw BadInput(
        "mpc: expected lqr, energy, pfl, tvlqr or a learned policy to write as C, got a "
        "controller that optimises a trajectory at each decision; tvlqr follows one "
        "that is planned once");
  }
  if (kind == "hybrid") {
    throw BadInput(
        "hybrid: expected lqr, energy, pfl, tvlqr or a learned policy to write as C, got "
        "two of them; export the policy that swings up, and lqr, each by itself");
  }
  return ControllerWriter(loaded).Write(prefix);
}

}  // namespace upswing

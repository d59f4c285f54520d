// The page's interface to the core: policies, formulas, learners. Objects are pointers, which the
// page deletes. Texts are UTF-8, most of them JSON. A failed call returns 0 and leaves a message.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "agents/controllers.h"
#include "agents/loaded_policy.h"
#include "base/safetensors.h"
#include "nn/gaussian.h"
#include "nn/network_policy.h"
#include "pendulum/identification.h"
#include "pendulum/mjcf.h"
#include "pendulum/observation.h"
#include "pendulum/sensors.h"
#include "pendulum/timestep.h"
#include "rl/ppo/softmax.h"
#include "web/wasm/fields.h"
#include "web/wasm/learner.h"
#include "web/wasm/step.h"

#define UPSWING_EXPORT(name) extern "C" __attribute__((export_name(#name)))

using namespace upswing;
using nlohmann::json;

namespace {

std::string text;               // result of the last call that returns a text
std::vector<std::byte> bytes;   // result of the last call that returns a file
std::array<double, 32> number;  // input and output of the formulas

/// Returns the result of `work`; 0 if it throws, with the reason as the text.
template <typename Work>
auto Guarded(const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    text = "it does not fit into a page's memory";
  } catch (const std::exception& error) {
    text = error.what();
  }
  return {};
}

/// A text for JavaScript, with replacements for bytes that are not UTF-8.
int SetText(const json& value) {
  text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  return 1;
}

/// A policy and its memory.
struct Controller {
  explicit Controller(LoadedPolicy policy)
      : loaded(std::move(policy)),
        units(Scale() / loaded.scale()),
        learned(dynamic_cast<const NetworkPolicy*>(&*loaded.policy)),
        memory(loaded.policy->Start(1)) {}

  bool gaussian() const { return learned != nullptr && !learned->parts().facts().chooses_torque(); }
  /// The discrete torques (A, N·m); empty if torques are continuous.
  std::span<const double> torques() const {
    if (learned != nullptr) return learned->parts().torques;
    return {};
  }
  /// Length of a decision; see PolicyDecide.
  size_t columns() const {
    const size_t of_kind = gaussian() ? CountFields<GaussianFields>() : torques().size();
    return CountFields<DecisionFields>() + of_kind;
  }
  /// Whether it is computed from the equations of motion, and may plan.
  bool computed() const { return learned == nullptr; }
  double self_check_error() const { return computed() ? 0 : learned->self_check().error; }
  double limit() const {
    if (computed()) return loaded.plant.torque_limit;
    return learned->is_actor() ? learned->parts().action_limit.front() : 0;
  }

  LoadedPolicy loaded;
  Scale units;                             // of the built-in plant, in those of its observations
  const NetworkPolicy* learned;            // null: computed controller
  std::unique_ptr<Policy::Memory> memory;  // of policies without plans
};

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// The kind of a controller's decisions (web/src/decision.ts).
const char* KindOf(const Controller& c) {
  if (c.computed()) return "computed";
  switch (c.learned->parts().facts().outputs) {
    case OutputMeaning::kQValues:
      return "q";
    case OutputMeaning::kLogits:
      return "categorical";
    case OutputMeaning::kGaussian:
      break;
  }
  return "gaussian";
}

json About(const Controller& c, const std::map<std::string, std::string>& metadata) {
  const Policy& policy = *c.loaded.policy;
  return {{"kind", KindOf(c)},
          {"text", policy.description()},
          {"inputs", policy.obs_size()},
          {"columns", c.columns()},
          {"torques", c.torques()},
          {"limit", c.limit()},
          {"memory", c.loaded.memory()},
          {"identifies", c.loaded.identifies()},
          {"any_pose", c.loaded.seeks_any_pose()},
          {"period", c.loaded.control_period()},
          {"time_unit", c.units.time},
          {"torque_unit", c.units.torque},
          {"selfCheckError", c.self_check_error()},
          {"metadata", metadata}};
}

/// Decides by a Q-network, and writes Q into `of_kind`.
DecisionFields DecideByQ(const Controller& c, Matrix<const float> obs, Policy::Memory& memory,
                         std::span<double> of_kind) {
  DecisionFields decision;
  std::vector<float> q(c.torques().size());
  c.learned->Act(obs, {&decision.torque, 1, 1}, memory);
  c.learned->Values(obs, {q.data(), 1, static_cast<int>(q.size())}, memory);
  // Q = V + A - mean(A), so V is the mean of Q. A plain network has no V.
  const double sum = std::accumulate(q.begin(), q.end(), 0.0);
  decision.value = c.learned->parts().shape.dueling() ? sum / static_cast<double>(q.size()) : kNone;
  std::ranges::copy(q, of_kind.begin());
  return decision;
}

/// Decides by an actor with V of its critic, and writes its distribution into `of_kind`.
DecisionFields DecideByActor(const Controller& c, Matrix<const float> obs, Policy::Memory& memory,
                             std::span<double> of_kind) {
  DecisionFields decision;
  std::vector<float> outputs(static_cast<size_t>(c.learned->num_outputs()));
  float value = static_cast<float>(kNone);
  c.learned->Outputs(obs, {outputs.data(), 1, c.learned->num_outputs()}, memory);
  c.learned->Choose(outputs, {&decision.torque, 1});
  if (c.learned->num_values() > 0) c.learned->Values(obs, {&value, 1, 1}, memory);
  decision.value = value;
  if (c.gaussian()) {
    GaussianFields gaussian;
    c.learned->Spread(outputs, {&gaussian.low, 1}, {&gaussian.high, 1});
    gaussian.mean = outputs[0];
    gaussian.log_std = outputs[1];
    WriteFields(gaussian, of_kind);
  } else {
    const std::vector<double> logits(outputs.begin(), outputs.end());
    Softmax<double>(logits, of_kind);
  }
  return decision;
}

/// Decides by a controller.
DecisionFields DecideByFormula(const Controller& c, Matrix<const float> obs,
                               Policy::Memory& memory) {
  DecisionFields decision{0, kNone};
  c.loaded.policy->Act(obs, {&decision.torque, 1, 1}, memory);
  return decision;
}

}  // namespace

// Memory that the page fills, such as with a file; texts and files that a call has left.
UPSWING_EXPORT(reserve) void* Reserve(size_t size) { return std::malloc(size); }
UPSWING_EXPORT(release) void Release(void* block) { std::free(block); }
UPSWING_EXPORT(text_at) const char* TextAt() { return text.data(); }
UPSWING_EXPORT(text_size) size_t TextSize() { return text.size(); }
UPSWING_EXPORT(bytes_at) const std::byte* BytesAt() { return bytes.data(); }
UPSWING_EXPORT(bytes_size) size_t BytesSize() { return bytes.size(); }

// ----------------------------------------------------------------------------------------------
// Policies.

namespace {

/// Throws BadInput for a policy of a plant that the page does not have. In the place of a plant of
/// another size, the page shows its own at that size.
void ExpectPageCanShow(const Controller& controller) {
  const Plant& plant = controller.loaded.plant;
  if (plant.actuated_joint != 1) {
    throw BadInput("expected a policy for a motor at joint 1, as in the page, got one for joint 2");
  }
  if (plant.rotor_inertia != 0 || plant.has_dry_friction()) {
    throw BadInput(
        "expected a policy for a plant without rotors and dry friction, as in the page, got one "
        "with them");
  }
  if (controller.units != Scale()) return;
  if (plant.has_own_links() || plant.armature != kArmature || plant.own_armature1() != kArmature) {
    throw BadInput(
        "expected a policy for links that are solid capsules and the usual armature, as in the "
        "page, got others");
  }
  CheckTimestep(plant, "plant", kPhysicsTimestep);
}

}  // namespace

/// Reads and checks a policy file. Leaves its description as JSON. The page carries a policy for
/// another size over to the built-in plant, in whose units it computes (as ForOtherSize).
UPSWING_EXPORT(policy_open) Controller* PolicyOpen(const std::byte* file, size_t size) {
  return Guarded([&]() -> Controller* {
    const Tensors tensors = ReadSafetensors({file, file + size}, "the file");
    auto controller = std::make_unique<Controller>(ReadPolicy(tensors));
    ExpectPendulum(controller->loaded);
    ExpectPageCanShow(*controller);
    SetText(About(*controller, tensors.metadata));
    return controller.release();
  });
}

/// Designs a controller for the nominal plant by its name (agents/controllers.h). Leaves its
/// description as JSON.
UPSWING_EXPORT(policy_make) Controller* PolicyMake(const char* name, size_t size) {
  return Guarded([&] {
    const std::string called(name, size);
    auto controller = std::make_unique<Controller>(
        LoadedPolicy{called, "", MakeController(called, {}), kDoublePendulum, Plant()});
    SetText(About(*controller, PolicyMetadata(controller->loaded.policy->info())));
    return controller.release();
  });
}

UPSWING_EXPORT(policy_close) void PolicyClose(Controller* controller) { delete controller; }

/// Begins an episode and returns the policy's memory of it. 0 for learned policies, which have
/// none.
UPSWING_EXPORT(memory_open) Policy::Memory* MemoryOpen(const Controller* controller) {
  return Guarded([&]() -> Policy::Memory* {
    return controller->computed() ? controller->loaded.policy->Start(1).release() : nullptr;
  });
}

UPSWING_EXPORT(memory_close) void MemoryClose(Policy::Memory* memory) { delete memory; }

/// The policy's decision about an observation (D): DecisionFields, then the numbers of its kind.
/// Q-network: Q of each torque. Categorical actor: each torque's probability. Gaussian actor:
/// GaussianFields. Without a memory, decides as at the beginning of an episode.
UPSWING_EXPORT(policy_decide)
int PolicyDecide(Controller* controller, Policy::Memory* episode, const float* obs, double* to) {
  return Guarded([&] {
    Controller& c = *controller;
    const Policy& policy = *c.loaded.policy;
    const Matrix<const float> observation(obs, 1, policy.obs_size());
    const std::span<double> row(to, c.columns());
    const std::span<double> of_kind = row.subspan(CountFields<DecisionFields>());
    if (episode == nullptr && c.computed()) c.memory = policy.Start(1);
    Policy::Memory& memory = episode != nullptr ? *episode : *c.memory;
    DecisionFields decision;
    if (c.computed()) {
      decision = DecideByFormula(c, observation, memory);
    } else if (c.learned->is_actor()) {
      decision = DecideByActor(c, observation, memory, of_kind);
    } else {
      decision = DecideByQ(c, observation, memory, of_kind);
    }
    if (!std::isfinite(decision.torque)) decision.torque = 0;  // an overflow gives no torque
    WriteFields(decision, row);
    return 1;
  });
}

/// Probabilities of the actions of a Gaussian policy; see nn/gaussian.h.
UPSWING_EXPORT(gaussian_probabilities)
void GaussianProbabilities(const Controller* c, double mean, double log_std, double* to,
                           size_t count) {
  ActionProbabilities(Gaussian<double>::From(mean, log_std), *c->learned->parts().facts().bound,
                      {to, count});
}

/// Writes the memory of `steps` steps into an observation (D). `before` is the previous
/// observation, for which the torque was chosen.
UPSWING_EXPORT(observation_remember)
void ObservationRemember(const float* before, double torque, int steps, float* obs, size_t size) {
  Remember({before, size}, torque, steps, {obs, size});
}

// ----------------------------------------------------------------------------------------------
// The pendulum's formulas. `number` is their input and output.

UPSWING_EXPORT(numbers) double* Numbers() { return number.data(); }

/// Leaves the names of the fields of all structs; see FieldTable.
UPSWING_EXPORT(field_table) void FieldTableAsText() { text = FieldTable(); }

namespace {

template <typename T>
T Input() {
  return ReadFields<T>(number);
}

template <typename T>
void Output(const T& fields) {
  WriteFields(fields, number);
}

}  // namespace

/// Input: JudgedFields. Output: JudgementFields.
UPSWING_EXPORT(pendulum_at) void PendulumAt() {
  const auto in = Input<JudgedFields>();
  const Plant& plant = in.plant;
  const PendulumState& s = in.state;
  const bool any_pose = in.goal1 != 0;
  const Pose goal = any_pose ? Pose{in.goal1 > 0, in.goal2 > 0} : Pose();
  JudgementFields out;
  std::ranges::copy(Observe(plant, s), out.observation.begin());
  out.energy = Energy(plant, s);
  out.normalized_energy = NormalizedEnergy(plant, s);
  out.tip_height = TipHeight(plant, s);
  out.relative_height = out.observation.back();
  out.inverted = Inverted(SeenFrom(goal, s)) ? 1 : 0;
  out.reward_terms =
      any_pose ? RewardTerms(plant, s, in.torque, goal) : RewardTerms(plant, s, in.torque);
  Output(out);
}

/// Input: PlantFields, at size 1. 1 if the physics is stable for it.
UPSWING_EXPORT(pendulum_check) int PendulumCheck() {
  return Guarded([] {
    CheckTimestep(Input<PlantFields>().plant, "plant", kPhysicsTimestep);
    return 1;
  });
}

/// Input: PlantFields, at size 1. Number of physics steps in a control period of `period` seconds.
UPSWING_EXPORT(physics_steps) int PhysicsSteps(double period) {
  return PhysicsStepsFor(Input<PlantFields>().plant, period, "plant");
}

/// One physics step. Input: PushedFields. Output: StateFields after it.
UPSWING_EXPORT(pendulum_step) void PendulumStep() {
  const auto in = Input<PushedFields>();
  const Push push{static_cast<int>(in.link), in.along, in.x, in.z};
  Output(StateFields{Step(in.Built(), in.state, in.torque, push, in.timestep)});
}

/// An estimator of the plant of one pendulum, from its nominal PlantFields and control period (s).
UPSWING_EXPORT(identifier_open) Identifier* IdentifierOpen(double period) {
  return std::make_unique<Identifier>(Input<PlantFields>().plant, period, 1).release();
}

UPSWING_EXPORT(identifier_close) void IdentifierClose(Identifier* identifier) { delete identifier; }

/// Begins in measured StateFields.
UPSWING_EXPORT(identifier_begin) void IdentifierBegin(Identifier* identifier) {
  identifier->Begin(0, Input<StateFields>().state);
}

/// Input: IdentifierFields.
UPSWING_EXPORT(identifier_update) void IdentifierUpdate(Identifier* identifier) {
  const auto in = Input<IdentifierFields>();
  identifier->Update(0, in.torque, in.state, in.noise);
}

/// Input: StateFields. Output: IdentifiedFields.
UPSWING_EXPORT(identifier_observe) void IdentifierObserve(const Identifier* identifier) {
  std::array<float, kIdentifiedSize> added;
  identifier->Observe(0, Input<StateFields>().state, added);
  IdentifiedFields out;
  std::ranges::copy(added, out.identified.begin());
  Output(out);
}

/// The sensors of one pendulum with this control period (s).
UPSWING_EXPORT(sensors_open) Sensors* SensorsOpen(double period) {
  const SensorModel slowest{kLongestLatency, 0, kLongestWindow, kSlowestFilter};
  return std::make_unique<Sensors>(1, period, slowest).release();
}

UPSWING_EXPORT(sensors_close) void SensorsClose(Sensors* sensors) { delete sensors; }

/// Begins in StateFields.
UPSWING_EXPORT(sensors_begin) void SensorsBegin(Sensors* sensors) {
  sensors->Begin(0, Input<StateFields>().state);
}

/// Input: SensorsFields. Output: ReadingFields.
UPSWING_EXPORT(sensors_measure) void SensorsMeasure(Sensors* sensors) {
  const auto in = Input<SensorsFields>();
  ReadingFields out;
  out.state = sensors->Measure(0, in.model, in.state, in.torque);
  out.torque = sensors->Torque(0, in.model);
  out.noise = in.model.velocity_noise();
  Output(out);
}

/// Input: CapsuleFields. Output: CapsuleInertiaFields.
UPSWING_EXPORT(capsule_inertia) void CapsuleInertiaOf() {
  const auto in = Input<CapsuleFields>();
  const CapsuleInertia inertia(in.mass, in.radius, in.length);
  Output(CapsuleInertiaFields{inertia.across, inertia.along});
}

/// Input: PlantFields. Leaves the model as MJCF.
UPSWING_EXPORT(pendulum_mjcf) void PendulumMjcf() { text = Mjcf(Input<PlantFields>().Built()); }

// ----------------------------------------------------------------------------------------------
// Learners.

/// Opens a learner with settings of the program as lines NAME=VALUE.
UPSWING_EXPORT(learner_open) Learner* LearnerOpen(const char* settings, size_t size) {
  return Guarded([&] {
    std::vector<FlagValue> flags;
    for (const std::string_view line : Split({settings, size}, '\n')) {
      const size_t equals = line.find('=');
      if (equals == std::string_view::npos)
        throw BadInput(Concat("settings: expected NAME=VALUE, got \"", line, "\""));
      const std::string name(line.substr(0, equals));
      flags.push_back({name, std::string(line.substr(equals + 1)), name});
    }
    return std::make_unique<Learner>(flags).release();
  });
}

UPSWING_EXPORT(learner_close) void LearnerClose(Learner* learner) { delete learner; }

/// Makes at most `most` steps of all environments. Returns 1: not finished; 2: finished; 0: failed.
UPSWING_EXPORT(learner_run) int LearnerRun(Learner* learner, int most) {
  return Guarded([&] { return learner->Run(most) ? 1 : 2; });
}

/// Leaves the training's progress and its events since the last report as JSON.
UPSWING_EXPORT(learner_report) int LearnerReport(Learner* learner) {
  return Guarded([&] { return SetText(learner->Report()); });
}

/// Leaves an example of the last update as JSON; null if there is none.
UPSWING_EXPORT(learner_last_update) int LearnerLastUpdate(Learner* learner) {
  return Guarded([&] { return SetText(learner->LastUpdate()); });
}

/// Leaves the current policy, or the best evaluated one (empty: none yet), as a file.
UPSWING_EXPORT(learner_policy) int LearnerPolicy(Learner* learner, int best) {
  return Guarded([&] {
    bytes = best != 0 ? learner->best() : learner->policy();
    return 1;
  });
}

/// Leaves q1 and q2 (rad) of each training pendulum as 32-bit floats.
UPSWING_EXPORT(learner_poses) int LearnerPoses(Learner* learner) {
  return Guarded([&] {
    bytes = learner->Poses();
    return 1;
  });
}

/// Leaves the settings of a named agent as JSON: name, value, range, whether an integer, unit and
/// help.
UPSWING_EXPORT(agent_settings) int AgentSettings(const char* agent, size_t size) {
  return Guarded([&] {
    const Config config = ConfigOf({{"agent", {agent, size}, "agent"}});
    json settings = json::array();
    const Options options = OptionsOf(config);
    for (const Option& option : options.all()) {
      settings.push_back({{"name", option.name},
                          {"value", option.plain_text()},
                          {"low", option.lowest()},
                          {"high", option.range.high},
                          {"whole", std::holds_alternative<int64_t*>(option.target)},
                          {"unit", option.unit},
                          {"help", option.help}});
    }
    return SetText(settings);
  });
}

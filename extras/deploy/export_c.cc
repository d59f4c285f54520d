#include <algorithm>
#include <array>
#include <numbers>

#include "base/error.h"
#include "base/text.h"
#include "extras/deploy/c_header.h"
#include "extras/deploy/c_text.h"
#include "extras/deploy/export.h"
#include "extras/deploy/exported_policy.h"
#include "os/streams.h"
#include "pendulum/observation.h"

namespace upswing::deploy {
namespace {

constexpr size_t kMostParameters = 2'000'000;  // about 23 MB of header
constexpr size_t kLongestPrefix = 32;
constexpr int kBlockRows = 8;  // see linear in extras/deploy/c/network.c
// Of an identified number of the self-test; they are of size 1, and rounding changes them by 1e-4.
constexpr double kIdentifiedTolerance = 1e-3;
// Numbers in the arrays of an update of the estimates. A compiler keeps them in the caller's frame.
constexpr size_t kIdentifiedArrays = 100;

/// The weights (out × in) in the order of the function linear in extras/deploy/c/network.c: blocks
/// of rows, each column by column, then the remaining rows.
std::vector<float> InBlocks(const LayerView& layer) {
  std::vector<float> ordered;
  ordered.reserve(layer.W.size());
  int row = 0;
  for (; row + kBlockRows <= layer.out(); row += kBlockRows) {
    for (int col = 0; col < layer.in(); ++col) {
      for (int k = 0; k < kBlockRows; ++k) ordered.push_back(layer.W(col, row + k));
    }
  }
  for (; row < layer.out(); ++row) {
    for (int col = 0; col < layer.in(); ++col) ordered.push_back(layer.W(col, row));
  }
  return ordered;
}

/// The layers that choose the torque. Leaves out a dueling network's value stream, which does not
/// change the best torque, and keeps only a Gaussian's mean.
std::vector<LayerView> LayersOf(const ExportedPolicy& policy) {
  std::vector<LayerView> layers = policy.ActingLayers();
  if (!policy.is_discrete()) layers.back() = layers.back().Units(0, 1);
  return layers;
}

/// `text` as a C prefix: small letters and digits, beginning with a letter, with _ in place of
/// other characters between them.
std::string AsPrefix(std::string_view text) {
  std::string prefix = Cleaned(text, '_');
  if (!prefix.empty() && prefix[0] <= '9') prefix = "policy_" + prefix;
  prefix.resize(std::min(prefix.size(), kLongestPrefix));
  if (prefix.ends_with('_')) prefix.pop_back();
  return prefix;
}

/// The policy's origin according to its file.
std::string OriginOf(const PolicyInfo& info) {
  std::vector<std::string> parts;
  const auto add = [&](const char* what, const auto& value) {
    if (value) parts.push_back(Concat(what, ' ', *value));
  };
  if (!info.agent.empty()) parts.push_back("agent " + info.agent);
  add("seed", info.seed);
  add("step", info.step);
  if (info.success_rate) parts.push_back(Concat("success ", 100 * *info.success_rate, " percent"));
  add("mean return", info.mean_return);
  if (!info.upswing_version.empty()) parts.push_back("upswing " + info.upswing_version);
  return parts.empty() ? "unknown" : CommentText(Join(parts, ", "));
}

/// Constants of energy and height for extras/deploy/c/pendulum.c. The energy is linear in them, so
/// they follow from Energy at a few states.
std::vector<float> EnergyConstants(const Plant& plant) {
  constexpr double kPi = std::numbers::pi;
  const double whole = 2 * EnergyTarget(plant);
  const double hanging = Energy(plant, {0, 0, 0, 0}), folded = Energy(plant, {0, kPi, 0, 0});
  const double own1 = Energy(plant, {0, 0, 1, -1}) - hanging;  // w1 = 1, w1 + w2 = 0
  const double own2 = Energy(plant, {0, 0, 0, 1}) - hanging;   // w1 = 0, w1 + w2 = 1
  const double both = Energy(plant, {0, 0, 1, 0}) - hanging - own1 - own2;
  const double length = plant.length1 + plant.length2;
  return Floats(std::array{own1 / whole, own2 / whole, both / whole, (hanging + folded) / 2 / whole,
                           (hanging - folded) / 2 / whole, plant.length1 / length,
                           plant.length2 / length});
}

/// Adds the constants and macros that the double pendulum's header needs.
void AddPlant(const LoadedPolicy& loaded, CParts& parts) {
  static_assert(kMemorySize == 3);  // extras/deploy/c/observe.c has the same
  const Plant& plant = loaded.plant;
  parts.plant_use = "by which it computes energy and height";
  parts.plant = plant;
  parts.constants = {{"energy", "of the observed energy and height", EnergyConstants(plant)}};
  if (!loaded.identifies()) return;
  static_assert(kConstants == 7 && kIdentifiedSize == 13);  // as in identification.c
  parts.plant_use =
      "from which its identification starts, and by which it computes energy and "
      "height";
  const Identifier filter(plant, loaded.control_period(), 1);
  AddEquations(plant, filter.physics_steps(), parts);
  parts.constants.push_back(
      {"prior", "covariance of the relative constants at the start", Floats(filter.prior())});
  const auto add = [&](const char* name, double value, const char* comment) {
    parts.macros.emplace_back(name, CLiteral(static_cast<float>(value)) + comment);
  };
  parts.macros.emplace_back("IDENTIFIED_SIZE", Concat(kIdentifiedSize, " /* of the plant */"));
  add("IDENTIFIED_SCALE", kConstantScale, " /* divides deviations of constants */");
  add("IDENTIFIED_NOISE", filter.noise(), " /* rad/s, of a change of velocity */");
  add("IDENTIFIED_TOLERANCE", kIdentifiedTolerance, " /* of the self-test */");
  add("MOTOR_LIMIT", plant.torque_limit, " /* N m, with which it returns from a fall */");
}

/// Adds the layers' arrays and the list of layers.
void AddLayers(const std::vector<LayerView>& layers, const std::string& prefix, CParts& parts) {
  std::string rows;
  for (const LayerView& layer : layers) {
    const std::string name = Replaced(layer.name, ".", "_");
    const std::string array = Concat(prefix, '_', name);
    const auto add = [&](const char* what, const std::string& comment, std::vector<float> values) {
      parts.constants.push_back({name + what, comment, std::move(values)});
    };
    add("_weight", Concat(layer.out(), " x ", layer.in()), InBlocks(layer));
    add("_bias", "", Floats(layer.b));
    std::string norm = "0, 0";
    if (layer.layer_norm()) {
      add("_norm_weight", "", Floats(layer.gain));
      add("_norm_bias", "", Floats(layer.norm_bias));
      norm = Concat(array, "_norm_weight,\n   ", array, "_norm_bias");
    }
    char activation = 'n';
    if (layer.activation == Activation::kRelu) activation = 'r';
    if (layer.activation == Activation::kTanh) activation = 't';
    rows += Concat("  {", array, "_weight, ", array, "_bias,\n   ", norm, ",\n   ", layer.in(),
                   ", ", layer.out(), ", '", activation, "'},\n");
  }
  parts.layers = Concat(
      "static const struct {\n  const float *weight, *bias, *norm_weight, *norm_bias;\n"
      "  int in, out;\n  char activation; /* r: relu, t: tanh, n: none */\n} ",
      prefix, "_layers[", layers.size(), "] = {\n", rows, "};\n");
}

/// The sizes of a network and the work of a call.
struct NetworkSizes {
  size_t layers = 0;         // number of layers
  size_t multiply_adds = 0;  // of a call
  int widest = 0;            // outputs of the widest layer
  int outputs = 0;           // of the last layer
  int tanhs = 0;             // calls of tanh, with that of a squashed action
};

NetworkSizes SizesOf(const ExportedPolicy& policy, const std::vector<LayerView>& layers) {
  NetworkSizes sizes;
  sizes.layers = layers.size();
  sizes.outputs = layers.back().out();
  if (policy.rule().bound == &kSquash) ++sizes.tanhs;
  for (const LayerView& layer : layers) {
    sizes.multiply_adds += layer.W.size();
    sizes.widest = std::max(sizes.widest, layer.out());
    if (layer.activation == Activation::kTanh) sizes.tanhs += layer.out();
  }
  return sizes;
}

/// Adds the sizes in RAM.
void AddSizes(const ExportedPolicy& policy, const NetworkSizes& sizes, CParts& parts) {
  constexpr size_t kFloat = 4;  // bytes
  const LoadedPolicy& loaded = *policy.loaded;
  const int memory = loaded.memory();
  size_t state = 1;                                // the last torque
  if (memory > 0 || loaded.identifies()) ++state;  // whether it runs
  if (memory > 0) state += static_cast<size_t>(2 + kMemorySize * memory);
  if (loaded.identifies()) state += kConstants + kConstants * (kConstants + 1) / 2 + 4;
  if (loaded.seeks_any_pose()) state += kGoalSize;
  parts.state_bytes = kFloat * state;
  parts.stack_bytes =
      kFloat * (static_cast<size_t>(policy.obs_size() + sizes.outputs + 2 * sizes.widest) +
                (loaded.identifies() ? kIdentifiedArrays : 0));
}

/// The work of a call, as text that ends a sentence.
std::string WorkOf(const ExportedPolicy& policy, const NetworkSizes& sizes) {
  std::string work = Concat(sizes.multiply_adds, " multiply-adds");
  if (!policy.is_foreign()) {
    work += Concat(", ", policy.task.state.size(), " sines and cosines");
  }
  if (policy.loaded->identifies()) {
    const Identifier filter(policy.loaded->plant, policy.loaded->control_period(), 1);
    work += Concat(", ", 4 * filter.physics_steps(),
                   " derivatives of the motion, two updates of seven constants");
  }
  if (sizes.tanhs > 0) work += Concat(", ", sizes.tanhs, " of tanh");
  return work + '.';
}

/// Adds the description of the policy to the header: its task, origin, limits and work.
void AddDescription(const ExportedPolicy& policy, const NetworkSizes& sizes, CParts& parts) {
  const Policy& learned = *policy.loaded->policy;
  parts.task = policy.task;
  parts.origin = Concat("It is the ", CommentText(Replaced(learned.description(), "→", "-")), "; ",
                        OriginOf(learned.info()));
  parts.limit = policy.limit;
  parts.period = *learned.info().control_period;
  parts.work = WorkOf(policy, sizes);
  parts.has_goal = policy.loaded->seeks_any_pose();
  if (!policy.loaded->identifies()) return;
  parts.code = "4 to 7 KB";
  parts.note =
      "Identification needs the torque that acted. If it is not the one that policy_control "
      "returned, write it to state.torque before the next call.";
}

/// Adds the tables with which extras/deploy/c/network.c computes.
void AddTables(const ExportedPolicy& policy, const std::vector<LayerView>& layers,
               const std::string& prefix, CParts& parts) {
  if (!policy.is_foreign()) AddPlant(*policy.loaded, parts);
  if (policy.is_discrete()) {
    parts.constants.push_back(
        {"torques", policy.is_foreign() ? "" : "N m", Floats(policy.torques())});
  }
  AddLayers(layers, prefix, parts);
}

/// A comment that lists the components of the observation.
std::string ObservationComment(const ExportedPolicy& policy) {
  std::string text = "/* of the observation:\n";
  int index = 0;
  for (const auto& [name, meaning] : policy.task.observation) {
    text += Concat("     ", index++, ": ", name, ": ", meaning, '\n');
  }
  return text + "*/";
}

/// The rule by which extras/deploy/c/network.c turns outputs into a torque.
const char* RuleLiteral(const ExportedPolicy& policy) {
  if (policy.is_discrete()) return "'l' /* the largest output's torque */";
  if (policy.rule().bound == &kSquash) return "'s' /* the mean, squashed */";
  return "'c' /* the mean, clipped */";
}

/// Adds the divisors of the double pendulum's observation, and the size of its memory.
void AddObservationScales(const LoadedPolicy& loaded, CParts& parts) {
  const ObservationInfo& observation = *loaded.policy->info().observation;
  const auto add = [&](const char* name, double scale, const char* comment) {
    parts.macros.emplace_back(name, CLiteral(static_cast<float>(scale)) + comment);
  };
  add("MAX_VELOCITY1", observation.max_velocity[0], " /* rad/s, divides w1 */");
  add("MAX_VELOCITY2", observation.max_velocity[1], " /* rad/s, divides w2 */");
  if (loaded.seeks_any_pose()) {
    const int at = kObservationSize + (loaded.identifies() ? kIdentifiedSize : 0);
    parts.macros.emplace_back("GOAL_SIZE", Concat(kGoalSize, " /* one number for each link */"));
    parts.macros.emplace_back("GOAL_AT", Concat(at, " /* place in the observation */"));
  }
  if (observation.memory || loaded.identifies()) parts.macros.emplace_back("HAS_PAST", "1");
  if (!observation.memory) return;
  const int memory = loaded.memory();
  add("MEMORY_VELOCITY", observation.memory->velocity, " /* rad/s, divides changes */");
  add("MEMORY_TORQUE", observation.memory->torque, " /* N m, divides torques */");
  parts.macros.emplace_back("MEMORY_SIZE",
                            Concat(kMemorySize * memory, " /* for ", memory, " past steps */"));
  parts.macros.emplace_back("MEMORY_AT", Concat(loaded.policy->obs_size() - kMemorySize * memory,
                                                " /* place in the observation */"));
}

void AddMacros(const ExportedPolicy& policy, const NetworkSizes& sizes, const CSamples& samples,
               CParts& parts) {
  const std::vector<std::pair<std::string, std::string>> macros{
      {"OBSERVATION_SIZE", Concat(policy.obs_size(), ' ', ObservationComment(policy))},
      {"OUTPUT_SIZE", Concat(sizes.outputs, " /* of the network */")},
      {"MULTIPLY_ADDS", Concat(sizes.multiply_adds, "L /* of a call */")},
      {"LAYERS", Concat(sizes.layers)},
      {"WIDEST_LAYER", Concat(sizes.widest)},
      {"RULE", RuleLiteral(policy)},
      {"STATE_SIZE", Concat(policy.state_size())},
      {"SAMPLES", Concat(samples.torques.size())},
      {"OUTPUT_TOLERANCE", CLiteral(samples.output_tolerance)},
      {"TORQUE_TOLERANCE", CLiteral(samples.torque_tolerance)}};
  parts.macros.insert(parts.macros.begin(), macros.begin(), macros.end());
  if (!policy.is_foreign()) AddObservationScales(*policy.loaded, parts);
}

CHeader NetworkHeaderOf(const LoadedPolicy& loaded, const std::string& prefix) {
  const ExportedPolicy policy = ViewForExport(loaded);
  if (policy.action_size() != 1) {
    throw BadInput(Concat(loaded.path, ": expected a policy of one number per action, got ",
                          policy.action_size(), "; --onnx exports it"));
  }
  const std::vector<LayerView> layers = LayersOf(policy);
  const CSamples samples = DrawSamples(policy, layers);
  const NetworkSizes sizes = SizesOf(policy, layers);
  CParts parts;
  AddDescription(policy, sizes, parts);
  AddTables(policy, layers, prefix, parts);
  AddMacros(policy, sizes, samples, parts);
  parts.samples = {{"sample_states", "", samples.states},
                   {"sample_outputs", "", samples.outputs},
                   {"sample_torques", policy.is_foreign() ? "" : "N m", samples.torques}};
  if (!samples.identified.empty()) {
    parts.samples.push_back({"sample_identified", "of the plant", samples.identified});
  }
  AddSizes(policy, sizes, parts);
  CHeader header;
  header.prefix = prefix;
  header.multiply_adds = sizes.multiply_adds;
  WriteHeader(parts, header);
  return header;
}

}  // namespace

CHeader CHeaderOf(const LoadedPolicy& loaded, const std::string& prefix) {
  if (prefix.size() > kLongestPrefix || AsPrefix(prefix) != prefix || prefix.empty()) {
    throw BadInput(
        Concat("--prefix: expected a lower-case letter, then lower-case letters, digits ",
               "and _, at most ", kLongestPrefix, " characters, got \"", prefix, "\""));
  }
  if (loaded.policy->num_parameters() > kMostParameters) {
    throw BadInput(Concat(loaded.path, ": expected at most ", kMostParameters,
                          " parameters, as larger headers compile slowly, got ",
                          loaded.policy->num_parameters()));
  }
  if (loaded.path.empty()) return ControllerHeaderOf(loaded, prefix);
  return NetworkHeaderOf(loaded, prefix);
}

std::string CPrefixOf(const std::string& file, const LoadedPolicy& loaded) {
  std::string prefix;
  if (!IsStandardStream(file)) prefix = AsPrefix(std::filesystem::path(file).stem().string());
  if (prefix.empty()) prefix = AsPrefix(loaded.policy->info().agent);
  return prefix.empty() ? "policy" : prefix;
}

}  // namespace upswing::deploy

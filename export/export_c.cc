#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/text.h"
#include "export/c_code.h"
#include "export/c_controller.h"
#include "export/c_samples.h"
#include "export/c_task.h"
#include "export/c_text.h"
#include "export/export.h"
#include "export/exported_policy.h"
#include "io/streams.h"

namespace upswing {
namespace {

constexpr size_t kMostParameters = 2'000'000;  // of which a header is some 23 MB
constexpr size_t kLongestPrefix = 32;
constexpr int kBlockRows = 8;  // see NAME_linear

/// The weights (out × in) in the order that NAME_linear reads: blocks of rows, each column by
/// column; then the rows that are left.
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

std::vector<float> Copy(std::span<const float> values) { return {values.begin(), values.end()}; }

/// The layers that a torque takes: of a dueling network without the value stream, which does not
/// change which torque is best; of a Gaussian with the mean alone.
std::vector<LayerView> LayersOf(const ExportedPolicy& policy) {
  std::vector<LayerView> layers = policy.ActingLayers();
  if (!policy.is_discrete()) layers.back() = layers.back().Units(0, 1);
  return layers;
}

/// The name of a layer in C.
std::string CName(std::string name) {
  for (char& c : name) c = c == '.' ? '_' : c;
  return name;
}

/// `text` as the beginning of C's names: small letters and digits, a letter first, with a _ in
/// place of anything else between them.
std::string AsPrefix(std::string_view text) {
  std::string prefix;
  for (const char c : text) {
    const bool is_capital = c >= 'A' && c <= 'Z';
    const char small = is_capital ? static_cast<char>(c - 'A' + 'a') : c;
    const bool is_letter = small >= 'a' && small <= 'z';
    if (is_letter || (small >= '0' && small <= '9')) {
      if (prefix.empty() && !is_letter) prefix = "policy_";
      prefix += small;
    } else if (!prefix.empty() && prefix.back() != '_') {
      prefix += '_';
    }
  }
  prefix.resize(std::min(prefix.size(), kLongestPrefix));
  while (prefix.ends_with('_')) prefix.pop_back();
  return prefix;
}

/// What the file says of where it is from.
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

/// A header while it is made.
class HeaderWriter {
 public:
  HeaderWriter(const LoadedPolicy& loaded, const std::string& prefix)
      : policy_(ViewForExport(loaded)),
        task_(CTaskOf(loaded)),
        layers_(LayersOf(policy_)),
        samples_(DrawSamples(policy_, layers_)) {
    header_.prefix = prefix;
    AddConstants();
  }

  CHeader Write() {
    CountWork();
    const std::string body = Concat(Declarations(), c_code::kNumbers, Constants(), Functions());
    header_.text =
        Replaced(Replaced(Concat(HeadComment(), body, "\n#endif\n"), "NAME_", header_.prefix + "_"),
                 "CAPS_", UpperCase(header_.prefix) + "_");
    return std::move(header_);
  }

 private:
  int num_outputs() const { return layers_.back().out(); }
  int memory() const { return policy_.loaded->memory(); }

  void AddConstants();
  void CountWork();
  std::string HeadComment() const;
  std::string Declarations() const;
  std::string Constants() const;
  std::string Functions() const;
  std::string OutputsFunction() const;
  std::string SelfTest() const;

  /// Names of the state in a list, such as "q1, q2", each after `before`.
  std::string StateNames(const std::string& before) const {
    std::vector<std::string> names;
    for (const NamedInput& input : task_.state) names.push_back(before + input.name);
    return Join(names, ", ");
  }

  const ExportedPolicy policy_;
  const CTask task_;
  const std::vector<LayerView> layers_;
  const CSamples samples_;
  std::vector<CArray> arrays_;
  CHeader header_;
};

void HeaderWriter::AddConstants() {
  arrays_ = task_.arrays;
  if (policy_.is_discrete()) {
    arrays_.push_back({"torques", "N m", {policy_.torques().begin(), policy_.torques().end()}});
  }
  for (const LayerView& layer : layers_) {
    const std::string name = CName(layer.name);
    arrays_.push_back({name + "_weight", Concat(layer.out(), " x ", layer.in()), InBlocks(layer)});
    arrays_.push_back({name + "_bias", "", Copy(layer.b)});
    if (!layer.layer_norm()) continue;
    arrays_.push_back({name + "_norm_weight", "", Copy(layer.gain)});
    arrays_.push_back({name + "_norm_bias", "", Copy(layer.norm_bias)});
  }
}

void HeaderWriter::CountWork() {
  constexpr size_t kFloat = 4;
  for (const CArray& array : arrays_) header_.constant_bytes += kFloat * array.values.size();
  header_.state_bytes = kFloat;  // the last torque
  if (memory() > 0) {
    header_.state_bytes += kFloat * (3 + kMemorySize * static_cast<size_t>(memory()));
  }
  size_t widest = 0;
  for (const LayerView& layer : layers_) {
    header_.multiply_adds += layer.W.size();
    widest = std::max(widest, static_cast<size_t>(layer.out()));
  }
  const auto obs_size = static_cast<size_t>(policy_.obs_size());
  header_.stack_bytes = kFloat * (obs_size + static_cast<size_t>(num_outputs()) + 2 * widest);
}

std::string HeaderWriter::HeadComment() const {
  const LoadedPolicy& loaded = *policy_.loaded;
  std::string states, plant;
  for (const auto& [name, meaning] : task_.state) {
    states += Concat(" *   ", name, std::string(8 - std::min(size_t{7}, name.size()), ' '), meaning,
                     '\n');
  }
  if (HasPlant(loaded.task)) {
    plant = PlantParagraph(loaded.plant, "by which it computes energy and height");
  }
  size_t tanhs = policy_.rule() == ActionRule::kSquashedGaussian ? 1 : 0;
  for (const LayerView& layer : layers_) {
    if (layer.activation == Activation::kTanh) tanhs += static_cast<size_t>(layer.out());
  }
  const std::string description = Replaced(loaded.policy->description(), "→", "-");
  return Filled(
      c_code::kHead,
      {{"goal", task_.goal},
       {"origin", Paragraph(Concat("It is the ", CommentText(description), "; ",
                                   OriginOf(loaded.policy->info()), ". Written by Upswing ",
                                   UPSWING_VERSION, '.'))},
       {"names", StateNames("")},
       {"states", states},
       {"motor", task_.motor},
       {"limit", FormatNumber(policy_.limit)},
       {"period", FormatNumber(policy_.spec.step_seconds)},
       {"plant", plant},
       {"needs", Paragraph(Concat(
                     "Flash: ", header_.constant_bytes,
                     " bytes of constants, 1 to 2 KB of code, and 1 KB of "
                     "samples where the self test is used. RAM: ",
                     header_.state_bytes, " bytes of state, and arrays of ", header_.stack_bytes,
                     " bytes on the stack in a call. Work of a call: ", header_.multiply_adds,
                     " multiply-adds, ", task_.sines, " sines and cosines",
                     tanhs > 0 ? Concat(", ", tanhs, " of tanh") : "", '.'))}});
}

std::string HeaderWriter::Declarations() const {
  std::string observation, memory_size;
  int index = 0;
  for (const auto& [name, meaning] : policy_.observation) {
    observation += Concat("     ", index++, ": ", name, ": ", meaning, '\n');
  }
  if (memory() > 0) {
    memory_size = Concat("#define CAPS_MEMORY_SIZE ", kMemorySize * memory(),
                         " /* of the observation, for ", memory(), " past steps */\n");
  }
  return Filled(
      Concat(c_code::kOpening, c_code::kSizes, c_code::kDeclarations, c_code::kObservation),
      {{"period", CLiteral(static_cast<float>(policy_.spec.step_seconds))},
       {"limit", CLiteral(static_cast<float>(policy_.limit))},
       {"inputs", Concat(policy_.obs_size())},
       {"outputs", Concat(num_outputs())},
       {"memory", memory_size},
       {"multiply_adds", Concat(header_.multiply_adds)},
       {"constant_bytes", Concat(header_.constant_bytes)},
       {"acted", memory() > 0 ? "; if another one acted, write that here" : ""},
       {"state", memory() > 0 ? c_code::kMemoryState : ""},
       {"observation", observation}});
}

std::string HeaderWriter::Constants() const {
  std::string text = "\n";
  for (const CArray& array : arrays_) text += ArrayText(array);
  return text;
}

std::string HeaderWriter::OutputsFunction() const {
  // Layers write into two buffers in turns, the last one into `outputs`.
  std::array<int, 2> sizes{};
  std::string calls, x = "observation";
  for (size_t i = 0; i < layers_.size(); ++i) {
    const LayerView& layer = layers_[i];
    const bool last = i + 1 == layers_.size();
    const std::string name = "NAME_" + CName(layer.name), y = last         ? "outputs"
                                                              : i % 2 == 0 ? "a"
                                                                           : "b";
    const auto call = [&](const char* function, const std::string& arguments) {
      calls += Concat("  NAME_", function, '(', arguments, ");\n");
    };
    if (!last) sizes[i % 2] = std::max(sizes[i % 2], layer.out());
    call("linear", Concat(name, "_weight, ", name, "_bias, ", layer.in(), ", ", layer.out(), ", ",
                          x, ", ", y));
    if (layer.layer_norm()) {
      call("layer_norm",
           Concat(name, "_norm_weight, ", name, "_norm_bias, ", layer.out(), ", ", y));
    }
    if (layer.activation == Activation::kRelu) call("relu", Concat(y, ", ", layer.out()));
    if (layer.activation == Activation::kTanh) call("tanh", Concat(y, ", ", layer.out()));
    x = y;
  }
  const std::string second = sizes[1] > 0 ? Concat(", b[", sizes[1], ']') : "";
  return Filled(c_code::kOutputs,
                {{"buffers", Concat("a[", sizes[0], ']', second)}, {"layers", calls}});
}

std::string HeaderWriter::SelfTest() const {
  const CChecksum checksum = ChecksumOf(arrays_);
  const std::string tables = Concat(ArrayText({"sample_states", StateNames(""), samples_.states}),
                                    ArrayText({"sample_outputs", "", samples_.outputs}),
                                    ArrayText({"sample_torques", "N m", samples_.torques}));
  std::vector<std::string> state;
  for (size_t i = 0; i < task_.state.size(); ++i) state.push_back(Concat("x[", i, ']'));
  return Filled(Concat(c_code::kChecksum, c_code::kSelfTest),
                {{"tables", tables},
                 {"state_size", Concat(task_.state.size())},
                 {"sums", checksum.lines},
                 {"checksum", Concat(checksum.sum, 'u')},
                 {"samples", Concat(samples_.count)},
                 {"sample", Join(state, ", ")},
                 {"output_tolerance", CLiteral(samples_.output_tolerance)},
                 {"torque_tolerance", CLiteral(samples_.torque_tolerance)}});
}

std::string HeaderWriter::Functions() const {
  bool norm = false, relu = false, tanh = false;
  for (const LayerView& layer : layers_) {
    norm = norm || layer.layer_norm();
    relu = relu || layer.activation == Activation::kRelu;
    tanh = tanh || layer.activation == Activation::kTanh;
  }
  const bool remembers = memory() > 0;
  const char* choose = policy_.is_discrete()                             ? c_code::kChooseLargest
                       : policy_.rule() == ActionRule::kSquashedGaussian ? c_code::kChooseSquashed
                                                                         : c_code::kChooseClipped;
  const std::string init =
      Filled(c_code::kInit, {{"index", remembers ? "  int i;\n" : ""},
                             {"forget", remembers ? c_code::kForgetMemory : ""}});
  const std::string observe = Filled(
      c_code::kObserve, {{"and_memory", remembers ? ", and of what the state remembers" : ""},
                         {"parameters", StateNames("float ")},
                         {"observe", task_.observe + (remembers ? "" : "  (void)state;\n")}});
  return Concat(
      c_code::kLinear, norm ? c_code::kLayerNorm : "", relu ? c_code::kRelu : "",
      tanh ? c_code::kTanh : "", OutputsFunction(), choose, init, observe,
      c_code::kControlObservation,
      Filled(c_code::kControl, {{"parameters", StateNames("float ")}, {"names", StateNames("")}}),
      SelfTest());
}

}  // namespace

CHeader CHeaderOf(const LoadedPolicy& loaded, const std::string& prefix) {
  if (prefix.size() > kLongestPrefix || AsPrefix(prefix) != prefix || prefix.empty()) {
    throw BadInput(Concat("prefix: expected small letters, digits and _, a letter first, at most ",
                          kLongestPrefix, " of them, got \"", prefix, "\""));
  }
  if (loaded.policy->num_parameters() > kMostParameters) {
    throw BadInput(Concat(loaded.path, ": expected at most ", kMostParameters,
                          " parameters, for a longer header takes compilers long, got ",
                          loaded.policy->num_parameters()));
  }
  if (loaded.path.empty()) return ControllerHeaderOf(loaded, prefix);
  return HeaderWriter(loaded, prefix).Write();
}

std::string CPrefixOf(const std::string& file, const LoadedPolicy& loaded) {
  std::string prefix;
  if (!IsStandardStream(file)) prefix = AsPrefix(std::filesystem::path(file).stem().string());
  if (prefix.empty()) prefix = AsPrefix(loaded.policy->info().agent);
  return prefix.empty() ? "policy" : prefix;
}

}  // namespace upswing

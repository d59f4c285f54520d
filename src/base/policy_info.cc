#include "base/policy_info.h"

#include "base/error.h"
#include "base/json.h"
#include "base/options.h"
#include "base/text.h"

namespace upswing {
namespace {

using nlohmann::json;

constexpr Range kCounter{0, 9e15};     // integers that a double holds exactly
constexpr Range kReturn{-1e60, 1e60};  // more than a sum of float32 rewards
constexpr Range kSeconds{1e-6, 1e3}, kScale{1e-6, 1e6};
constexpr size_t kMostInputs = 4096;
constexpr size_t kLongestName = 64;
constexpr int64_t kLongestMemory = 4096;  // steps; the network's inputs limit it further

std::vector<std::string> Texts(const json& object, const std::string& name) {
  std::vector<std::string> texts;
  for (const json& item : JsonList(object, name, kMostInputs)) {
    if (!item.is_string()) throw BadInput(Concat("\"", name, "\": expected a list of texts"));
    texts.push_back(item.get<std::string>());
  }
  return texts;
}

std::map<std::string, double> ParsePlant(const std::string& text) {
  std::map<std::string, double> plant;
  const json object = ParseJsonObject(text);
  for (const auto& [name, value] : object.items()) plant[name] = JsonNumber(object, name);
  return plant;
}

ObservationInfo ParseObservation(const std::string& text) {
  const json object = ParseJsonObject(text);
  ObservationInfo observation{Texts(object, "names"), {}};
  for (const json& item : JsonList(object, "max_velocity", 2)) {
    if (!item.is_number()) throw BadInput("\"max_velocity\": expected a list of numbers");
    observation.max_velocity.push_back(item.get<double>());
  }
  if (object.contains("identified")) {
    const json& identified = JsonMember(object, "identified");
    if (!identified.is_object()) throw BadInput("\"identified\": expected an object");
    observation.identified = {Texts(identified, "names"), JsonNumber(identified, "scale")};
  }
  if (object.contains("goal")) observation.goal = Texts(object, "goal");
  if (!object.contains("memory")) return observation;
  const json& memory = JsonMember(object, "memory");
  if (!memory.is_object()) throw BadInput("\"memory\": expected an object");
  observation.memory = {JsonInteger(memory, "steps", 1, kLongestMemory), Texts(memory, "names"),
                        JsonNumber(memory, "velocity"), JsonNumber(memory, "torque")};
  return observation;
}

std::string ObservationText(const ObservationInfo& observation) {
  json object{{"names", observation.names}, {"max_velocity", observation.max_velocity}};
  if (const auto& identified = observation.identified) {
    object["identified"] = {{"names", identified->names}, {"scale", identified->scale}};
  }
  if (!observation.goal.empty()) object["goal"] = observation.goal;
  if (const auto& memory = observation.memory) {
    object["memory"] = {{"steps", memory->steps},
                        {"names", memory->names},
                        {"velocity", memory->velocity},
                        {"torque", memory->torque}};
  }
  return object.dump();
}

/// Reads the metadata of a policy file, one entry at a time.
class Reader {
 public:
  Reader(const std::map<std::string, std::string>& metadata, const std::string& where)
      : metadata_(metadata), where_(where) {}

  /// The text of an entry; empty if the entry is missing.
  std::string Text(const std::string& key) const {
    const auto found = metadata_.find(key);
    return found == metadata_.end() ? "" : found->second;
  }

  /// A text of at most kLongestName characters on one line; empty if the entry is missing.
  std::string Name(const std::string& key) const {
    std::string name = Text(key);
    if (name.size() <= kLongestName && Printable(name) == name) return name;
    throw Wrong(key, Concat("at most ", kLongestName, " characters on one line"));
  }

  std::optional<double> Number(const std::string& key, Range range) const {
    if (!metadata_.contains(key)) return std::nullopt;
    const std::optional<double> number = ParseNumber(Text(key));
    if (number && range.Contains(*number)) return number;
    throw Wrong(
        key, Concat("a number in [", FormatNumber(range.low), ", ", FormatNumber(range.high), "]"));
  }

  std::optional<int64_t> Counter(const std::string& key) const {
    if (!metadata_.contains(key)) return std::nullopt;
    const std::optional<int64_t> count = ParseInteger(Text(key));
    if (count && kCounter.Contains(static_cast<double>(*count))) return count;
    throw Wrong(key, Concat("an integer in [0, ", FormatNumber(kCounter.high), "]"));
  }

  /// The JSON of an entry after `parse`; nothing if the entry is missing.
  template <typename Parse>
  auto Json(const std::string& key, const Parse& parse) const
      -> std::optional<decltype(parse(std::string()))> {
    if (!metadata_.contains(key)) return std::nullopt;
    try {
      return parse(Text(key));
    } catch (const Error& error) {
      throw BadInput(Concat(where_, ": metadata \"", key, "\": ", error.what()));
    }
  }

 private:
  Error Wrong(const std::string& key, std::string_view expected) const {
    return BadInput(Concat(where_, ": metadata \"", key, "\": expected ", expected, ", got \"",
                           Text(key), "\""));
  }

  const std::map<std::string, std::string>& metadata_;
  const std::string& where_;
};

}  // namespace

PolicyInfo ParsePolicyInfo(const std::map<std::string, std::string>& metadata,
                           const std::string& where) {
  const Reader reader(metadata, where);
  PolicyInfo info;
  info.agent = reader.Name("agent");
  info.upswing_version = reader.Name("upswing_version");
  info.config = reader.Text("config");
  info.seed = reader.Counter("seed");
  info.step = reader.Counter("step");
  info.success_rate = reader.Number("success_rate", kZeroToOne);
  info.mean_return = reader.Number("mean_return", kReturn);
  info.task = reader.Name("task");
  info.plant = reader.Json("plant", ParsePlant).value_or(info.plant);
  info.control_period = reader.Number("control_period", kSeconds);
  info.observation = reader.Json("observation", ParseObservation);
  info.time_scale = reader.Number("time_scale", kScale).value_or(1);
  info.torque_scale = reader.Number("torque_scale", kScale).value_or(1);
  info.gamma = reader.Number("gamma", kZeroToOne);
  info.reward_scale = reader.Number("reward_scale", kPositive);
  return info;
}

std::map<std::string, std::string> PolicyMetadata(const PolicyInfo& info) {
  std::map<std::string, std::string> metadata;
  const auto text = [&](const char* key, const std::string& value) {
    if (!value.empty()) metadata[key] = value;
  };
  const auto number = [&](const char* key, const auto& value) {
    if (value) metadata[key] = FormatNumber(static_cast<double>(*value));
  };
  text("agent", info.agent);
  text("upswing_version", info.upswing_version);
  text("config", info.config);
  number("seed", info.seed);
  number("step", info.step);
  number("success_rate", info.success_rate);
  number("mean_return", info.mean_return);
  text("task", info.task);
  if (!info.plant.empty()) metadata["plant"] = json(info.plant).dump();
  number("control_period", info.control_period);
  if (info.observation) metadata["observation"] = ObservationText(*info.observation);
  const auto scale = [&](const char* key, double value) {
    if (value != 1) metadata[key] = FormatNumber(value);
  };
  scale("time_scale", info.time_scale);
  scale("torque_scale", info.torque_scale);
  number("gamma", info.gamma);
  number("reward_scale", info.reward_scale);
  return metadata;
}

}  // namespace upswing

#include "runs/run_conditions.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/json.h"
#include "base/simd.h"
#include "base/text.h"
#include "os/file.h"
#include "os/host.h"
#include "runs/run_folder.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr size_t kMostConditions = 1000;
constexpr size_t kMostLogBytes = 1 << 22;  // no training writes a larger log

/// Adds the facts of one log line.
void AddFacts(const json& facts, RunConditions& conditions) {
  const auto add = [&](const char* name, std::set<std::string>& texts) {
    if (facts.contains(name) && facts[name].is_string()) texts.insert(facts[name]);
  };
  add("host", conditions.hosts);
  add("vectors", conditions.vectors);
  add("processor", conditions.processors);
  if (facts.contains("threads")) {
    if (const auto threads = JsonInteger(facts["threads"])) conditions.threads.insert(*threads);
  }
  constexpr double kLongEnough = 2;  // s; a share of a shorter time says little
  const auto number = [&](const char* name) {
    return facts.contains(name) && facts[name].is_number() ? facts[name].get<double>() : -1;
  };
  if (number("busy") >= 0 && number("seconds") >= kLongEnough) {
    conditions.busy = std::min(conditions.busy.value_or(1e9), number("busy"));
  }
}

}  // namespace

RunConditions RunConditions::Of(const fs::path& run) {
  try {
    return OfLog(ReadOwnFile(run / RunFolder::kLog, kMostLogBytes));
  } catch (const Error&) {
    return {};
  }
}

RunConditions RunConditions::OfLog(std::string_view text) {
  RunConditions conditions;
  for (std::string_view rest = text; !rest.empty();) {
    const std::string_view line = TakeLine(rest);
    const size_t begin = line.find('{');
    if (begin == std::string_view::npos) continue;
    try {
      AddFacts(ParseJsonObject(line.substr(begin)), conditions);
    } catch (const Error&) {  // NOLINT(bugprone-empty-catch): another line with a brace
    }
  }
  return conditions;
}

void RunConditions::AddTo(ordered_json& j) const {
  j["hosts"] = hosts;
  j["processors"] = processors;
  j["vectors"] = vectors;
  j["threads"] = threads;
  j["busy"] = busy ? ordered_json(*busy) : ordered_json();
}

RunConditions RunConditions::From(const json& j) {
  RunConditions conditions;
  for (const json& value : JsonList(j, "threads", kMostConditions)) {
    if (const auto threads = JsonInteger(value)) conditions.threads.insert(*threads);
  }
  for (const auto& [name, set] : {std::pair("hosts", &conditions.hosts),
                                  {"vectors", &conditions.vectors},
                                  {"processors", &conditions.processors}}) {
    for (const json& value : JsonList(j, name, kMostConditions)) {
      if (value.is_string()) set->insert(value.get<std::string>());
    }
  }
  if (JsonMember(j, "busy").is_number()) conditions.busy = JsonNumber(j, "busy");
  return conditions;
}

std::string BeginFacts(int threads, const std::string& version) {
  return ordered_json{{"host", HostName()},
                      {"vectors", SimdPath()},
                      {"threads", threads},
                      {"processor", CpuModel()},
                      {"version", version}}
      .dump(-1, ' ', true, ordered_json::error_handler_t::replace);
}

std::string EndFacts(double seconds, double busy) {
  return ordered_json{{"seconds", std::round(seconds * 10) / 10},
                      {"busy", std::round(busy * 100) / 100}}
      .dump();
}

}  // namespace upswing

#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>

namespace upswing {

/// The machine of a run and its share of it: what its times depend on. Sets, because a run may have
/// been resumed on another machine. Empty of runs of 0.4.0, whose log has no facts.
struct RunConditions {
  std::set<int64_t> threads;
  std::set<std::string> hosts, vectors, processors;  // vectors: instructions in use
  std::optional<double> busy;  // the least share of the time that its threads were at work

  /// Reads the facts of all log.txt lines of a run; empty where none can be read.
  static RunConditions Of(const std::filesystem::path& run);

  /// Adds the conditions to a result file, or reads them from one. Throws BadInput.
  void AddTo(nlohmann::ordered_json& j) const;
  static RunConditions From(const nlohmann::json& j);
};

/// The facts at the end of the log line with which a training begins or is resumed: this machine,
/// the number of threads and the version, as JSON.
std::string BeginFacts(int threads, const std::string& version);

/// The facts at the end of its last line: for how many seconds it trained, and with which share of
/// them its threads were at work.
std::string EndFacts(double seconds, double busy);

}  // namespace upswing

#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>

namespace upswing {

/// The machine of a run and the run's share of it, which its times depend on. The members are sets,
/// because a run can resume on another machine. They are empty for runs of 0.4.0, whose logs have
/// no facts.
struct RunConditions {
  std::set<int64_t> threads;
  std::set<std::string> hosts, vectors, processors;  // vectors: instruction sets in use
  std::optional<double> busy;  // smallest share of the time in which its threads worked

  /// Reads the facts from all lines of a run's log.txt; empty if that fails.
  static RunConditions Of(const std::filesystem::path& run);
  /// Reads the facts from the text of such a log.
  static RunConditions OfLog(std::string_view text);

  /// AddTo adds the conditions to a result file. From reads them from one and throws BadInput.
  void AddTo(nlohmann::ordered_json& j) const;
  static RunConditions From(const nlohmann::json& j);
};

/// Facts, as JSON, for the log line with which a training begins or resumes: this machine, number
/// of threads, and version.
std::string BeginFacts(int threads, const std::string& version);

/// Facts for the last log line of a training: its seconds, and the share of that time in which its
/// threads worked.
std::string EndFacts(double seconds, double busy);

}  // namespace upswing

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/text.h"
#include "export/export.h"
#include "io/file.h"
#include "io/run_folder.h"
#include "report/runs.h"
#include "run/find_policy.h"
#include "run/train_command.h"
#include "setup/config.h"
#include "setup/loaded_policy.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// A policy on its way into the page.
struct PageAgent {
  std::string id;
  fs::path from;
  std::vector<std::byte> bytes;  // of the policy file
  ordered_json entry;            // in agents.json
  std::vector<Checkpoint> checkpoints;

  std::string FileOf(const Checkpoint& checkpoint) const {
    return Concat(id, "-at-", checkpoint.step, ".safetensors");
  }
};

/// `name` in small letters and digits, with a - in place of anything else between them.
std::string CleanId(std::string_view name) {
  std::string id;
  for (const char c : name) {
    const bool is_capital = c >= 'A' && c <= 'Z';
    const char small = is_capital ? static_cast<char>(c - 'A' + 'a') : c;
    const bool fits = (small >= 'a' && small <= 'z') || (small >= '0' && small <= '9');
    if (fits) id += small;
    if (!fits && !id.empty() && id.back() != '-') id += '-';
  }
  while (id.ends_with('-')) id.pop_back();
  return id;
}

/// The run folder that a policy lies in; empty if it lies elsewhere.
fs::path RunOf(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : ".";
  const bool is_run =
      file.filename() == RunFolder::kPolicy && fs::exists(folder / RunFolder::kConfig);
  if (!is_run) return {};
  const bool has_name = folder.filename() != "." && folder.filename() != "..";
  return has_name ? folder : fs::canonical(folder);
}

/// What the page needs to know of a policy, as its list has it. Throws BadInput.
ordered_json EntryOf(const LoadedPolicy& loaded, const std::string& id) {
  const PolicyInfo& info = loaded.policy->info();
  const auto need = [&](bool there, const char* key) {
    if (!there) throw BadInput(Concat(loaded.path, ": no metadata \"", key, "\""));
  };
  need(!info.agent.empty(), "agent");
  need(info.seed.has_value(), "seed");
  need(info.success_rate.has_value(), "success_rate");
  need(info.mean_return.has_value(), "mean_return");
  need(info.step.has_value(), "step");
  need(!info.upswing_version.empty(), "upswing_version");
  return {{"id", id},
          {"file", id + ".safetensors"},
          {"agent", info.agent},
          {"seed", *info.seed},
          {"parameters", loaded.policy->num_parameters()},
          {"success_rate", *info.success_rate},
          {"mean_return", *info.mean_return},
          {"step", *info.step},
          {"upswing_version", info.upswing_version}};
}

/// The evaluations of a run as columns.
ordered_json CurveJson(const std::vector<EvaluationRow>& evaluations) {
  ordered_json curve;
  for (const EvaluationRow& row : evaluations) {
    curve["step"].push_back(row.step);
    curve["success_rate"].push_back(row.success_rate);
    curve["mean_return"].push_back(row.mean_return);
  }
  return curve;
}

void AddCheckpoints(PageAgent& agent, const LoadedPolicy& loaded, int64_t count) {
  agent.checkpoints = CheckpointsOf(loaded, count);
  ordered_json& list = agent.entry["checkpoints"];
  for (const Checkpoint& checkpoint : agent.checkpoints) {
    list.push_back({{"step", checkpoint.step}, {"file", agent.FileOf(checkpoint)}});
  }
  list.push_back({{"step", agent.entry["step"]}, {"file", agent.entry["file"]}});
}

PageAgent ReadAgent(const fs::path& path, const std::string& given_id, int64_t checkpoints) {
  const LoadedPolicy loaded = LoadPolicy(path);
  const std::string where = loaded.path;
  if (!HasPlant(loaded.task)) {
    throw BadInput(Concat(where,
                          ": expected a policy of the double pendulum, which is what the page ",
                          "shows, got one of ", loaded.task));
  }
  if (!loaded.mjcf.empty()) {
    throw BadInput(Concat(where,
                          ": was made with a model of its own, and the page shows the "
                          "built-in one alone"));
  }
  if (loaded.plant.actuated_joint != 1) {
    throw BadInput(Concat(where,
                          ": expected a policy for a motor at joint 1, as the page's pendulum has "
                          "it, got one for joint 2"));
  }
  if (loaded.plant.rotor_inertia != 0 || loaded.plant.has_dry_friction()) {
    throw BadInput(Concat(where,
                          ": expected a policy for a plant without rotors and dry friction, which "
                          "the page's pendulum does not have"));
  }
  const fs::path run = RunOf(loaded.path);
  std::string id = CleanId(run.filename().string());
  if (id.empty()) id = CleanId(loaded.policy->info().agent);
  if (!given_id.empty()) id = given_id;
  if (id.empty()) throw BadInput(Concat(where, ": names no agent; expected --id"));

  PageAgent agent{id, path, ReadFile(loaded.path), EntryOf(loaded, id), {}};
  const std::optional<std::string> command = TrainCommand(loaded.policy->info(), where);
  if (command) agent.entry["command"] = *command;
  if (checkpoints > 0) AddCheckpoints(agent, loaded, checkpoints);
  if (run.empty()) return agent;
  const std::vector<EvaluationRow> evaluations = ReadEvaluations(run, true);
  if (!evaluations.empty()) agent.entry["curve"] = CurveJson(evaluations);
  return agent;
}

std::vector<PageAgent> ReadAgents(const std::vector<fs::path>& paths, const std::string& id,
                                  int64_t checkpoints) {
  if (!id.empty() && paths.size() > 1) {
    throw BadInput(Concat("--id: expected a single policy, got ", paths.size()));
  }
  if (!id.empty() && CleanId(id) != id) {
    throw BadInput(
        Concat("--id: expected small letters, digits and - between them, got \"", id, "\""));
  }
  std::vector<PageAgent> agents;
  for (const fs::path& path : paths) {
    PageAgent agent = ReadAgent(path, id, checkpoints);
    const auto same = std::ranges::find(agents, agent.id, &PageAgent::id);
    if (same != agents.end()) {
      throw BadInput(Concat(path.string(), ": would be \"", agent.id, "\" in the page, as ",
                            same->from.string(),
                            " would; expected different names (--id gives "
                            "one)"));
    }
    agents.push_back(std::move(agent));
  }
  return agents;
}

/// What is in the page so far. Throws BadInput if it is no list of agents.
ordered_json ReadIndex(const fs::path& file) {
  if (!fs::exists(file)) return {{"agents", ordered_json::array()}};
  try {
    ordered_json index = ordered_json::parse(ReadOwnFile(file));
    for (const ordered_json& entry : index.at("agents").get_ref<const ordered_json::array_t&>()) {
      (void)entry.at("id").get_ref<const std::string&>();
    }
    return index;
  } catch (const ordered_json::exception& error) {
    throw BadInput(Concat(file.string(), ": expected a list of agents: ", error.what()));
  }
}

void AddEntry(ordered_json& index, const PageAgent& agent) {
  ordered_json& entries = index["agents"];
  const auto same = std::ranges::find_if(
      entries, [&](const ordered_json& entry) { return entry["id"] == agent.id; });
  if (same != entries.end()) {
    *same = agent.entry;
  } else {
    entries.push_back(agent.entry);
  }
}

}  // namespace

std::vector<std::string> ExportToPage(const std::vector<fs::path>& paths, const std::string& id,
                                      int64_t checkpoints, const fs::path& folder) {
  const std::vector<PageAgent> agents = ReadAgents(paths, id, checkpoints);
  if (fs::exists(folder) && !fs::is_directory(folder)) {
    throw BadInput(Concat(folder.string(), ": expected a folder, got a file"));
  }
  const fs::path index_file = folder / "agents.json";
  (void)ReadIndex(index_file);  // before anything is written
  MakeFolder(folder);

  const FolderLock lock(folder);  // two at a time would lose entries of each other
  ordered_json index = ReadIndex(index_file);
  std::vector<std::string> names;
  const auto write = [&](const std::string& name, std::span<const std::byte> bytes) {
    WriteFileAtomically(folder / name, {&bytes, 1});
    names.push_back(name);
  };
  for (const PageAgent& agent : agents) {
    write(agent.id + ".safetensors", agent.bytes);
    for (const Checkpoint& one : agent.checkpoints) write(agent.FileOf(one), one.bytes);
    AddEntry(index, agent);
  }
  WriteFileAtomically(index_file, index.dump(1) + '\n');
  return names;
}

}  // namespace upswing

#include <algorithm>
#include <nlohmann/json.hpp>

#include "agents/config.h"
#include "agents/loaded_policy.h"
#include "agents/training.h"
#include "base/error.h"
#include "base/json.h"
#include "base/safetensors.h"
#include "base/text.h"
#include "extras/deploy/c_text.h"
#include "extras/deploy/export.h"
#include "nn/network_policy.h"
#include "os/file.h"
#include "os/host.h"
#include "os/lock.h"
#include "runs/config_files.h"
#include "runs/find_policy.h"
#include "runs/run_folder.h"
#include "runs/run_record.h"
#include "runs/tensor_file.h"
#include "runs/this_host.h"

namespace upswing::deploy {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// An earlier version of a policy, as a file.
struct Checkpoint {
  int64_t step = 0;
  std::vector<std::byte> bytes;
};

/// A policy to be added to the page.
struct PageAgent {
  std::string id;
  std::string from;              // path of the policy or its run
  std::vector<std::byte> bytes;  // the policy file
  ordered_json entry;            // for agents.json
  std::vector<Checkpoint> checkpoints;

  std::string FileOf(const Checkpoint& checkpoint) const {
    return Concat(id, "-at-", checkpoint.step, ".safetensors");
  }
};

/// The run folder of a policy; empty if the policy is in no run folder.
fs::path RunOf(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : ".";
  const bool is_run =
      file.filename() == RunFolder::kPolicy && fs::exists(folder / RunFolder::kConfig);
  if (!is_run) return {};
  const bool has_name = folder.filename() != "." && folder.filename() != "..";
  return has_name ? folder : fs::canonical(folder);
}

/// The page's list entry for a policy. Throws BadInput.
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

/// The current policy as a small file.
std::vector<std::byte> SmallFile(const Training& training, const std::string& where) {
  const std::unique_ptr<Policy> policy = training.policy();
  const auto* q = dynamic_cast<const NetworkPolicy*>(policy.get());
  if (q == nullptr || q->is_actor()) {
    throw BadInput(Concat(where, ": --checkpoints: expected a Q-network, got ", policy->kind()));
  }
  Tensors file = q->Rounded().ToTensors();
  file.Narrow();
  return WriteSafetensors(file).Joined();
}

/// Whether two policies have the same tensors.
bool SameTensors(const Policy& a, const Policy& b) {
  const Tensors first = a.ToTensors(), second = b.ToTensors();
  return std::ranges::equal(first.all(), second.all(), [](const auto& one, const auto& other) {
    return one.first == other.first && std::ranges::equal(one.second.bytes, other.second.bytes);
  });
}

/// Repeats the training of a learned policy with the settings in its file. Returns
/// `count` - 1 earlier versions: the untrained one, then evenly spaced evaluations. Parameters are
/// rounded to bfloat16, which halves the file. Throws BadInput if the policy is not a Q-network or
/// there are fewer evaluations. Also throws it if the repeated training ends differently, as on a
/// processor with other vector instructions.
std::vector<Checkpoint> CheckpointsOf(const LoadedPolicy& loaded, int64_t count) {
  const std::string where = loaded.path;
  const PolicyInfo& info = loaded.policy->info();
  const int64_t end = info.step.value_or(0);
  Config config = ConfigIn(info.config, Concat(where, ": metadata \"config\""));
  config.train.steps = std::max<int64_t>(1, end);
  config.train.stop_when_solved = false;  // the training may have continued past the solution
  Training training(config, ThisHost(ResolveThreads(0)));

  // Keep all versions first: their number is known only at the end.
  std::vector<Checkpoint> all{{0, SmallFile(training, where)}};
  while (training.state().steps < end && training.Step()) {
    if (training.state().steps < end && training.trainer().IsDue(config.train.eval_every)) {
      all.push_back({training.state().steps, SmallFile(training, where)});
    }
  }
  if (!SameTensors(*training.policy(), *loaded.policy)) {
    throw BadInput(Concat(where,
                          ": --checkpoints: expected the same policy from training it again, got "
                          "another; the file has to come from this version of Upswing and from a "
                          "processor with the same vector instructions"));
  }
  const auto most = static_cast<int64_t>(all.size());
  if (count - 1 > most) {
    throw BadInput(Concat("--checkpoints: expected at most ", most + 1, ", the evaluations of ",
                          where, " and the untrained policy, got ", count));
  }
  std::vector<Checkpoint> chosen;
  for (int64_t i = 0; i < count - 1; ++i) {
    chosen.push_back(std::move(all[static_cast<size_t>(i * most / (count - 1))]));
  }
  return chosen;
}

void AddCheckpoints(PageAgent& agent, const LoadedPolicy& loaded, int64_t count) {
  agent.checkpoints = CheckpointsOf(loaded, count);
  ordered_json& list = agent.entry["checkpoints"];
  for (const Checkpoint& checkpoint : agent.checkpoints) {
    list.push_back({{"step", checkpoint.step}, {"file", agent.FileOf(checkpoint)}});
  }
  list.push_back({{"step", agent.entry["step"]}, {"file", agent.entry["file"]}});
}

PageAgent ReadAgent(const std::string& path, const std::string& given_id, int64_t checkpoints) {
  const LoadedPolicy loaded = LoadPolicy(path);
  const std::string where = loaded.path;
  ExpectPendulum(loaded);
  if (loaded.plant.actuated_joint != 1) {
    throw BadInput(Concat(where,
                          ": expected a policy for a motor at joint 1, as in the page, got one for "
                          "joint 2"));
  }
  if (loaded.plant.rotor_inertia != 0 || loaded.plant.has_dry_friction() ||
      loaded.plant.has_own_links() || loaded.plant.armature != kArmature ||
      loaded.plant.own_armature1() != kArmature) {
    throw BadInput(
        Concat(where, ": expected a policy for a plant as in the page, without rotors ",
               "and dry friction, with links that are solid capsules and an armature of ",
               kArmature, " kg·m², got another plant"));
  }
  if (loaded.control_period() != kControlPeriod || loaded.scale() != Scale()) {
    throw BadInput(Concat(where, ": expected a policy that decides every ", kControlPeriod,
                          " s, for a plant of about the page's size, got another"));
  }
  const fs::path run = RunOf(loaded.path);
  std::string id = given_id.empty() ? Cleaned(run.filename().string(), '-') : given_id;
  if (id.empty()) id = Cleaned(loaded.policy->info().agent, '-');
  if (id.empty()) {
    throw BadInput(
        Concat(where, ": expected metadata \"agent\" or --id for the ID in the page, got neither"));
  }

  PageAgent agent{id, path, ReadOwnBytes(loaded.path, kMostPolicyBytes), EntryOf(loaded, id), {}};
  const std::optional<std::string> command = TrainCommand(loaded.policy->info(), where);
  if (command) agent.entry["command"] = *command;
  if (checkpoints > 0) AddCheckpoints(agent, loaded, checkpoints);
  if (run.empty()) return agent;
  const std::vector<EvaluationRow> evaluations = ReadEvaluations(run, true);
  if (!evaluations.empty()) agent.entry["curve"] = CurveJson(evaluations);
  return agent;
}

std::vector<PageAgent> ReadAgents(const std::vector<std::string>& paths, const std::string& id,
                                  int64_t checkpoints) {
  if (!id.empty() && paths.size() > 1) {
    throw BadInput(Concat("--id: expected a single policy, got ", paths.size()));
  }
  if (!id.empty() && Cleaned(id, '-') != id) {
    throw BadInput(
        Concat("--id: expected lower-case letters, digits and - between them, got \"", id, "\""));
  }
  std::vector<PageAgent> agents;
  for (const std::string& path : paths) {
    PageAgent agent = ReadAgent(path, id, checkpoints);
    const auto same = std::ranges::find(agents, agent.id, &PageAgent::id);
    if (same != agents.end()) {
      throw BadInput(Concat(path, ": expected a different ID than ", same->from, ", got \"",
                            agent.id, "\" for both; --id sets one"));
    }
    agents.push_back(std::move(agent));
  }
  return agents;
}

/// The page's present list. Throws BadInput.
ordered_json ReadIndex(const fs::path& file) {
  if (!fs::exists(file)) return {{"agents", ordered_json::array()}};
  return ParsePageIndex(ReadOwnFile(file), file.string());
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

ordered_json ParsePageIndex(std::string_view text, const std::string& where) {
  try {
    constexpr int kMostDepth = 8;
    (void)ParseJsonObject(text, kMostDepth);  // its limits protect the stack and the memory
    ordered_json index = ordered_json::parse(text);
    for (const ordered_json& entry : index.at("agents").get_ref<const ordered_json::array_t&>()) {
      (void)entry.at("id").get_ref<const std::string&>();
    }
    return index;
  } catch (const std::exception& error) {
    throw BadInput(Concat(where, ": expected a list of agents: ", error.what()));
  }
}

std::vector<std::string> ExportToPage(const std::vector<std::string>& paths, const std::string& id,
                                      int64_t checkpoints, const fs::path& folder) {
  const std::vector<PageAgent> agents = ReadAgents(paths, id, checkpoints);
  if (fs::exists(folder) && !fs::is_directory(folder)) {
    throw BadInput(Concat(folder.string(), ": expected a folder, got a file"));
  }
  const fs::path index_file = folder / "agents.json";
  (void)ReadIndex(index_file);  // check before writing anything
  NewFolder made(folder);
  const FolderLock lock(folder);  // concurrent exports would lose entries
  made.Keep();
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

}  // namespace upswing::deploy

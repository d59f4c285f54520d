#include "run/run_result.h"

#include "core/error.h"
#include "core/json.h"
#include "core/text.h"
#include "io/file.h"
#include "io/run_folder.h"
#include "io/tensor_file.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr size_t kMostBytes = 1 << 26;  // of the file; an evaluation takes some 150
constexpr size_t kMostConditions = 1000;
constexpr int64_t kMost = int64_t{1} << 62;

RunResult Parse(const json& j) {
  RunResult r;
  r.steps = JsonInteger(j, "steps", 0, kMost);
  r.episodes = JsonInteger(j, "episodes", 0, kMost);
  r.seconds = JsonNumber(j, "seconds");
  r.solved = JsonBool(j, "solved");
  r.solved_step = JsonInteger(j, "solved_step", 0, kMost);
  r.solved_seconds = JsonNumber(j, "solved_seconds");
  r.best_step = JsonInteger(j, "best_step", 0, kMost);
  r.best_success_rate = JsonNumber(j, "best_success_rate");
  r.best_return = JsonNumber(j, "best_return");
  r.settings = JsonText(j, "settings");
  r.planned_steps = JsonInteger(j, "planned_steps", 0, kMost);
  r.stop_when_solved = JsonBool(j, "stop_when_solved");
  r.version = JsonText(j, "version");
  for (const json& value : JsonList(j, "threads", kMostConditions)) {
    if (const auto threads = JsonInteger(value)) r.conditions.threads.insert(*threads);
  }
  for (const auto& [name, set] : {std::pair("hosts", &r.conditions.hosts),
                                  {"vectors", &r.conditions.vectors},
                                  {"processors", &r.conditions.processors}}) {
    for (const json& value : JsonList(j, name, kMostConditions)) {
      if (value.is_string()) set->insert(value.get<std::string>());
    }
  }
  if (JsonMember(j, "busy").is_number()) r.conditions.busy = JsonNumber(j, "busy");
  r.evaluations = JsonText(j, "evaluations");
  return r;
}

}  // namespace

bool RunResult::Finished(const TrainConfig& config) const {
  return steps >= config.steps || (solved && config.stop_when_solved);
}

RunResult ResultOf(const TrainState& state) {
  RunResult r;
  r.steps = state.steps;
  r.episodes = state.episodes;
  r.seconds = state.seconds;
  r.solved = state.solved;
  if (r.solved) {
    r.solved_step = state.streak_step;
    r.solved_seconds = state.streak_seconds;
  }
  r.best_step = state.best_step;
  if (r.best_step > 0) {
    r.best_success_rate = state.best_success_rate;
    r.best_return = state.best_return;
  }
  return r;
}

std::optional<RunResult> ReadCheckpointResult(const fs::path& run, const EnvSpec& spec) {
  if (!fs::exists(run / RunFolder::kConfig)) return std::nullopt;
  const Tensors checkpoint = LoadPartOfTensors(RunFolder::CheckpointPath(run), "train/");
  TrainState state(spec.num_envs, static_cast<int>(spec.term_names.size()));
  state.State(Archive::Loader(checkpoint).In("train"));
  return ResultOf(state);
}

void WriteDone(const fs::path& path, const RunResult& r) {
  ordered_json j{{"settings", r.settings},
                 {"planned_steps", r.planned_steps},
                 {"stop_when_solved", r.stop_when_solved},
                 {"version", r.version},
                 {"hosts", r.conditions.hosts},
                 {"processors", r.conditions.processors},
                 {"vectors", r.conditions.vectors},
                 {"threads", r.conditions.threads},
                 {"busy", r.conditions.busy ? ordered_json(*r.conditions.busy) : nullptr},
                 {"steps", r.steps},
                 {"episodes", r.episodes},
                 {"seconds", r.seconds},
                 {"solved", r.solved},
                 {"solved_step", r.solved_step},
                 {"solved_seconds", r.solved_seconds},
                 {"best_step", r.best_step},
                 {"best_success_rate", r.best_success_rate},
                 {"best_return", r.best_return},
                 {"evaluations", r.evaluations}};
  WriteFileAtomically(path, PrintableJson(j));
}

std::optional<RunResult> ReadDone(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(path, error))) return std::nullopt;
  try {
    return Parse(ParseJsonObject(ReadOwnFile(path, kMostBytes)));
  } catch (const Error& broken) {
    const std::string_view what = broken.what();
    if (what.starts_with(path.string())) throw;
    throw BadInput(Concat(path.string(), ": ", what));
  }
}

}  // namespace upswing

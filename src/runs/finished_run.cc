#include "runs/finished_run.h"

#include "base/error.h"
#include "base/json.h"
#include "base/text.h"
#include "os/file.h"
#include "runs/run_folder.h"
#include "runs/tensor_file.h"

namespace upswing {

namespace fs = std::filesystem;

FinishedRun FinishedRun::Parse(std::string_view text) {
  constexpr int64_t kMost = int64_t{1} << 62;
  const nlohmann::json j = ParseJsonObject(text);
  FinishedRun run;
  TrainState& s = run.state;
  s.steps = JsonInteger(j, "steps", 0, kMost);
  s.episodes = JsonInteger(j, "episodes", 0, kMost);
  s.seconds = JsonNumber(j, "seconds");
  s.solved = JsonBool(j, "solved");
  s.streak_step = JsonInteger(j, "solved_step", 0, kMost);
  s.streak_seconds = JsonNumber(j, "solved_seconds");
  s.best_step = JsonInteger(j, "best_step", 0, kMost);
  s.best_success_rate = JsonNumber(j, "best_success_rate");
  s.best_return = JsonNumber(j, "best_return");
  run.settings = JsonText(j, "settings");
  run.planned_steps = JsonInteger(j, "planned_steps", 0, kMost);
  run.stop_when_solved = JsonBool(j, "stop_when_solved");
  run.version = JsonText(j, "version");
  run.conditions = RunConditions::From(j);
  run.evaluations = JsonText(j, "evaluations");
  return run;
}

void FinishedRun::Write(const fs::path& path) const {
  const TrainState& s = state;
  nlohmann::ordered_json j{{"settings", settings},
                           {"planned_steps", planned_steps},
                           {"stop_when_solved", stop_when_solved},
                           {"version", version}};
  conditions.AddTo(j);
  j.update({{"steps", s.steps},
            {"episodes", s.episodes},
            {"seconds", s.seconds},
            {"solved", s.solved},
            {"solved_step", s.solved ? s.streak_step : 0},
            {"solved_seconds", s.solved ? s.streak_seconds : 0},
            {"best_step", s.best_step},
            {"best_success_rate", s.best_step > 0 ? s.best_success_rate : 0},
            {"best_return", s.best_return},
            {"evaluations", evaluations}});
  WriteFileAtomically(path, PrintableJson(j));
}

std::optional<FinishedRun> FinishedRun::Read(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(path, error))) return std::nullopt;
  try {
    return Parse(ReadOwnFile(path));
  } catch (const Error& broken) {
    const std::string_view what = broken.what();
    if (what.starts_with(path.string())) throw;
    throw BadInput(Concat(path.string(), ": ", what));
  }
}

std::optional<TrainState> ReadTrainState(const fs::path& run, const EnvSpec& spec) {
  if (!fs::exists(run / RunFolder::kConfig)) return std::nullopt;
  const Tensors checkpoint = LoadPartOfTensors(run / RunFolder::kCheckpoint, "train/");
  TrainState state(spec.num_envs, static_cast<int>(spec.term_names.size()));
  state.State(Archive::Loader(checkpoint).In("train"));
  return state;
}

}  // namespace upswing

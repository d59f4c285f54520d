#include "runs/run_folder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/archive.h"
#include "base/error.h"
#include "base/text.h"
#include "runs/event_file.h"
#include "runs/tensor_file.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEventsName = "events.out.tfevents.0.upswing";
constexpr int64_t kLargestTable = int64_t{1} << 60;

// Names of the sizes in the checkpoint of the files that grow during a run.
constexpr std::array kSizes{"run/size/metrics", "run/size/episodes", "run/size/evals",
                            "run/size/events"};

/// The size of a file in the checkpoint. Throws BadInput if the file is shorter.
int64_t KnownSize(const Tensors& checkpoint, const char* name, const AppendFile& file) {
  int64_t known = 0;
  Archive::Loader(checkpoint).Scalar(name, known, {0, kLargestTable});
  if (file.size() >= known) return known;
  throw BadInput(Concat(file.path().string(), ": expected at least the ", known,
                        " bytes that its checkpoint records, got ", file.size()));
}

/// `path` without trailing slashes.
fs::path WithoutSlash(fs::path path) {
  while (!path.has_filename() && path.has_relative_path()) path = path.parent_path();
  return path;
}

/// Final path of a new run folder: `path` with its links resolved. Throws BadInput if something is
/// already there, or if the folder cannot be put there in one piece.
fs::path FreePlace(const fs::path& path) {
  std::error_code error;
  const bool is_run = fs::exists(path / RunFolder::kConfig, error);
  CheckFree(path, Concat(is_run ? Concat("resume it with --resume ", path.string(), ", or ") : "",
                         "choose another --out"));
  if (!fs::exists(path, error)) return path;
  // A process that works in an empty folder would not notice its replacement.
  if (fs::equivalent(path, fs::current_path(error), error)) {
    throw BadInput(Concat(path.string(), ": expected a new folder, got the current one (choose ",
                          "another --out)"));
  }
  return fs::canonical(path);
}

}  // namespace

FolderLock RunFolder::Create(const fs::path& given, const std::string& config,
                             Tensors& checkpoint) {
  const fs::path path = WithoutSlash(given);
  const fs::path place = FreePlace(path);
  try {
    NewFolder parent(place.has_parent_path() ? place.parent_path() : ".");
    Making folder(place, Making::Kind::kFolder);
    FolderLock lock(folder);
    WriteFileAtomically(folder.path() / kConfig, config);
    for (const char* size : kSizes) checkpoint.AddScalar(size, int64_t{0});
    SaveTensors(checkpoint, folder.path() / kCheckpoint);
    folder.Publish();
    parent.Keep();
    return lock;
  } catch (const NoLocks&) {
    throw;
  } catch (const Error& failure) {
    throw Error(failure.exit_code(),
                Concat("cannot make the run folder ", path.string(), ": ", failure.what()));
  }
}

std::vector<fs::path> RunFolder::Files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code none;
  for (const char* name :
       {kConfig, kMetrics, kEpisodes, kEvaluations, kEventsName, kCheckpoint, kPolicy, kLog}) {
    if (fs::exists(folder / name, none)) files.push_back(folder / name);
  }
  return files;
}

RunFolder::RunFolder(fs::path path, const Tensors& checkpoint)
    : path_(std::move(path)),
      metrics_{"train/", AppendFile(path_ / kMetrics), {}},
      episodes_{"episode/", AppendFile(path_ / kEpisodes), {}},
      evals_{"evaluation/", AppendFile(path_ / kEvaluations), {}},
      events_(path_ / kEventsName),
      log_(path_ / kLog) {
  // Check all sizes before any file is cut.
  std::array<int64_t, kSizes.size()> known{};
  for (size_t i = 0; i < known.size(); ++i) {
    known.at(i) = KnownSize(checkpoint, kSizes.at(i), *Growing().at(i));
  }
  for (size_t i = 0; i < known.size(); ++i) Growing().at(i)->CutTo(known.at(i));
}

RunFolder::~RunFolder() {
  try {
    episodes_.Flush();
  } catch (const Error&) {  // full disk; the training has already reported it
  }
}

void RunFolder::Table::Flush() {
  if (pending.empty()) return;
  file.Append(pending);
  pending.clear();
}

void RunFolder::LogMetrics(const Row& row) {
  episodes_.Flush();
  AppendRow(metrics_, row);
  metrics_.Flush();
}

void RunFolder::LogEpisode(const Row& row) {
  constexpr size_t kMany = 1 << 16;  // bytes
  AppendRow(episodes_, row);
  if (episodes_.pending.size() >= kMany) episodes_.Flush();
}

void RunFolder::LogEvaluation(const Row& row) {
  AppendRow(evals_, row);
  evals_.Flush();
}

void RunFolder::AppendRow(Table& table, const Row& row) {
  std::vector<std::string> names, cells;
  for (const auto& [name, value] : row) {
    names.push_back(name);
    cells.push_back(FormatNumber(value));
  }
  if (table.file.size() == 0 && table.pending.empty()) table.pending = Join(names, ",") + '\n';
  table.pending += Join(cells, ",") + '\n';

  Row scalars(row.begin() + 1, row.end());
  for (auto& [name, value] : scalars) name.insert(0, table.tag);
  AppendEvent(events_, static_cast<int64_t>(row.front().second), scalars);
}

void RunFolder::Log(std::string_view line) {
  const auto now = std::chrono::system_clock::now();
  log_.Append(fmt::format("{:%F %T}Z {}\n", fmt::gmtime(std::chrono::system_clock::to_time_t(now)),
                          Printable(line)));
}

void RunFolder::SaveCheckpoint(Tensors& checkpoint) {
  episodes_.Flush();
  // The tables must be on disk before the checkpoint with their sizes.
  for (size_t i = 0; i < kSizes.size(); ++i) {
    Growing().at(i)->Sync();
    checkpoint.AddScalar(kSizes.at(i), Growing().at(i)->size());
  }
  SaveTensors(checkpoint, path_ / kCheckpoint);
}

Row EpisodeRow(const TrainState& s, const FinishedEpisode& episode, const EnvSpec& spec) {
  Row row{{"step", s.steps},
          {"episode", s.episodes},
          {"return", episode.reward_sum},
          {"length", episode.length},
          {"terminated", episode.terminated ? 1 : 0}};
  const std::vector<std::string>& names = spec.term_names;
  for (size_t k = 0; k < names.size(); ++k) row.emplace_back(names[k], episode.terms[k]);
  return row;
}

Row MetricsRow(const TrainState& s, const Metrics& metrics) {
  Row row{{"step", s.steps}, {"episodes", s.episodes}};
  row.insert(row.end(), metrics.begin(), metrics.end());
  row.emplace_back("mean_return", s.mean_return());
  row.emplace_back("success_rate", s.last_success_rate);
  row.emplace_back("seconds", s.seconds);
  return row;
}

Row EvaluationCells(const TrainState& s, const Evaluation& e) {
  Row row{{"step", s.steps},
          {"success_rate", e.success_rate()},
          {"success_low", e.success_interval.low},
          {"success_high", e.success_interval.high}};
  for (const EvaluationFigure& figure : EvaluationFigures()) {
    if (figure.column != nullptr) row.emplace_back(figure.column, figure.Of(e));
  }
  row.emplace_back("seconds", s.seconds);
  return row;
}

}  // namespace upswing

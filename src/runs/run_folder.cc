#include "runs/run_folder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>

#include "base/archive.h"
#include "base/error.h"
#include "base/text.h"
#include "runs/tensor_file.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEventsName = "events.out.tfevents.0.upswing";
constexpr int64_t kLargestTable = int64_t{1} << 60;

// Files that grow during a run. The checkpoint contains their sizes.
constexpr std::array kTables{"metrics", "episodes", "evals", "events"};

/// The name of a table's size in the checkpoint.
std::string SizeName(std::string_view table) { return Concat("run/size/", table); }

/// Adds the sizes of kTables to a checkpoint.
void AddSizes(Tensors& checkpoint, const std::array<int64_t, kTables.size()>& sizes) {
  for (size_t i = 0; i < sizes.size(); ++i) {
    checkpoint.AddScalar(SizeName(kTables.at(i)), sizes.at(i));
  }
}

/// The size of a table in the checkpoint. Throws BadInput if the table, which has `size` bytes now,
/// is shorter.
int64_t KnownSize(const Tensors& checkpoint, std::string_view table, const fs::path& path,
                  int64_t size) {
  int64_t known = 0;
  Archive::Loader(checkpoint).Scalar(SizeName(table), known, {0, kLargestTable});
  if (size >= known) return known;
  throw BadInput(Concat(path.string(), ": expected at least the ", known,
                        " bytes that its checkpoint records, got ", size));
}

/// Column names in a table's first line; none if the file is empty.
std::vector<std::string> ColumnsOf(const AppendFile& file) {
  if (file.size() == 0) return {};
  std::string begin(std::min<int64_t>(file.size(), 1 << 16), '\0');  // no line of names is longer
  std::ifstream(file.path()).read(begin.data(), std::ssize(begin));
  std::string_view rest = begin;
  std::vector<std::string> columns;
  for (const std::string_view name : Split(TakeLine(rest), ',')) columns.emplace_back(name);
  return columns;
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

void RunFolder::Create(const fs::path& given,
                       const std::vector<std::pair<std::string, std::string>>& files,
                       Tensors& checkpoint) {
  const fs::path path = WithoutSlash(given);
  const fs::path place = FreePlace(path);
  try {
    if (place.has_parent_path()) MakeFolder(place.parent_path());
    Making folder(place, Making::Kind::kFolder);
    for (const auto& [name, text] : files) WriteFileAtomically(folder.path() / name, text);
    AddSizes(checkpoint, {0, 0, 0, 0});
    SaveTensors(checkpoint, CheckpointPath(folder.path()));
    folder.Publish();
  } catch (const Error& failure) {
    throw Error(failure.exit_code(),
                Concat("cannot make the run folder ", path.string(), ": ", failure.what()));
  }
}

RunFolder::RunFolder(fs::path path, const Tensors& checkpoint)
    : path_(std::move(path)),
      metrics_{"train/", AppendFile(path_ / kMetrics), {}, {}},
      episodes_{"episode/", AppendFile(path_ / kEpisodes), {}, {}},
      evals_{"evaluation/", AppendFile(path_ / kEvaluations), {}, {}},
      events_(path_ / kEventsName),
      log_(path_ / kLog) {
  // Check all sizes before any file is cut.
  const auto known = [&](std::string_view name, const auto& file) {
    return KnownSize(checkpoint, name, file.path(), file.size());
  };
  const int64_t metrics = known("metrics", metrics_.file);
  const int64_t episodes = known("episodes", episodes_.file);
  const int64_t evals = known("evals", evals_.file);
  const int64_t events = known("events", events_);
  metrics_.file.CutTo(metrics);
  episodes_.file.CutTo(episodes);
  evals_.file.CutTo(evals);
  events_.CutTo(events);
  for (Table* table : {&metrics_, &episodes_, &evals_}) table->columns = ColumnsOf(table->file);
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
  std::string text;
  if (table.columns.empty()) {
    for (const auto& [name, value] : row) table.columns.push_back(name);
    text = Join(table.columns, ",") + '\n';
  }
  for (const std::string& column : table.columns) {
    const auto cell = std::ranges::find(row, column, &Row::value_type::first);
    const double value =
        cell == row.end() ? std::numeric_limits<double>::quiet_NaN() : cell->second;
    text += Concat(&column == &table.columns.front() ? "" : ",", FormatNumber(value));
  }
  table.pending += text + '\n';

  Row scalars(row.begin() + 1, row.end());
  for (auto& [name, value] : scalars) name.insert(0, table.tag);
  events_.Append(static_cast<int64_t>(row.front().second), scalars);
}

void RunFolder::Log(std::string_view line) {
  const auto now = std::chrono::system_clock::now();
  log_.Append(fmt::format("{:%F %T}Z {}\n", fmt::gmtime(std::chrono::system_clock::to_time_t(now)),
                          Printable(line)));
}

void RunFolder::SaveCheckpoint(Tensors& checkpoint) {
  episodes_.Flush();
  // The tables must be on disk before the checkpoint with their sizes.
  for (const Table* table : {&metrics_, &episodes_, &evals_}) table->file.Sync();
  events_.Sync();
  AddSizes(checkpoint,
           {metrics_.file.size(), episodes_.file.size(), evals_.file.size(), events_.size()});
  SaveTensors(checkpoint, CheckpointPath(path_));
}

}  // namespace upswing

#include "rl/run_folder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEventsName = "events.out.tfevents.0.upswing";

/// Under which name a table's size stands in the checkpoint.
std::string SizeName(std::string_view table) { return Concat("run/size/", table); }

int64_t SizeOf(const TensorFile& checkpoint, std::string_view table) {
  int64_t size = 0;
  checkpoint.Read(SizeName(table), std::span(&size, 1));
  return size;
}

}  // namespace

void RunFolder::Create(const fs::path& path,
                       const std::vector<std::pair<std::string, std::string>>& files,
                       const std::function<void(TensorFile&)>& first_checkpoint) {
  std::error_code error;
  if (fs::exists(path, error) && !(fs::is_directory(path, error) && fs::is_empty(path, error))) {
    throw BadInput(Concat(path.string(),
                          ": exists already; a run is never overwritten (go on with ", "--resume ",
                          path.string(), ", or choose another --out)"));
  }
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  std::string making_name = Concat(path.string(), ".XXXXXX");
  if (mkdtemp(making_name.data()) == nullptr) {
    throw Failure(Concat("cannot make the run folder ", path.string(), ": ", std::strerror(errno)));
  }
  const fs::path making = making_name;
  try {
    fs::permissions(making, fs::perms(0755));  // mkdtemp makes it for the owner alone
    for (const auto& [name, text] : files) WriteFileAtomically(making / name, text);
    TensorFile checkpoint;
    for (const std::string_view table : {"metrics", "episodes", "evals", "events"}) {
      checkpoint.AddScalar(SizeName(table), int64_t{0});
    }
    first_checkpoint(checkpoint);
    checkpoint.Save(CheckpointPath(making));
    fs::rename(making, path);
  } catch (const std::exception& failure) {
    fs::remove_all(making, error);
    throw Failure(Concat("cannot make the run folder ", path.string(), ": ", failure.what()));
  }
}

RunFolder::RunFolder(fs::path path, const TensorFile& checkpoint)
    : path_(std::move(path)),
      lock_(path_),
      metrics_(OpenTable("metrics", "train/", checkpoint)),
      episodes_(OpenTable("episodes", "", checkpoint)),
      evals_(OpenTable("evals", "evaluation/", checkpoint)),
      events_(path_ / kEventsName, SizeOf(checkpoint, "events")),
      log_(path_ / "log.txt", AppendFile::kKeepAll) {}

RunFolder::Table RunFolder::OpenTable(std::string_view name, std::string tag,
                                      const TensorFile& checkpoint) const {
  return {std::move(tag), AppendFile(path_ / Concat(name, ".csv"), SizeOf(checkpoint, name))};
}

void RunFolder::AppendRow(Table& table, const Row& row) {
  std::string text;
  if (table.file.size() == 0) {
    for (const auto& [name, value] : row) text += (text.empty() ? "" : ",") + name;
    text += '\n';
  }
  for (size_t i = 0; i < row.size(); ++i) {
    text += Concat(i == 0 ? "" : ",", FormatNumber(row[i].second));
  }
  table.file.Append(text + '\n');

  if (table.tag.empty()) return;
  Row scalars(row.begin() + 1, row.end());
  for (auto& [name, value] : scalars) name.insert(0, table.tag);
  events_.Append(static_cast<int64_t>(row.front().second), scalars);
}

void RunFolder::Log(std::string_view line) {
  const auto now = std::chrono::system_clock::now();
  log_.Append(
      fmt::format("{:%F %T}Z {}\n", fmt::gmtime(std::chrono::system_clock::to_time_t(now)), line));
}

void RunFolder::SaveCheckpoint(TensorFile& checkpoint) const {
  checkpoint.AddScalar(SizeName("metrics"), metrics_.file.size());
  checkpoint.AddScalar(SizeName("episodes"), episodes_.file.size());
  checkpoint.AddScalar(SizeName("evals"), evals_.file.size());
  checkpoint.AddScalar(SizeName("events"), events_.size());
  checkpoint.Save(CheckpointPath(path_));
}

}  // namespace upswing

#include "rl/run_folder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <array>
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

/// Adds the sizes of metrics, episodes, evals and events.
void AddSizes(TensorFile& checkpoint, const std::array<int64_t, 4>& sizes) {
  constexpr std::array kTables{"metrics", "episodes", "evals", "events"};
  for (size_t i = 0; i < sizes.size(); ++i) {
    checkpoint.AddScalar(SizeName(kTables.at(i)), sizes.at(i));
  }
}

}  // namespace

void RunFolder::Create(const fs::path& given,
                       const std::vector<std::pair<std::string, std::string>>& files,
                       const std::function<void(TensorFile&)>& first_checkpoint) {
  fs::path path = given.lexically_normal();
  if (!path.has_filename()) path = path.parent_path();  // a slash at the end
  std::error_code error;
  const bool is_run = fs::exists(path / "config.toml", error);
  CheckFree(path, Concat(is_run ? Concat("go on with --resume ", path.string(), ", or ") : "",
                         "choose another --out"));
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  std::string making = Concat(path.string(), ".XXXXXX");
  const auto cannot = [&](int exit_code, std::string_view why) {
    return Error(exit_code, Concat("cannot make the run folder ", path.string(), ": ", why));
  };
  if (mkdtemp(making.data()) == nullptr) throw cannot(1, std::strerror(errno));
  try {
    fs::permissions(making, fs::perms(0755));  // mkdtemp makes it for the owner alone
    for (const auto& [name, text] : files) WriteFileAtomically(fs::path(making) / name, text);
    TensorFile checkpoint;
    AddSizes(checkpoint, {0, 0, 0, 0});
    first_checkpoint(checkpoint);
    checkpoint.Save(CheckpointPath(making));
    fs::rename(making, path);
  } catch (const Error& failure) {
    fs::remove_all(making, error);
    throw cannot(failure.exit_code(), failure.what());
  } catch (const fs::filesystem_error& failure) {
    fs::remove_all(making, error);
    throw cannot(1, failure.code().message());
  }
}

RunFolder::RunFolder(fs::path path, const TensorFile& checkpoint)
    : path_(std::move(path)),
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
  log_.Append(fmt::format("{:%F %T}Z {}\n", fmt::gmtime(std::chrono::system_clock::to_time_t(now)),
                          Printable(line)));
}

void RunFolder::SaveCheckpoint(TensorFile& checkpoint) const {
  // On disk before the checkpoint that knows of them.
  for (const Table* table : {&metrics_, &episodes_, &evals_}) table->file.Sync();
  events_.Sync();
  AddSizes(checkpoint,
           {metrics_.file.size(), episodes_.file.size(), evals_.file.size(), events_.size()});
  checkpoint.Save(CheckpointPath(path_));
}

}  // namespace upswing

#include "lab/many_runs.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <list>
#include <thread>

#include "core/error.h"
#include "core/text.h"
#include "io/child_process.h"
#include "io/file.h"
#include "io/machine.h"
#include "io/run_folder.h"
#include "io/tensor_file.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSettingsName = "settings.toml";  // of a variant, without seed

/// The end of a file, at most so many bytes.
std::string TailOf(const fs::path& path, std::streamoff bytes) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return "";
  const std::streamoff size = file.tellg();
  file.seekg(std::max<std::streamoff>(0, size - bytes));
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The last line that is not empty.
std::string LastLine(const fs::path& path) {
  const std::string tail = TailOf(path, 4096);
  std::string last = "its log is empty";
  for (const std::string_view line : Split(tail, '\n')) {
    if (!line.empty()) last = line;
  }
  constexpr std::string_view kProgram = "upswing: ";  // the caller's message begins with it, too
  return last.starts_with(kProgram) ? last.substr(kProgram.size()) : last;
}

// ---- Before anything runs.

/// Throws unless the folder is free or holds what `mark` stands for.
void CheckFolder(const fs::path& folder, const fs::path& mark) {
  std::error_code error;
  if (fs::is_regular_file(folder / mark, error)) return;
  CheckFree(folder, Concat("it has no ", mark.string(), " to resume from; choose another --out"));
}

/// Throws if `what` was made with settings `before` that cannot be resumed with those of `now`.
void CheckSame(Config before, Config now, bool more_steps, const std::string& what) {
  if (!before.mjcf.empty()) before.model = now.model;
  const auto counts = [&](const Option& option) {
    if (option.name == "steps") return !more_steps || now.train.steps < before.train.steps;
    return option.name == "stop_when_solved" || (option.identity && option.name != "seed");
  };
  try {
    ExpectSameSettings(OptionsOf(before), OptionsOf(now), what, counts);
    if (before.mjcf != now.mjcf) throw BadInput(Concat(what, ": made with another model"));
  } catch (const Error& other) {
    throw BadInput(Concat(other.what(), "; choose another --out"));
  }
}

/// Throws if it is a link: what is written there would land elsewhere.
void CheckNoLink(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_symlink(folder, error)) return;
  throw BadInput(Concat(folder.string(), ": expected a folder, got a link"));
}

/// Throws if what is in a variant's folder was made with other settings: one of its runs, or, where
/// none has begun, the settings themselves.
void CheckRuns(const fs::path& folder, const Config& config, bool more_steps) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (IsMakingName(entry.path().filename().string())) continue;
    if (!fs::is_regular_file(entry.path() / RunFolder::kConfig, error)) continue;
    CheckSame(ReadRunConfig(entry.path()), config, more_steps, entry.path().string());
  }
  const fs::path settings = folder / kSettingsName;
  if (!fs::is_regular_file(settings, error)) return;
  CheckSame(BuildConfig(settings, {}), config, more_steps, settings.string());
}

void WriteIfOther(const fs::path& path, const std::string& text) {
  std::error_code error;
  const bool is_own = fs::is_regular_file(fs::symlink_status(path, error));
  if (!is_own || ReadOwnFile(path) != text) WriteFileAtomically(path, text);
}

/// Writes what the runs begin with.
void WriteSettings(const ManyRuns& plan) {
  for (const Variant& variant : plan.variants) {
    const fs::path folder = plan.folder / variant.name;
    MakeFolder(folder);
    if (!variant.config.mjcf.empty()) WriteIfOther(folder / RunFolder::kModel, variant.config.mjcf);
    Config config = variant.config;
    const auto wanted = [](const Option& option) { return option.name != "seed"; };
    WriteIfOther(folder / kSettingsName, OptionsOf(config).Toml(true, wanted));
  }
  if (!plan.mark.first.empty()) WriteIfOther(plan.folder / plan.mark.first, plan.mark.second);
}

/// All runs, the first seed of each variant first.
std::vector<SeedRun> ListRuns(const ManyRuns& plan) {
  std::vector<SeedRun> runs;
  for (const int64_t seed : plan.seeds) {
    for (const Variant& variant : plan.variants) {
      const fs::path name = ManyRuns::NameOf(variant, seed);
      runs.push_back({&variant, seed, name.string(), plan.folder / name, {}, ""});
      try {
        runs.back().ReadState();
      } catch (const Error& error) {
        runs.back().problem = error.what();
      }
    }
  }
  return runs;
}

// ---- While they run.

/// The program's arguments that begin a run or resume it.
std::vector<std::string> ArgumentsOf(const SeedRun& run) {
  const TrainConfig& train = run.variant->config.train;
  if (!run.state) {
    const fs::path settings = run.path.parent_path() / kSettingsName;
    return {"train", Concat("--config=", settings.string()), Concat("--seed=", run.seed),
            Concat("--out=", run.path.string())};
  }
  return {"train",
          Concat("--resume=", run.path.string()),
          Concat("--steps=", train.steps),
          Concat("--threads=", train.threads),
          Concat("--checkpoint-every=", train.checkpoint_every),
          train.stop_when_solved ? "--stop-when-solved" : "--no-stop-when-solved"};
}

/// The processes, as many at a time as there are jobs.
class Scheduler {
 public:
  Scheduler(std::vector<SeedRun>& runs, int64_t jobs, ManyRunsObserver& observer)
      : jobs_(static_cast<size_t>(jobs)), observer_(observer) {
    for (SeedRun& run : runs) {
      if (!run.finished() && run.problem.empty()) waiting_.push_back(&run);
    }
  }

  /// Returns when all have ended; after a request to stop, those that run are stopped in order.
  void Run() {
    while (!running_.empty() || !waiting_.empty()) {
      const TrainRequest request = observer_.Poll();
      if (request == TrainRequest::kCheckpoint) SignalAll(SIGUSR1);
      if (request == TrainRequest::kStop && !stopping_) Stop();
      while (running_.size() < jobs_ && !waiting_.empty()) Start();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      for (auto it = running_.begin(); it != running_.end();) {
        const auto code = it->process.Poll();
        if (code) End(*it->run, *code);
        it = code ? running_.erase(it) : std::next(it);
      }
      observer_.Watch(RunningNow());
    }
  }

 private:
  struct Running {
    SeedRun* run;
    ChildProcess process;
  };

  void Start() {
    SeedRun& run = *waiting_.front();
    waiting_.pop_front();
    try {
      running_.push_back({&run, ChildProcess(ArgumentsOf(run), run.log())});
    } catch (const Error& error) {
      run.problem = error.what();
      observer_.End(run);
    }
  }

  void Stop() {
    stopping_ = true;
    waiting_.clear();
    SignalAll(observer_.stop_signal());
  }

  void SignalAll(int signal) {
    for (const Running& running : running_) running.process.Signal(signal);
  }

  void End(SeedRun& run, int code) {
    const bool asked_to_stop = stopping_ && code == 128 + observer_.stop_signal();
    try {
      run.ReadState();
      if (code != 0 && !asked_to_stop) {
        run.problem = code > 128 ? Concat("ended by signal ", code - 128) : LastLine(run.log());
      }
    } catch (const Error& error) {
      run.problem = error.what();
    }
    observer_.End(run);
  }

  std::vector<const SeedRun*> RunningNow() const {
    std::vector<const SeedRun*> runs;
    for (const Running& running : running_) runs.push_back(running.run);
    return runs;
  }

  size_t jobs_;
  ManyRunsObserver& observer_;
  bool stopping_ = false;
  std::list<SeedRun*> waiting_;
  std::list<Running> running_;
};

}  // namespace

fs::path ManyRuns::NameOf(const Variant& variant, int64_t seed) {
  return fs::path(variant.name) / Concat("seed", seed);
}

bool SeedRun::finished() const { return state && state->Finished(variant->config.train); }

int64_t SeedRun::Steps() const {
  if (finished()) return state->steps;
  const int64_t at_checkpoint = state ? state->steps : 0;
  // A row begins with its step; the last one may be half written.
  const std::string tail = TailOf(path / RunFolder::kMetrics, 1024);
  const std::vector<std::string_view> rows = Split(tail, '\n');
  if (rows.size() < 3) return at_checkpoint;
  const auto at_metrics = ParseInteger(Split(rows[rows.size() - 2], ',').front());
  return std::max(at_checkpoint, at_metrics.value_or(0));
}

void SeedRun::ReadState() {
  CheckNoLink(path);
  if (!fs::exists(path / RunFolder::kConfig)) return;
  const Tensors checkpoint = LoadPartOfTensors(RunFolder::CheckpointPath(path), "train/");
  const EnvSpec spec = SpecOf(variant->config.Environments());
  TrainState read(spec.num_envs, static_cast<int>(spec.term_names.size()));
  read.State(Archive::Loader(checkpoint).In("train"));
  state = std::move(read);
}

int TrainMany(const ManyRuns& plan, ManyRunsObserver& observer) {
  // Nothing is touched before all is checked, nor while another process is at work there.
  const bool is_study = !plan.mark.first.empty();
  CheckFolder(plan.folder, is_study ? fs::path(plan.mark.first) : fs::path(kSettingsName));
  std::error_code error;
  std::optional<FolderLock> lock;
  if (fs::exists(plan.folder, error)) lock.emplace(plan.folder);
  for (const Variant& variant : plan.variants) {
    if (!variant.name.empty()) CheckNoLink(plan.folder / variant.name);
    CheckRuns(plan.folder / variant.name, variant.config, plan.more_steps);
  }
  observer.Prepare();
  WriteSettings(plan);
  if (!lock) lock.emplace(plan.folder);

  std::vector<SeedRun> runs = ListRuns(plan);
  observer.Begin(runs);
  Scheduler(runs, plan.jobs, observer).Run();
  observer.Finish();

  if (observer.stop_signal() != 0) return 128 + observer.stop_signal();
  const size_t all = runs.size();
  std::erase_if(runs, [](const SeedRun& run) { return run.problem.empty(); });
  if (runs.empty()) return 0;
  throw Failure(Concat(runs.size(), " of ", all, " runs in ", plan.folder.string(),
                       " failed, the first of them ", runs.front().name, ": ",
                       runs.front().problem));
}

int DefaultJobs(int64_t threads) {
  return std::max(1, UsableProcessors() / static_cast<int>(std::max<int64_t>(1, threads)));
}

}  // namespace upswing

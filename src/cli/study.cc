// The command `study`: variants of the settings, each trained with many seeds.
#include <algorithm>
#include <cstdio>

#include "agents/config_checks.h"
#include "base/error.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/compare_report.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "cli/study_work.h"
#include "cli/train_many.h"
#include "os/command.h"
#include "os/file.h"
#include "os/host.h"
#include "os/lock_check.h"
#include "runs/seeds.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// The arguments of `study`.
struct StudyArguments {
  std::string file, out, seeds, keep, work, check_locks;
  int64_t jobs = 0;  // 0: one per processor
  bool status = false, prepare = false, as_json = false;

  fs::path folder() const {
    return out.empty() ? fs::path("runs") / fs::path(file).stem() : fs::path(out);
  }
};

/// Throws if the folder's plan is that of another study, which this one would replace: another
/// title, or a variant that this study lacks. TrainMany compares the settings.
void CheckSameStudy(const StudyPlan& before, const StudyPlan& plan) {
  const std::string where = (plan.folder / kPlanName).string();
  if (!before.title.empty() && before.title != plan.title) {
    throw BadInput(Concat(where, ": made with title \"", before.title, "\", but the study has \"",
                          plan.title, "\"; choose another --out"));
  }
  for (const Variant& variant : before.variants) {
    const std::string& name = variant.name;
    if (std::ranges::find(plan.variants, name, &Variant::name) != plan.variants.end()) continue;
    throw BadInput(Concat(where, ": made with a variant \"", name,
                          "\", which the study lacks; choose another --out"));
  }
}

ManyRuns ReadStudy(const StudyArguments& arguments) {
  const fs::path file = arguments.file;
  const std::optional<StudyPlan> before = PlanBefore(arguments.folder());
  ManyRuns many;
  many.study_file = ReadOwnFile(file);
  many.more_steps = true;
  StudyPlan& plan = many.plan;
  plan = ParseStudy(many.study_file, file.string(), before ? before->keep : Keep::kAll);
  plan.folder = arguments.folder();
  many.what = plan.title.empty() ? file.stem().string() : Concat("\"", plan.title, "\"");
  if (before) CheckSameStudy(*before, plan);
  if (!arguments.keep.empty()) plan.keep = ParseKeep(arguments.keep, "--keep");
  if (!arguments.seeds.empty()) plan.seeds = ParseSeeds(arguments.seeds, "--seeds");
  if (plan.seeds.empty()) {
    throw BadInput(
        Concat(file.string(), ": expected a line such as seeds = 10, or --seeds, got neither"));
  }
  if (before) SayKeptSeeds(KeepFinishedSeeds(*before, plan));
  many.jobs = arguments.jobs;
  if (many.jobs == 0) many.jobs = DefaultJobs(plan.variants.front().config.train.threads);
  for (const Variant& variant : plan.variants)
    CheckMemory(variant.config, AvailableMemory(), many.jobs);
  return many;
}

/// The study file of this name, or the one that the package has under it.
std::string FindStudy(const std::string& file) {
  if (file.empty() || Exists(file) || !IsInstalled()) return file;
  const fs::path shipped = SharePath() / file;
  return IsFile(shipped) ? shipped.string() : file;
}

/// Compares the finished runs of a study.
int CompareStudy(const StudyPlan& plan) {
  const Comparison comparison = CompareRuns(plan);
  const std::vector<std::string> files = WriteComparison(comparison, plan.folder);
  WriteEvaluations(plan);
  Say("All evaluations of all runs: evaluations.csv\n");
  PrintComparison(comparison);
  PrintWritten(files);
  return 0;
}

/// Tests the locks of a folder with the same command on another host. Returns the exit code.
int CheckLocksOf(const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    throw BadInput(Concat("--check-locks: expected a folder, got ", folder.string()));
  }
  constexpr double kPatience = 300;  // s
  Say("Start the same command on another host that shares {}; waiting at most {:.0f} s\n",
      Printable(folder.string()), kPatience);
  std::fflush(stdout);
  InstallSignalHandlers("");
  const auto check = CheckLocks(folder, kPatience, [] { return StopSignal() != 0; });
  if (!check) return 128 + StopSignal();
  const std::string processes = Printable(Concat(check->mine, " and ", check->other));
  if (!check->excludes) {
    throw Failure(
        Concat(folder.string(), ": locks do not exclude: ", processes,
               " held one at the same time; expected NFSv4 without nolock and local_lock"));
  }
  Say("Locks exclude: of {}, neither got a lock that the other held\n", processes);
  if (check->same_host) {
    Say("Both processes ran on this host. Two hosts tell whether locks exclude between them.\n");
  }
  return 0;
}

int RunStudy(const StudyArguments& arguments) {
  if (!arguments.check_locks.empty()) return CheckLocksOf(arguments.check_locks);
  if (!arguments.work.empty()) return WorkOnStudy(arguments.work);
  if (arguments.status) {
    const bool is_folder = fs::is_directory(arguments.file);
    const fs::path folder = is_folder ? fs::path(arguments.file) : arguments.folder();
    if (!Exists(arguments.file) && !Exists(folder)) {
      throw BadInput(
          Concat(arguments.file, ": no such file or folder; expected a study's file or folder"));
    }
    if (Exists(arguments.file) && !is_folder) {  // names a mistake in the file
      (void)ParseStudy(ReadOwnFile(arguments.file), arguments.file);
    }
    return PrintStudyStatus(folder, arguments.as_json);
  }
  const ManyRuns many = ReadStudy(arguments);
  if (arguments.prepare) {
    Prepare(many);
    Say("Prepared {}. Next, on any host that shares the folder:\n  {} study --work {}\n",
        Printable(many.plan.folder.string()), LaunchCommand(),
        ShellQuoted(Printable(many.plan.folder.string())));
    return 0;
  }
  SayIfNoFigures();
  const int exit_code = TrainMany(many);
  return exit_code != 0 ? exit_code : CompareStudy(many.plan);
}

/// Throws if the arguments contradict each other.
void CheckArguments(const StudyArguments& arguments) {
  if (!arguments.check_locks.empty() && !arguments.file.empty()) {
    throw BadInput("--check-locks: expected no FILE.toml with it");
  }
  if (arguments.check_locks.empty() && arguments.work.empty() == arguments.file.empty()) {
    throw BadInput(arguments.file.empty()
                       ? "study: expected FILE.toml or --work FOLDER, got neither"
                       : "--work: expected no FILE.toml with it");
  }
  if (arguments.as_json && !arguments.status) {
    throw BadInput("--json: expected --status with it; `compare FOLDER --json` prints the results");
  }
}

}  // namespace

void AddStudy(CommandLine& line) {
  StudyArguments& arguments = line.Runs(RunStudy);
  line.Text("file", arguments.file, "FILE.toml", "study file: variants, settings and seeds");
  line.Text("--out", arguments.out, "FOLDER", "folder of the study (default runs/FILE)");
  AddManyOptions(line, arguments.seeds, arguments.jobs);
  line.Text(
      "--keep", arguments.keep, "WHAT",
      "files of a finished run to keep: all, policy (policy, settings, evaluations and log) or "
      "tables (only its rows in the study's tables) (default all, or FILE's value)",
      "all, policy or tables");
  line.Flag("--status", arguments.status,
            "print the number of runs in each state, and exit; also takes the study's folder");
  line.Flag("--json", arguments.as_json, "print the status as JSON");
  line.Flag("--prepare", arguments.prepare, "prepare the folder for workers, and exit");
  line.Text("--work", arguments.work, "FOLDER",
            "work on the study in this folder, on any host that shares it: claim and train runs "
            "until none is left");
  line.Text("--check-locks", arguments.check_locks, "FOLDER",
            "with the same command on another host: test whether locks in this folder exclude each "
            "other, as workers on several hosts need, and exit");
  line.Notes(
      "A study file:\n"
      "  title = \"What does layer normalisation do?\"\n"
      "  seeds = 10                   # 1 to 10, or \"3,5,8-12\"\n"
      "  [settings]                   # for all variants, as in a configuration file\n"
      "  agent = \"d3qn-small\"\n"
      "  steps = 300000\n"
      "  [variants.with]\n"
      "  [variants.without]\n"
      "  layer_norm = false\n"
      "\nThe folder of a run is FOLDER/VARIANT/seedN, its log is FOLDER/VARIANT/seedN.log. The\n"
      "same command resumes stopped and killed runs; finished runs stay unchanged.\n"
      "Exit code 0: done; 1: a run failed; 2: bad usage or input; 130 or 143: stopped. A\n"
      "worker that a signal stops has exit code 75; any worker can resume its run.\n");
  line.Examples(
      "  ./upswing study configs/studies/post.toml\n"
      "  ./upswing study configs/studies/post.toml --seeds 3 --out runs/short\n"
      "  ./upswing study configs/studies/post.toml --status\n"
      "  ./upswing study --work runs/post          one more worker, on any host\n"
      "  ./upswing study --check-locks runs        on two hosts at the same time, before a "
      "study\n");
  line.Check([&arguments] {
    CheckArguments(arguments);
    arguments.file = FindStudy(arguments.file);
  });
  line.Excludes("--work", {"--out", "--seeds", "--jobs", "--keep", "--status", "--prepare"});
  line.Excludes("--check-locks",
                {"--out", "--seeds", "--jobs", "--keep", "--status", "--prepare", "--work"});
  line.Excludes("--status", {"--seeds", "--jobs", "--keep", "--prepare"});
}

}  // namespace upswing

#include "runs/slurm.h"

#include <algorithm>

#include "base/error.h"
#include "base/text.h"
#include "os/command.h"
#include "os/file.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScriptName = "slurm.sh";
// The parts of the script.
constexpr std::string_view kBegin = R"sh(#!/bin/sh
# Workers of the study in this folder, the tasks of a job array; written by `upswing study --slurm`.
#SBATCH --job-name=upswing
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --signal=B:USR2@120
)sh";
constexpr std::string_view kSignals = R"sh(
# Slurm sends TERM where the task is preempted or cancelled, and USR2 two minutes before its time is
# up: the worker then writes a checkpoint and ends with 75.
stop() {
  trap '' TERM USR1 USR2
  warned=$1
  kill -USR2 "$worker"
  wait "$worker"
  finish $?
}

# Asks to be queued again, unless it is Slurm that ends the task, which then knows what comes next.
finish() {
  task=${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID
  if [ "$1" = 75 ]; then
    if [ -n "$warned" ] || [ "$(squeue --noheader --jobs="$task" --format=%T)" = RUNNING ]; then
      scontrol requeue "$task"
    fi
  fi
  exit "$1"
}
)sh";
constexpr std::string_view kWork = R"sh( &
worker=$!
warned=
trap 'stop ""' TERM
trap 'stop yes' USR1 USR2
wait "$worker"
finish $?
)sh";

constexpr const char* kNumberName = "array";  // file in SlurmFolder with sbatch's answer

Error NoSbatch() {
  return Failure(
      "--slurm: expected Slurm's program sbatch, found none in PATH; run the command on a login "
      "node of the cluster");
}

/// An absolute path for a script. Throws BadInput if a character would end its line or change its
/// meaning.
std::string PathForScript(const fs::path& path) {
  std::string text = fs::absolute(path).lexically_normal().string();
  if (text.size() > 1 && text.ends_with('/')) text.pop_back();
  // Reject a backslash: after it, Slurm would not replace %A and similar patterns.
  if (Printable(text) != text || text.find('\\') != text.npos) {
    throw BadInput(
        Concat("--slurm: expected a folder name of printable characters without \\, got ", text));
  }
  return text;
}

/// Escapes a path for an option of Slurm, which replaces patterns such as %A.
std::string WithoutPatterns(const std::string& path) {
  std::string text;
  for (const char c : path) text += c == '%' ? "%%" : std::string(1, c);
  return text;
}

/// Whether options of sbatch set the tasks of an array.
bool HaveArray(const std::string& options) {
  return std::ranges::any_of(Split(options, ' '), [](std::string_view word) {
    return word.starts_with("--ar") || (word.starts_with("-a") && !word.starts_with("--"));
  });
}

/// The error message of a Slurm command, on one line.
std::string Complaint(const CommandResult& result) {
  std::vector<std::string> lines;
  for (std::string_view line : Split(result.errors, '\n')) {
    constexpr std::string_view kPrefix = ": error: ";
    if (const size_t at = line.find(kPrefix); at != line.npos)
      line.remove_prefix(at + kPrefix.size());
    if (!line.empty()) lines.emplace_back(line);
  }
  if (lines.empty())
    return result.signal != 0 ? Concat("signal ", result.signal) : "it said nothing";
  return Printable(Join(lines, "; "));
}

}  // namespace

void CheckSlurm() {
  if (!RunCommand({"sbatch", "--version"})) throw NoSbatch();
}

void CheckSlurmOptions(const std::string& options) {
  if (Printable(options) != options) {
    throw BadInput(Concat("--slurm: expected options of sbatch on one line, got ", options));
  }
  if (!options.empty() && !Trim(options).starts_with('-')) {
    throw BadInput(
        Concat("--slurm: expected options of sbatch such as \"--partition=short "
               "--time=2:00:00\", got \"",
               options, "\""));
  }
}

std::string SlurmScript(const StudyPlan& plan, const std::string& options, int64_t tasks) {
  CheckSlurmOptions(options);
  const std::string folder = PathForScript(plan.folder);
  const std::string log = WithoutPatterns(PathForScript(SlurmFolder(plan.folder))) + "/%A_%a.log";
  int64_t threads = 1;
  for (const Variant& variant : plan.variants) {
    threads = std::max(threads, variant.config.train.threads);
  }
  std::string own;
  if (!HaveArray(options)) own += Concat("#SBATCH --array=1-", tasks, "\n");
  if (threads > 1) own += Concat("#SBATCH --cpus-per-task=", threads, "\n");
  if (!options.empty()) own += Concat("#SBATCH ", Trim(options), "\n");
  return Concat(kBegin, "#SBATCH --output=", ShellQuoted(log), "\n", own, kSignals, "\n",
                ShellQuoted(PathForScript(ProgramPath())), " study --work ", ShellQuoted(folder),
                kWork);
}

fs::path SlurmFolder(const fs::path& study) { return study / "slurm"; }

SlurmArray SlurmArray::Submit(const fs::path& folder, const std::string& script) {
  CheckNoLink(SlurmFolder(folder));
  MakeFolder(SlurmFolder(folder));
  const fs::path path = folder / kScriptName;
  WriteFileAtomically(path, script);
  const auto done = RunCommand({"sbatch", "--parsable", fs::absolute(path).string()});
  if (!done) throw NoSbatch();
  if (!done->succeeded()) throw Failure(Concat("sbatch refused: ", Complaint(*done)));
  const auto array = Parse(done->output);
  if (!array) {
    throw Failure(Concat("sbatch: expected a job number, got \"", Printable(done->output), "\""));
  }
  WriteFileAtomically(SlurmFolder(folder) / kNumberName, done->output);
  return *array;
}

std::optional<SlurmArray> SlurmArray::LastOf(const fs::path& folder) {
  const fs::path path = SlurmFolder(folder) / kNumberName;
  if (!IsOwnFile(path)) return std::nullopt;
  return Parse(ReadOwnFile(path, 1000));
}

std::optional<SlurmArray> SlurmArray::Parse(std::string_view text) {
  // Format: NUMBER or NUMBER;CLUSTER.
  const std::vector<std::string_view> parts = Split(Trim(text), ';');
  const auto is_plain = [](std::string_view part) {
    return !part.empty() && std::ranges::all_of(part, [](char c) {
      return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
             c == '-' || c == '_' || c == '.';
    });
  };
  if (parts.size() > 2 || !std::ranges::all_of(parts, is_plain)) return std::nullopt;
  if (!std::ranges::all_of(parts[0], [](char c) { return c >= '0' && c <= '9'; }))
    return std::nullopt;
  return SlurmArray(std::string(parts[0]), parts.size() == 2 ? std::string(parts[1]) : "");
}

std::optional<int64_t> SlurmArray::TasksLeft() const {
  std::vector<std::string> words{"squeue", "--noheader", "--array", "--jobs=" + number_,
                                 "--format=%i"};
  if (!cluster_.empty()) words.push_back("--clusters=" + cluster_);
  const auto done = RunCommand(words);
  if (!done) return std::nullopt;
  if (!done->succeeded()) {
    // Slurm forgets a job some time after its end.
    if (done->errors.find("Invalid job id") != std::string::npos) return 0;
    return std::nullopt;
  }
  return std::ranges::count_if(Split(done->output, '\n'),
                               [this](std::string_view line) { return line.starts_with(number_); });
}

std::string SlurmArray::CancelCommand() const {
  return Concat("scancel ", cluster_.empty() ? "" : Concat("--clusters=", cluster_, " "), number_);
}

}  // namespace upswing

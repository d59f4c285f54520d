// The command `grade`: a leaderboard of the policies of a class.
#include "judge/grade.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "base/thread_pool.h"
#include "cli/commands.h"
#include "cli/progress.h"
#include "os/file.h"
#include "os/host.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

struct GradeArguments {
  std::string folder, out;
  GradeConfig config;
  int64_t threads = 0;
};

void PrintGrades(const std::vector<Grade>& grades, const GradeConfig& config) {
  constexpr const char* kRow = "{:>4}  {:<24}  {:>9}  {:>9}  {:>9}  {:>9}  {:>9}\n";
  const std::string box = config.plants > 0 ? "±25%" : "";
  fmt::print(kRow, "", "", "success", "return", box, "Δτ N·m/s", "energy J");
  const auto share = [](const Evaluation& e) {
    return e.episodes == 0 ? "" : fmt::format("{:.1f}%", 100 * e.success_rate());
  };
  for (const Grade& grade : grades) {
    if (!grade.refused.empty()) {
      fmt::print("      {}  refused: {}\n", Printable(grade.name), OneLine(grade.refused));
      continue;
    }
    const Evaluation& e = grade.nominal;
    fmt::print(kRow, grade.rank, Shortened(Printable(grade.name), 24), share(e),
               fmt::format("{:.2f}", e.reward_sum.mean), share(grade.random),
               fmt::format("{:.2f}", e.torque_variation.mean), fmt::format("{:.2f}", e.work.mean));
    if (!grade.note.empty()) fmt::print("      {}\n", Printable(grade.note));
  }
}

/// Throws BadInput unless --out is a new folder outside the folder of the class, whose entries are
/// graded.
void CheckOut(const GradeArguments& a) {
  CheckFree(a.out);
  std::error_code error;
  const fs::path folder = fs::canonical(a.folder, error);
  const fs::path out = fs::weakly_canonical(fs::absolute(a.out), error);
  const fs::path below = out.lexically_relative(folder);
  if (folder.empty() || below.empty() || *below.begin() == "..") return;
  throw BadInput(Concat("--out: expected a folder outside ", Printable(a.folder),
                        ", whose entries are graded, got ", Printable(a.out)));
}

int RunGrade(const GradeArguments& a) {
  if (!a.out.empty()) CheckOut(a);
  ThreadPool pool(ResolveThreads(a.threads), a.threads == 0);
  const std::vector<Grade> grades = [&] {
    EpisodeProgress progress(false);
    return GradeFolder(a.folder, a.config, pool, std::ref(progress));
  }();
  PrintGrades(grades, a.config);
  if (!a.out.empty()) {
    const fs::path table = fs::path(a.out) / "table.csv", page = fs::path(a.out) / "index.html";
    MakeNewFolder(a.out);
    WriteFileAtomically(table, GradesCsv(grades));
    WriteFileAtomically(page, GradesPage(grades, a.config));
    fmt::print("written: {}, {}\n", Printable(table.string()), Printable(page.string()));
  }
  return std::ranges::all_of(grades, &std::string::empty, &Grade::refused) ? 0 : 1;
}

}  // namespace

void AddGrade(CommandLine& line) {
  GradeArguments& a = line.Runs<const GradeArguments&>(RunGrade);
  line.Text("folder", a.folder, "FOLDER",
            "folder with NAME.safetensors or NAME/policy.safetensors of each student or team");
  line.Require("folder");
  Options own;
  a.config.Describe(own);
  line.Arguments(own);
  line.Text("--out", a.out, "FOLDER",
            "new folder for table.csv and index.html, a page with the leaderboard and the moving "
            "pendulums that needs no network");
  AddThreads(line, a.threads);
  line.Notes(
      "All policies have the same start states and the same random plants. They are sorted\n"
      "by success on the nominal plant, then by return. Δτ is smoothness, the change of the\n"
      "torque per second: less is smoother. Energy is what the motor puts in and takes out\n"
      "in an episode. `eval` explains success and return, and has more figures.\n"
      "Entries with the same success and return share a rank. A line names a copy of another\n"
      "entry's file, and the plant of a training if it is another one.\n\n"
      "The same files give the same table on every machine. Therefore physics is the closed\n"
      "form, and kernels use no fused multiply-adds: figures may differ from those of `eval`\n"
      "in the last digits.\n\n"
      "A link, another file, a checkpoint, a policy of another task, and a file above 8 MiB are\n"
      "refused, each with a line. Exit code: 0 if all are graded, 1 if some are refused,\n"
      "2 for bad usage.\n");
  line.Examples(
      "  ./upswing grade class\n"
      "  ./upswing grade class --out class-table\n"
      "  ./upswing grade class --episodes 1000 --plants 1000 --seed 7\n");
}

}  // namespace upswing

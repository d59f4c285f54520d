// A study: variants of the settings, each trained with many seeds.
#include <algorithm>
#include <memory>

#include "apps/commands.h"
#include "apps/compare_report.h"
#include "apps/many_runs_view.h"
#include "core/error.h"
#include "core/text.h"
#include "io/file.h"
#include "lab/config_checks.h"
#include "lab/many_runs.h"
#include "lab/seeds.h"
#include "lab/study_file.h"
#include "report/figure.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// What was typed.
struct StudyArguments {
  std::string file, out, seeds;
  int64_t jobs = 0;  // 0: as many as there are processors
};

/// Throws if the folder belongs to another study, which this one would replace: one with another
/// title, or with a variant that this one does not have. (TrainMany compares the settings.)
void CheckSameStudy(const ManyRuns& plan, const std::string& title) {
  const fs::path file = plan.folder / plan.mark.first;
  const std::string where = file.string();
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return;
  const StudyOutline before = ParseStudyOutline(ReadTextFile(file), where);
  if (before.title != title) {
    throw BadInput(Concat(where, ": made with title \"", before.title, "\", but the study says \"",
                          title, "\"; choose another --out"));
  }
  for (const std::string& name : before.variants) {
    if (std::ranges::find(plan.variants, name, &Variant::name) != plan.variants.end()) continue;
    throw BadInput(Concat(where, ": made with a variant \"", name,
                          "\", which the study does not have; choose another --out"));
  }
}

ManyRuns ReadStudy(const StudyArguments& arguments) {
  const fs::path file = arguments.file;
  const std::string text = ReadTextFile(file);
  StudyFile study = ParseStudy(text, file.string());

  ManyRuns plan;
  plan.what = study.title.empty() ? file.stem().string() : Concat("\"", study.title, "\"");
  plan.folder = arguments.out.empty() ? fs::path("runs") / file.stem() : fs::path(arguments.out);
  plan.mark = {"study.toml", text};
  plan.variants = std::move(study.variants);
  plan.more_steps = plan.compared = true;
  CheckSameStudy(plan, study.title);
  plan.seeds =
      arguments.seeds.empty() ? std::move(study.seeds) : ParseSeeds(arguments.seeds, "--seeds");
  if (plan.seeds.empty()) {
    throw BadInput(Concat(file.string(), ": expected \"seeds = 10\" or the like, or --seeds"));
  }
  plan.jobs = arguments.jobs;
  if (plan.jobs == 0) plan.jobs = DefaultJobs(plan.variants.front().config.train.threads);
  for (const Variant& variant : plan.variants) CheckMemory(variant.config, plan.jobs);
  return plan;
}

int RunStudy(const StudyArguments& arguments) {
  const ManyRuns plan = ReadStudy(arguments);
  CheckCanDraw();  // before hours of training, not after
  ManyRunsView view(plan);
  const int exit_code = TrainMany(plan, view);
  if (exit_code != 0) return exit_code;
  // All runs are done: compare them.
  CompareRequest request;
  request.root = plan.folder;
  request.different_tasks = true;
  for (const Variant& variant : plan.variants) {
    for (const int64_t seed : plan.seeds) {
      request.paths.push_back(plan.folder / ManyRuns::NameOf(variant, seed));
    }
  }
  const Comparison comparison = Compare(request);
  WriteComparison(comparison, plan.folder);
  PrintComparison(comparison, plan.folder);
  return 0;
}

}  // namespace

void AddStudy(CLI::App& program, Command& command) {
  CLI::App* app =
      program.add_subcommand("study", "Train variants of the settings, many seeds each");
  auto arguments = std::make_shared<StudyArguments>();
  app->add_option("file", arguments->file, "what to train: variants, settings, seeds")
      ->type_name("FILE.toml")
      ->required()
      ->check(NotEmpty());
  app->add_option("--out", arguments->out, "folder of the study [runs/FILE]")
      ->type_name("FOLDER")
      ->check(NotEmpty());
  AddManyOptions(*app, arguments->seeds, arguments->jobs);
  app->footer(
      "A study file:\n"
      "  title = \"What does layer normalisation do?\"\n"
      "  seeds = 10                   # 1 to 10, or \"3,5,8-12\"\n"
      "  [settings]                   # of all variants, as in a configuration file\n"
      "  agent = \"d3qn-small\"\n"
      "  steps = 300000\n"
      "  [variants.with]\n"
      "  [variants.without]\n"
      "  layer_norm = false\n"
      "\nExamples:\n"
      "  ./upswing study configs/studies/post.toml\n"
      "  ./upswing study configs/studies/post.toml --seeds 3 --out runs/short\n"
      "\nEach run lies in FOLDER/VARIANT/seedN, what it prints in FOLDER/VARIANT/seedN.log. The\n"
      "same command resumes what was stopped or killed; finished runs are left as they are.\n"
      "Exit code 0: done; 1: a run failed; 2: bad usage or input; 130, 143: stopped.\n");
  app->callback([arguments, &command] { command = [arguments] { return RunStudy(*arguments); }; });
}

}  // namespace upswing
